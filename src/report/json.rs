//! The report's data and its JSON and CSV files.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{Comparison, FrameRow, Run};
use crate::measure::{Environment, invariants::CheckRow};
use crate::plan::Plan;

/// Why a report cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file system refused.
    #[error("{}: cannot be written: {reason}; choose another --report or --out directory", path.display())]
    Write {
        /// File or directory.
        path: PathBuf,
        /// Why.
        reason: std::io::Error,
    },
    /// Building the text failed.
    #[error("{file} of the report cannot be made: {reason}")]
    Make {
        /// File name.
        file: &'static str,
        /// Why.
        reason: String,
    },
}

/// What was drawn.
#[derive(Clone, Debug, Serialize)]
pub struct SceneFacts {
    /// TERRAIN as given.
    pub terrain: String,
    /// Base surface.
    pub base: String,
    /// Picture size.
    pub width_px: u32,
    /// Picture size.
    pub height_px: u32,
    /// Metres between base samples, east and north.
    pub spacing_m: [f64; 2],
    /// Samples of the finest level, east and north.
    pub samples: [u64; 2],
}

/// A whole report.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// "tessclip-report/1".
    pub schema: &'static str,
    /// Machine.
    pub environment: Environment,
    /// Scene.
    pub scene: SceneFacts,
    /// Frame plan.
    pub plan: Plan,
    /// Runs.
    pub runs: Vec<Run>,
    /// `check` in brief, where it was run.
    pub checks: Option<Vec<CheckRow>>,
    /// Pictures beside the report.
    pub pictures: Vec<String>,
    /// Methods compared, where they were.
    pub comparison: Option<Comparison>,
    /// The same as a part of report.html.
    #[serde(skip)]
    pub comparison_section: Option<String>,
    /// Raw samples, written to frames.csv.
    #[serde(skip)]
    pub rows: Vec<FrameRow>,
}

/// Writes report.json, frames.csv and report.html into `dir`, which is made where it is missing.
///
/// # Errors
/// When the directory or a file cannot be written.
pub fn write_report(dir: &Path, report: &Report) -> Result<(), ReportError> {
    let fail = |path: &Path, reason| ReportError::Write { path: path.into(), reason };
    std::fs::create_dir_all(dir).map_err(|e| fail(dir, e))?;
    let json = serde_json::to_string_pretty(report)
        .map_err(|e| ReportError::Make { file: "report.json", reason: e.to_string() })?;
    let path = dir.join("report.json");
    std::fs::write(&path, json).map_err(|e| fail(&path, e))?;
    let mut csv = csv::Writer::from_writer(Vec::new());
    let made = report.rows.iter().try_for_each(|row| csv.serialize(row));
    let bytes = made
        .map_err(|e| e.to_string())
        .and_then(|()| csv.into_inner().map_err(|e| e.to_string()))
        .map_err(|reason| ReportError::Make { file: "frames.csv", reason })?;
    let path = dir.join("frames.csv");
    std::fs::write(&path, bytes).map_err(|e| fail(&path, e))?;
    super::write_html(&dir.join("report.html"), report)
}
