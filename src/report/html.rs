//! The report as one page: a template and plots, no network.

use std::path::Path;

use minijinja::{Environment, Value, context};

use super::plots::plots;
use super::{Report, ReportError};

/// Writes the page.
///
/// # Errors
/// When the file cannot be written.
pub fn write_html(path: &Path, report: &Report) -> Result<(), ReportError> {
    let made = |e: minijinja::Error| ReportError::Make { file: "report.html", reason: e.to_string() };
    let mut environment = Environment::new();
    environment.add_filter("ms", |v: Value| decimals(v, 3));
    environment.add_filter("mib", |v: Value| match f64::try_from(v) {
        Ok(v) => format!("{:.1}", v / MIB),
        Err(_) => "-".to_string(),
    });
    environment.add_filter("known", |v: Value| if v.is_none() { Value::from("-") } else { v });
    // The name ends in .html, so values are escaped.
    environment.add_template("report.html", include_str!("report.html")).map_err(made)?;
    let template = environment.get_template("report.html").map_err(made)?;
    let plots = plots(report);
    let section = &report.comparison_section;
    let page = template
        .render(context! { plots, section, style => STYLE, ..Value::from(minijinja::value::Serde(report)) })
        .map_err(made)?;
    std::fs::write(path, page).map_err(|reason| ReportError::Write { path: path.into(), reason })
}

/// Looks of every page.
pub(super) const STYLE: &str = include_str!("page.css");

/// Bytes of a mebibyte.
pub(super) const MIB: f64 = 1_048_576.0;

/// A number, or a dash where there is none.
fn decimals(v: Value, places: usize) -> String {
    match f64::try_from(v) {
        Ok(v) => format!("{v:.places$}"),
        Err(_) => "-".to_string(),
    }
}
