//! What one benchmark run came to. Definitions and units stand beside the fields; `None` is null in
//! report.json and empty in frames.csv, never 0.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::measure::error::ErrorReport;
use crate::measure::{FrameStatistics, OpenLoopReport, UploadLedger};
use crate::pyramid::StreamCounters;

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

/// Geometry over a run, of the frames whose counters were read: all in closed loop, about every 16th in
/// open loop.
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
    /// Resident memory of the process before the first measured frame, where the system tells.
    pub rss_bytes_start: Option<u64>,
    /// Resident memory of the process after the last measured frame, where the system tells.
    pub rss_bytes_end: Option<u64>,
}

/// Waits for data, milliseconds.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Waits {
    /// Median.
    pub p50: Option<f64>,
    /// 99th percentile; null below 1,000 waits.
    pub p99: Option<f64>,
    /// Longest.
    pub max: Option<f64>,
    /// How many ended.
    pub count: u64,
}

impl Waits {
    /// Of waits in any order.
    #[must_use]
    pub fn of(waits_ms: &[f64]) -> Self {
        let s = FrameStatistics::of(waits_ms);
        Self { p50: s.p50, p99: s.p99, max: s.max, count: waits_ms.len() as u64 }
    }
}

/// What a run streamed. Sums are over its measured frames; the cache was cold before the first of them,
/// unless `params.wait` is true.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct StreamReport {
    /// Tiles read and decoded, whatever became of them.
    pub tiles_read: u64,
    /// Encoded bytes read.
    pub bytes_read: u64,
    /// Frames that left out a level wanted for their camera, because its samples were still on their way;
    /// best 0, worst all.
    pub late_frames: u64,
    /// From the frame that first wanted data which was not there until the frame that drew it,
    /// milliseconds.
    pub need_to_drawn_ms: Waits,
    /// Tiles that were in the cache when a window first asked for them.
    pub cache_hits: u64,
    /// Tiles that were not.
    pub cache_misses: u64,
    /// Tiles that made room for others.
    pub evicted: u64,
    /// Requests dropped before a loader took them, because no window wanted them any more.
    pub cancelled: u64,
    /// Loads that ended after their slot had been given away, and were thrown away.
    pub stale_loads: u64,
    /// Reads that failed; best 0.
    pub failed_reads: u64,
    /// Tiles that cannot be read and show their parent level instead, since the terrain was opened; best 0.
    pub damaged_tiles: u64,
    /// Most bytes of decoded tiles held or being decoded at any moment since the terrain was opened.
    pub cache_bytes_max: u64,
    /// Bound on them, bytes.
    pub cache_bytes_limit: u64,
}

impl StreamReport {
    /// Of the counters before and after the measured frames.
    #[must_use]
    pub fn between(
        before: &StreamCounters,
        after: &StreamCounters,
        late_frames: u64,
        need_to_drawn_ms: &[f64],
    ) -> Self {
        let grown = |of: fn(&StreamCounters) -> u64| of(after).saturating_sub(of(before));
        Self {
            tiles_read: grown(|c| c.tiles_read),
            bytes_read: grown(|c| c.bytes_read),
            late_frames,
            need_to_drawn_ms: Waits::of(need_to_drawn_ms),
            cache_hits: grown(|c| c.cache_hits),
            cache_misses: grown(|c| c.cache_misses),
            evicted: grown(|c| c.evicted),
            cancelled: grown(|c| c.cancelled),
            stale_loads: grown(|c| c.stale_loads),
            failed_reads: grown(|c| c.failed_reads),
            damaged_tiles: after.damaged_tiles,
            cache_bytes_max: after.resident_bytes_max,
            cache_bytes_limit: after.limit_bytes,
        }
    }
}

/// From the begin of the first frame after a jump to the end of the first one that lacked no level,
/// milliseconds by the clock; what is read back between frames is part of it.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct TeleportWaits {
    /// Median.
    pub p50: Option<f64>,
    /// Longest.
    pub max: Option<f64>,
    /// Jumps after which a frame lacked nothing.
    pub count: u64,
    /// Jumps before whose data was complete the next one came, or the end; best 0. They are in none of the
    /// figures above.
    pub unfinished: u64,
}

/// Frames read back and looked at for cracks.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct CrackReport {
    /// Frames looked at.
    pub frames: u64,
    /// Open, doubled or turned over edges and triangles and numbers that are not finite, over all of them;
    /// best 0. Null on curved surfaces and over data with voids.
    pub faults: Option<u64>,
    /// Pixels of background without a way to the picture's border through others, over all frames: sky
    /// between two ridges, or a crack.
    pub enclosed_pixels: u64,
    /// Those of them through which one looks under the surface: cracks; best 0. Null on curved surfaces and
    /// over data with voids.
    pub crack_pixels: Option<u64>,
}

impl CrackReport {
    /// Whether anything was found.
    #[must_use]
    pub fn found(&self) -> bool {
        self.faults.unwrap_or(0) + self.crack_pixels.unwrap_or(0) > 0
    }
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
    /// Times the GPU device was lost and replaced by a new one in mid-flight.
    pub devices_lost: u64,
    /// Camera path.
    pub path: String,
    /// Mean speed over the ground in finest windows a second of path time; jumps left out.
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
    /// Error against the full resolution; null here: `compare` measures it.
    pub error: Option<ErrorReport>,
    /// Cracks; null where none were looked for.
    pub cracks: Option<CrackReport>,
    /// What was streamed; null where all data lies in memory.
    pub stream: Option<StreamReport>,
    /// How the schedule was kept; null in closed loop.
    pub open_loop: Option<OpenLoopReport>,
    /// How long a new place takes to be complete; null on paths that do not jump.
    pub teleport_to_complete_ms: Option<TeleportWaits>,
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
    /// Least that could be sent for this frame's shifts.
    pub height_bytes_bound: u64,
    /// Level shifts.
    pub shifts: u64,
    /// Patches drawn; empty where counters were not read (open loop).
    pub patches: Option<u32>,
    /// Vertices expanded; empty where counters were not read.
    pub vertices: Option<u32>,
    /// Triangles drawn; empty where counters were not read.
    pub triangles: Option<u32>,
    /// Levels wanted for this camera but not drawn, because their samples were still on their way.
    pub levels_missing: u32,
    /// Decoded tiles held or being decoded after the frame; empty where nothing is streamed.
    pub cache_bytes: Option<u64>,
    /// Resident memory of the process after the frame; empty where the system does not tell, or where there
    /// was no time to ask (open loop).
    pub rss_bytes: Option<u64>,
    /// When the frame was due, seconds from the start; empty in closed loop.
    pub due_s: Option<f64>,
    /// From due to GPU done; empty in closed loop.
    pub response_ms: Option<f64>,
    /// Done after the deadline (due + 1/hz), 0 in time; empty in closed loop.
    pub late_ms: Option<f64>,
}
