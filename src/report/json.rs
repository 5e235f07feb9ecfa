//! The report's data and its JSON and CSV files.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::files::{table, write};
use super::{Comparison, FrameRow, Run};
use crate::measure::{Environment, invariants::CheckRow};
use crate::plan::Plan;
use crate::scene::Terrain;

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

impl SceneFacts {
    /// Of a terrain that is drawn `size_px` large.
    #[must_use]
    pub fn of(name: &str, terrain: &Terrain, size_px: [u32; 2]) -> Self {
        let last = terrain.source.lattice().last;
        Self {
            terrain: name.into(),
            base: terrain.base().to_string(),
            width_px: size_px[0],
            height_px: size_px[1],
            spacing_m: terrain.spacing_m,
            samples: last.map(|v| u64::from(v.unsigned_abs()) + 1),
        }
    }
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
    std::fs::create_dir_all(dir).map_err(|reason| ReportError::Write { path: dir.into(), reason })?;
    let json = serde_json::to_vec_pretty(report)
        .map_err(|e| ReportError::Make { file: "report.json", reason: e.to_string() })?;
    write(dir, "report.json", &json)?;
    write(dir, "frames.csv", &table("frames.csv", &report.rows)?)?;
    super::write_html(&dir.join("report.html"), report)
}
