//! The report as one page: a template and plots, no network.

use std::path::Path;

use kuva::prelude::{Layout, LinePlot, Plot, render_to_svg};
use minijinja::{Environment, Value, context};

use super::{Report, ReportError};

/// Writes the page.
///
/// # Errors
/// When the file cannot be written.
pub fn write_html(path: &Path, report: &Report) -> Result<(), ReportError> {
    let made = |e: minijinja::Error| ReportError::Make { file: "report.html", reason: e.to_string() };
    let mut environment = Environment::new();
    environment.add_filter("ms", |v: Value| match f64::try_from(v) {
        Ok(v) => format!("{v:.3}"),
        Err(_) => "-".to_string(),
    });
    // The name ends in .html, so values are escaped.
    environment.add_template("report.html", include_str!("report.html")).map_err(made)?;
    let template = environment.get_template("report.html").map_err(made)?;
    let plots = plots(report);
    let page =
        template.render(context! { plots, ..Value::from(minijinja::value::Serde(report)) }).map_err(made)?;
    std::fs::write(path, page).map_err(|reason| ReportError::Write { path: path.into(), reason })
}

/// Frame time along the path, then upload a frame.
fn plots(report: &Report) -> Vec<String> {
    if report.rows.is_empty() {
        return Vec::new();
    }
    let line = |title: &str, y_label: &str, points: Vec<(f64, f64)>| {
        let line = LinePlot::new().with_data(points).with_color("#0072b2");
        let plots: Vec<Plot> = vec![line.into()];
        let layout = Layout::auto_from_plots(&plots)
            .with_title(title)
            .with_x_label("path time, s")
            .with_y_label(y_label);
        render_to_svg(plots, layout)
    };
    vec![
        line("Frame time along the path", "ms", report.rows.iter().map(|r| (r.t_s, r.frame_ms)).collect()),
        line(
            "Heights uploaded a frame",
            "bytes",
            report.rows.iter().map(|r| (r.t_s, r.height_bytes as f64)).collect(),
        ),
    ]
}
