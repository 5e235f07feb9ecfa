//! What the panels show: gathered by the world and the window, drawn by the HUD.

use std::collections::VecDeque;

use tessclip::gpu::Counters;
use tessclip::measure::FrameUpload;
use tessclip::pyramid::StreamCounters;

/// Frames whose times are kept for the graph.
pub const KEPT_FRAMES: usize = 240;

/// The ground under the cursor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnderCursor {
    /// In the terrain's own units: the first two numbers of a pose.
    pub place: [f64; 2],
    /// Height of the surface as drawn, metres.
    pub drawn_m: f64,
    /// Height at full resolution, metres; none over a void.
    pub full_m: Option<f64>,
    /// Slope at full resolution, degrees.
    pub slope_deg: f64,
    /// From the eye, metres.
    pub distance_m: f64,
    /// Level drawn there.
    pub level: u32,
}

/// What would have been sent in this frame by a method, and by seconds; heights left out, which all need.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sent {
    pub frame: u64,
    pub per_s: f64,
}

/// All that the panels show of a frame.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// As the user named it.
    pub terrain: String,
    /// Milliseconds from frame to frame of those drawn one after another, oldest first; at most [`KEPT_FRAMES`].
    pub frame_ms: VecDeque<f32>,
    /// CPU milliseconds of the last frame, until it was submitted.
    pub cpu_ms: f64,
    /// What panels took of a frame, CPU and GPU, milliseconds; the mean of the last ones.
    pub hud_ms: f64,
    /// GPU milliseconds by pass; empty where the device has no timestamps.
    pub passes: Vec<(String, f64)>,
    /// Of the last frame that the GPU has told about.
    pub counters: Option<Counters>,
    /// Patch slots of all levels.
    pub patches_total: u32,
    /// What this frame sent.
    pub upload: FrameUpload,
    /// Mesh and control data: ours, and what the classic footprints would have sent for the same motion.
    pub ours: Sent,
    pub classic: Sent,
    pub gpu_gems: Sent,
    /// Height samples, which all methods need.
    pub heights: Sent,
    /// Levels of the clipmap.
    pub levels: u32,
    /// Lowest and highest height as drawn, metres.
    pub heights_m: Option<[f32; 2]>,
    /// Of a streamed store.
    pub stream: Option<StreamCounters>,
    /// Tiles a second that arrived lately.
    pub tiles_per_s: f64,
    /// The camera.
    pub pose: [f64; 5],
    /// True when the first two numbers of a pose are longitude and latitude.
    pub degrees: bool,
    /// Metres above the ground as drawn; none where there is none.
    pub above_ground_m: Option<f64>,
    /// Metres a second at full speed.
    pub speed_m_s: f64,
    pub cursor: Option<UnderCursor>,
    /// Kind of synchronisation with the screen.
    pub vsync: &'static str,
    pub size_px: [u32; 2],
    /// Seconds recorded so far, while recording.
    pub recording_s: Option<f64>,
    /// Seconds replayed and in all, while replaying.
    pub replay_s: Option<[f64; 2]>,
    /// True while the ground is followed.
    pub following: bool,
    /// One line about what just happened.
    pub message: Option<String>,
    /// What the adapter is called.
    pub adapter: String,
    /// Triangles that the rival in the right half drew last, where it says.
    pub beside_triangles: Option<u64>,
}

impl Facts {
    /// A percentile of the frame times by linear interpolation; none under two frames.
    pub fn frame_percentile(&self, p: f64) -> Option<f64> {
        let mut times: Vec<f64> = self.frame_ms.iter().map(|v| f64::from(*v)).collect();
        times.sort_by(f64::total_cmp);
        tessclip::measure::percentile(&times, p).filter(|_| times.len() > 1)
    }
}
