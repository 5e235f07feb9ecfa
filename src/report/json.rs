//! The report's data and its JSON and CSV files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::measure::{Environment, FrameStatistics, UploadLedger, invariants::CheckRow};
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

/// p50 and p99 of a series; p99 is null below 1,000 samples.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Quantiles {
    /// Median.
    pub p50: Option<f64>,
    /// 99th percentile.
    pub p99: Option<f64>,
}

impl Quantiles {
    /// Of samples in any order.
    #[must_use]
    pub fn of(samples: &[f64]) -> Self {
        let s = FrameStatistics::of(samples);
        Self { p50: s.p50, p99: s.p99 }
    }
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

/// Geometry over a run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Geometry {
    /// Control points on the GPU.
    pub control_points: u64,
    /// Median patches drawn.
    pub patches_p50: Option<f64>,
    /// Median vertices expanded.
    pub vertices_p50: Option<f64>,
    /// Median triangles drawn.
    pub triangles_p50: Option<f64>,
    /// Most triangles drawn.
    pub triangles_max: Option<f64>,
    /// Patches dropped for want of room, over the whole run; a run with any is invalid.
    pub dropped_patches: u64,
}

/// Memory of a run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Memory {
    /// GPU buffers.
    pub gpu_bytes: u64,
    /// Most resident memory of the process, where the system tells.
    pub peak_rss_bytes: Option<u64>,
}

/// One benchmark run.
#[derive(Clone, Debug, Serialize)]
pub struct Run {
    /// Method.
    pub method: &'static str,
    /// n, levels and options.
    pub params: serde_json::Value,
    /// Frames measured (warm-up excluded).
    pub frames: usize,
    /// Camera path.
    pub path: String,
    /// Mean speed in finest windows a second of path time; null for paths that are not timed.
    pub speed_windows_per_s: Option<f64>,
    /// CPU start of frame to GPU done.
    pub frame_ms: FrameStatistics,
    /// CPU start of frame to submission.
    pub cpu_ms: Quantiles,
    /// Per pass; null where the adapter has no timestamp queries.
    pub gpu_ms: Option<BTreeMap<String, Quantiles>>,
    /// Upload ledger.
    pub upload: UploadLedger,
    /// Geometry.
    pub geometry: Geometry,
    /// Memory.
    pub memory: Memory,
    /// Not measured yet: null.
    pub error: Option<()>,
    /// Nothing is streamed yet: null.
    pub stream: Option<()>,
    /// False when any figure must not be used.
    pub valid: bool,
    /// Why not.
    pub invalid_because: Vec<String>,
}

/// One row of frames.csv.
#[derive(Clone, Debug, Serialize)]
pub struct FrameRow {
    /// Frame number from 0.
    pub frame: usize,
    /// Path time in seconds.
    pub t_s: f64,
    /// CPU start of frame to GPU done.
    pub frame_ms: f64,
    /// CPU start of frame to submission.
    pub cpu_ms: f64,
    /// Control data.
    pub control_bytes: u64,
    /// Height samples.
    pub height_bytes: u64,
    /// Level shifts.
    pub shifts: u64,
    /// Patches drawn.
    pub patches: u32,
    /// Vertices expanded.
    pub vertices: u32,
    /// Triangles drawn.
    pub triangles: u32,
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
