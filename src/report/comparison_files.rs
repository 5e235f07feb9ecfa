//! The files of a comparison and its part of a page.

use std::path::Path;

use minijinja::value::Serde;
use minijinja::{Value, context};
use serde::Serialize;

use super::ReportError;
use super::comparison::{Comparison, ComparisonReport, MethodRow, UploadPerFrame};
use super::comparison_plots::{Figure, path_figures, upload_figure};
use super::files::{table, write};
use super::html::{MIB, STYLE};

/// One row of fronts.csv.
#[derive(Serialize)]
struct FrontRow<'a> {
    path: &'a str,
    method: &'a str,
    detail_words: &'a str,
    detail: String,
    p99_px: Option<f64>,
    median_ms: f64,
    p95_ms: Option<f64>,
    p99_ms: Option<f64>,
    triangles: Option<f64>,
    gpu_bytes: u64,
    dominated: bool,
    on_outer_front: bool,
}

fn front_rows(comparison: &Comparison) -> Vec<FrontRow<'_>> {
    let mut rows = Vec::new();
    for path in &comparison.paths {
        for front in &path.fronts {
            rows.extend(front.points.iter().map(|p| FrontRow {
                path: &path.path,
                method: front.method,
                detail_words: &p.detail_words,
                detail: p.detail.to_string(),
                p99_px: p.p99_px,
                median_ms: p.median_ms,
                p95_ms: p.p95_ms,
                p99_ms: p.p99_ms,
                triangles: p.triangles,
                gpu_bytes: p.gpu_bytes,
                dominated: p.dominated,
                on_outer_front: p.on_outer_front,
            }));
        }
    }
    rows
}

/// Writes report.json, samples.csv, fronts.csv, uploads.csv and report.html into `dir`, which is made where
/// it is missing.
///
/// # Errors
/// When the directory or a file cannot be written.
pub fn write_comparison(dir: &Path, report: &ComparisonReport) -> Result<(), ReportError> {
    std::fs::create_dir_all(dir).map_err(|reason| ReportError::Write { path: dir.into(), reason })?;
    let json = serde_json::to_vec_pretty(report)
        .map_err(|e| ReportError::Make { file: "report.json", reason: e.to_string() })?;
    write(dir, "report.json", &json)?;
    write(dir, "samples.csv", &table("samples.csv", &report.samples)?)?;
    write(dir, "fronts.csv", &table("fronts.csv", &front_rows(&report.comparison))?)?;
    write(dir, "uploads.csv", &table("uploads.csv", &report.comparison.uploads)?)?;
    write(dir, "report.html", rendered(report, true)?.as_bytes())
}

/// Figures of one path's part of the page.
#[derive(Serialize)]
struct PathView {
    figures: Vec<Figure>,
    uploads: Vec<UploadPerFrame>,
}

/// The comparison as a part of a page: headings from h2 on, tables and plots; no network, no scripts.
///
/// # Errors
/// When the template cannot be filled in.
pub fn comparison_section(report: &ComparisonReport) -> Result<String, ReportError> {
    rendered(report, false)
}

/// The section, with a page around it or alone.
fn rendered(report: &ComparisonReport, page: bool) -> Result<String, ReportError> {
    let comparison = &report.comparison;
    let views: Vec<PathView> = comparison
        .paths
        .iter()
        .map(|path| PathView {
            figures: path_figures(path, &report.samples),
            uploads: path.methods.iter().map(MethodRow::upload_per_frame).collect(),
        })
        .collect();
    let upload_figure = upload_figure(&comparison.uploads);
    let shares: Vec<[f64; 2]> =
        comparison.uploads.iter().map(|row| [row.start_share(), row.frame_share()]).collect();
    let values = context! {
        page,
        style => STYLE,
        environment => Value::from(Serde(&report.environment)),
        scene => Value::from(Serde(&report.scene)),
        comparison => Value::from(Serde(comparison)),
        views => Value::from(Serde(&views)),
        upload_figure => Value::from(Serde(&upload_figure)),
        view_shares => Value::from(Serde(&shares)),
    };
    let mut environment = minijinja::Environment::new();
    environment.add_filter("fixed", |v: Value, places: usize| shown(&v, |v| format!("{v:.places$}")));
    environment.add_filter("mib", |v: Value| shown(&v, |v| format!("{:.2}", v / MIB)));
    environment.add_filter("percent", |v: Value| shown(&v, |v| format!("{:.2} %", 100.0 * v)));
    environment.add_filter("percent4", |v: Value| shown(&v, |v| format!("{:.4} %", 100.0 * v)));
    // The name ends in .html, so values are escaped.
    environment
        .render_named_str("comparison.html", include_str!("comparison.html"), values)
        .map_err(|e| ReportError::Make { file: "report.html", reason: e.to_string() })
}

/// A number, or a dash where there is none.
fn shown(v: &Value, format: impl Fn(f64) -> String) -> String {
    match f64::try_from(v.clone()) {
        Ok(v) if v.is_finite() => format(v),
        _ => "-".to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::comparison_plots::made_up;
    use super::*;

    #[test]
    fn the_section_says_everything_and_needs_no_network() {
        let report = made_up::report();
        let section = comparison_section(&report).unwrap();
        for part in ["<h2>", "<svg", "fewer than", "brute-force", "reason &lt;given&gt;", "n 127", "0.63"] {
            assert!(section.contains(part), "{part}");
        }
        let page = rendered(&report, true).unwrap();
        assert!(page.starts_with("<!doctype html>") && page.trim_end().ends_with("</html>"));
        for html in [&section, &page] {
            assert!(!html.contains("http") && !html.contains("<script") && !html.contains("none<"));
        }
    }

    #[test]
    fn all_files_are_written_with_a_run_for_every_method_on_every_path() {
        let dir = tempfile::tempdir().unwrap();
        let report = made_up::report();
        write_comparison(dir.path(), &report).unwrap();
        let read = |file: &str| std::fs::read_to_string(dir.path().join(file)).unwrap();
        let json: serde_json::Value = serde_json::from_str(&read("report.json")).unwrap();
        assert_eq!(json["runs"].as_array().unwrap().len(), report.comparison.paths[0].methods.len());
        assert_eq!(json["runs"][0]["gpu_ms"], serde_json::Value::Null);
        assert_eq!(json["runs"][0]["valid"], true);
        assert_eq!(json["comparison"]["paths"][0]["methods"][1]["ratio"]["verdict"], "slower");
        assert!(read("samples.csv").starts_with("path,method,setting,round,frame,frame_ms,cpu_ms,"));
        assert_eq!(read("fronts.csv").lines().count(), 1 + 6);
        assert_eq!(read("uploads.csv").lines().count(), 1 + report.comparison.uploads.len());
    }
}
