//! Rivals beside each other: the data of `tessclip compare`. `None` is
//! null in report.json, empty in the CSV files and a dash on the page, never 0.

use serde::Serialize;

use super::comparison_uploads::UploadRow;
use super::{Quantiles, SceneFacts};
use crate::measure::error::ErrorReport;
use crate::measure::fronts::{Point, dominated, union};
use crate::measure::pairs::{Noise, Ratio};
use crate::measure::{Environment, FrameStatistics, UploadLedger};

/// What `compare` found.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Whether it was cut short to see that it works; its figures are not to be quoted.
    pub quick: bool,
    /// Method the others are compared with; measured twice a round.
    pub baseline: &'static str,
    /// Frames of a flight on the path; a method that needs too long for a frame flies only every k-th.
    pub frames_per_flight: u32,
    /// Rounds: flights of each method on each path.
    pub rounds: u32,
    /// By camera path.
    pub paths: Vec<PathComparison>,
    /// Uploads by window size.
    pub uploads: Vec<UploadRow>,
    /// What could not be measured.
    pub cannot: Vec<Cannot>,
    /// All of it in plain words, a paragraph each.
    pub words: Vec<String>,
}

/// All methods on one camera path.
#[derive(Clone, Debug, Serialize)]
pub struct PathComparison {
    /// Camera path.
    pub path: String,
    /// The baseline against itself.
    pub noise: Noise,
    /// The methods at their default detail.
    pub methods: Vec<MethodRow>,
    /// The methods at all their settings.
    pub fronts: Vec<Front>,
    /// Settings that no other one of any method beats in p99 error and median time, by time.
    pub outer_front: Vec<OuterPoint>,
}

/// A method at its default detail on one path.
#[derive(Clone, Debug, Serialize)]
pub struct MethodRow {
    /// Method.
    pub method: &'static str,
    /// Its detail parameters.
    pub detail: serde_json::Value,
    /// Frames measured in all rounds together.
    pub frames: usize,
    /// It flew every k-th frame of the path, because one takes too long; 1 is all of them.
    pub every: u32,
    /// CPU start of frame to GPU done, milliseconds, frames of all rounds pooled.
    pub frame_ms: FrameStatistics,
    /// CPU start of frame to submission, milliseconds, frames of all rounds pooled.
    pub cpu_ms: Quantiles,
    /// Median frame time against the baseline's; null for the baseline, and where no round has both.
    pub ratio: Option<Ratio>,
    /// p99 / p50 of a round's frames over that of the baseline's round, judged against A against A of the same;
    /// `None` for the baseline itself, and below 100 frames a flight. "faster" reads steadier.
    pub r99_ratio: Option<Ratio>,
    /// Median frame time of each round, milliseconds.
    pub rounds_ms: Vec<f64>,
    /// Upload ledger of one flight, bytes; all flights of a method send the same.
    pub upload: UploadLedger,
    /// Median triangles drawn.
    pub triangles_p50: Option<f64>,
    /// Median draw calls.
    pub draw_calls_p50: Option<f64>,
    /// GPU buffers, bytes.
    pub gpu_bytes: u64,
    /// Tables and trees that the CPU keeps besides the samples, bytes.
    pub cpu_bytes: u64,
    /// Errors against the full-resolution surface; null where not measured.
    pub error: Option<ErrorReport>,
}

/// What a flight sends per frame, means in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct UploadPerFrame {
    /// Control data and records of a curved base surface, first frame excluded.
    pub control_bytes: f64,
    /// Frame uniforms, first frame included.
    pub uniform_bytes: f64,
    /// Height samples, first frame excluded.
    pub height_bytes: f64,
    /// Vertices and indices, first frame excluded.
    pub mesh_bytes: f64,
}

/// Of so many pixels at most one may show what is not in the mesh read back; more, and that is another mesh.
const MOST_MISMATCHES_IN: u64 = 1_000;

impl MethodRow {
    /// Means over the frames of one flight.
    #[must_use]
    pub fn upload_per_frame(&self) -> UploadPerFrame {
        let frames = self.frames as f64 / self.rounds_ms.len().max(1) as f64;
        let over = |bytes: u64, frames: f64| bytes as f64 / frames.max(1.0);
        UploadPerFrame {
            control_bytes: over(
                self.upload.control_bytes + self.upload.surface_bytes + self.upload.factor_bytes,
                frames,
            ),
            // The ledger counts the first frame's, too, which is no frame of the flight.
            uniform_bytes: over(self.upload.uniform_bytes, frames + 1.0),
            height_bytes: over(self.upload.height_bytes, frames),
            mesh_bytes: over(self.upload.vertex_bytes + self.upload.index_bytes, frames),
        }
    }

    /// Why its figures must not be used; nothing where they may.
    #[must_use]
    pub fn invalid_because(&self) -> Vec<&'static str> {
        let error = self.error.as_ref();
        let reasons = [
            (self.frame_ms.p50.is_none(), "no frame was measured"),
            (error.is_some_and(|e| e.pixels == 0), "no terrain was in any view whose error was measured"),
            (
                error.is_some_and(|e| e.read_back_mismatch_pixels * MOST_MISMATCHES_IN > e.pixels),
                "the mesh read back is not what was drawn",
            ),
        ];
        reasons.into_iter().filter(|(holds, _)| *holds).map(|(_, why)| why).collect()
    }

    /// The row as an entry of `runs` in report.json.
    fn run(&self, path: &str) -> serde_json::Value {
        let invalid_because = self.invalid_because();
        serde_json::json!({
            "method": self.method,
            "params": self.detail,
            "frames": self.frames,
            "every": self.every,
            "path": path,
            "speed_windows_per_s": null,
            "frame_ms": self.frame_ms,
            "cpu_ms": self.cpu_ms,
            "gpu_ms": null,
            "upload": self.upload,
            "geometry": {
                "control_points": null,
                "patches_p50": null,
                "vertices_p50": null,
                "triangles_p50": self.triangles_p50,
                "triangles_max": null,
                "dropped_patches": null,
                "draw_calls_p50": self.draw_calls_p50,
            },
            "memory": { "gpu_bytes": self.gpu_bytes, "cpu_bytes": self.cpu_bytes, "peak_rss_bytes": null },
            "error": self.error,
            "stream": null,
            "valid": invalid_because.is_empty(),
            "invalid_because": invalid_because,
        })
    }
}

/// A method at all its settings on one path.
#[derive(Clone, Debug, Serialize)]
pub struct Front {
    /// Method.
    pub method: &'static str,
    /// Its settings.
    pub points: Vec<FrontPoint>,
}

/// One setting of a method.
#[derive(Clone, Debug, Serialize)]
pub struct FrontPoint {
    /// Its detail parameters.
    pub detail: serde_json::Value,
    /// The same in words.
    pub detail_words: String,
    /// 99th percentile of the screen-space error, pixels; null where not measured.
    pub p99_px: Option<f64>,
    /// Median frame time, milliseconds.
    pub median_ms: f64,
    /// 95th percentile of the frame times, milliseconds.
    pub p95_ms: Option<f64>,
    /// 99th percentile of the frame times, milliseconds; null below 1,000 frames.
    pub p99_ms: Option<f64>,
    /// Median triangles drawn.
    pub triangles: Option<f64>,
    /// GPU buffers, bytes.
    pub gpu_bytes: u64,
    /// Another setting of the same method is no worse in p99 error and median time and better in one.
    pub dominated: bool,
    /// No setting of any method is better in one of them and no worse in the other.
    pub on_outer_front: bool,
}

impl FrontPoint {
    /// Its p99 error against a cost; `None` where one of them is missing or not finite.
    #[must_use]
    pub fn at(&self, cost: Option<f64>) -> Option<Point> {
        let point = Point { cost: cost?, error: self.p99_px? };
        (point.cost.is_finite() && point.error.is_finite()).then_some(point)
    }
}

/// One setting of the outer front.
#[derive(Clone, Debug, Serialize)]
pub struct OuterPoint {
    /// Method.
    pub method: &'static str,
    /// Its setting in words.
    pub detail_words: String,
    /// 99th percentile of the screen-space error, pixels.
    pub p99_px: f64,
    /// Median frame time, milliseconds.
    pub median_ms: f64,
}

/// Marks the points of all methods on one path as dominated and as on the outer front, which is returned by
/// time. Points without an error are neither.
pub fn mark_fronts(fronts: &mut [Front]) -> Vec<OuterPoint> {
    let mut known = Vec::new();
    for front in fronts.iter_mut() {
        let mut at = Vec::new();
        for (ix, point) in front.points.iter_mut().enumerate() {
            (point.dominated, point.on_outer_front) = (false, false);
            at.extend(point.at(Some(point.median_ms)).map(|p| (ix, p)));
        }
        let points: Vec<Point> = at.iter().map(|(_, p)| *p).collect();
        for ((ix, _), dominated) in at.iter().zip(dominated(&points)) {
            front.points[*ix].dominated = dominated;
        }
        known.push(at);
    }
    let points: Vec<Vec<Point>> = known.iter().map(|at| at.iter().map(|(_, p)| *p).collect()).collect();
    let mut outer = Vec::new();
    for (method, at) in union(&points) {
        let (ix, Point { cost, error }) = known[method][at];
        let front = &mut fronts[method];
        let point = &mut front.points[ix];
        point.on_outer_front = true;
        let detail_words = point.detail_words.clone();
        outer.push(OuterPoint { method: front.method, detail_words, p99_px: error, median_ms: cost });
    }
    outer
}

/// What was not measured.
#[derive(Clone, Debug, Serialize)]
pub struct Cannot {
    /// Method.
    pub method: &'static str,
    /// Why, in one line.
    pub why: String,
}

/// One row of samples.csv: a measured frame.
#[derive(Clone, Debug, Serialize)]
pub struct SampleRow {
    /// Camera path.
    pub path: String,
    /// Method.
    pub method: &'static str,
    /// Setting: 0 is the default detail, k the k-th of the sweep.
    pub setting: usize,
    /// Round from 0.
    pub round: usize,
    /// Frame of the path from 0.
    pub frame: usize,
    /// CPU start of frame to GPU done, milliseconds.
    pub frame_ms: f64,
    /// CPU start of frame to submission, milliseconds.
    pub cpu_ms: f64,
    /// Control data sent, bytes.
    pub control_bytes: u64,
    /// Height samples sent, bytes.
    pub height_bytes: u64,
    /// Vertices sent, bytes.
    pub vertex_bytes: u64,
    /// Indices sent, bytes.
    pub index_bytes: u64,
    /// Triangles drawn; empty where they were not counted.
    pub triangles: Option<u64>,
    /// Draw calls; empty where they were not counted.
    pub draw_calls: Option<u64>,
}

/// A whole report of `compare`.
#[derive(Clone, Debug, Serialize)]
pub struct ComparisonReport {
    /// "tessclip-report/1".
    pub schema: &'static str,
    /// Machine.
    pub environment: Environment,
    /// Scene.
    pub scene: SceneFacts,
    /// The default details as runs, from [`runs`].
    pub runs: Vec<serde_json::Value>,
    /// What was found.
    pub comparison: Comparison,
    /// Raw samples, written to samples.csv.
    #[serde(skip)]
    pub samples: Vec<SampleRow>,
}

/// An entry of `runs` for every method on every path, as the reports of `fly` have them.
#[must_use]
pub fn runs(comparison: &Comparison) -> Vec<serde_json::Value> {
    comparison.paths.iter().flat_map(|p| p.methods.iter().map(move |row| row.run(&p.path))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::comparison_plots::made_up;
    use super::*;

    #[test]
    fn figures_of_another_mesh_or_of_no_terrain_are_not_valid() {
        let mut row = made_up::row("roam", 5.0, Some(0.5), None);
        assert!(row.invalid_because().is_empty());
        let error = row.error.as_mut().unwrap();
        error.read_back_mismatch_pixels = 1;
        assert!(row.invalid_because().is_empty());
        row.error.as_mut().unwrap().read_back_mismatch_pixels = 2;
        assert_eq!(row.invalid_because(), ["the mesh read back is not what was drawn"]);
        row.error = Some(Default::default());
        assert_eq!(row.run("straight")["valid"], false);
    }

    #[test]
    fn fronts_are_marked_within_and_over_the_methods() {
        let mut fronts = made_up::report().comparison.paths[0].fronts.clone();
        let outer = mark_fronts(&mut fronts);
        let marks = |front: &Front| -> Vec<(bool, bool)> {
            front.points.iter().map(|p| (p.dominated, p.on_outer_front)).collect()
        };
        assert_eq!(marks(&fronts[0]), [(false, true), (false, true), (true, false)]);
        // The last one has no error.
        assert_eq!(marks(&fronts[1]), [(false, true), (false, false), (false, false)]);
        let costs: Vec<f64> = outer.iter().map(|p| p.median_ms).collect();
        assert_eq!(costs, [2.0, 3.0, 5.0]);
    }
}
