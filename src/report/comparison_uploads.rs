//! What clipmaps send, by window size.

use serde::Serialize;

/// What a clipmap method sends at one window size; heights apart, since every method needs them.
#[derive(Clone, Debug, Serialize)]
pub struct UploadRow {
    /// Samples per side of a window.
    pub n: u32,
    /// Levels.
    pub levels: u32,
    /// Method.
    pub method: &'static str,
    /// Vertices sent before the first frame is drawn.
    pub vertices_start: u64,
    /// Bytes of vertices, indices and control data sent before the first frame is drawn.
    pub bytes_start: u64,
    /// Vertices sent per frame in motion, mean.
    pub vertices_per_frame: f64,
    /// Bytes of vertices, indices and control data sent per frame in motion, mean.
    pub bytes_per_frame: f64,
    /// Bytes of height samples sent per frame in motion, mean; null where they are in the vertices.
    pub height_bytes_per_frame: Option<f64>,
    /// Bytes of the classic full grids: n * n * levels vertices of 16 bytes.
    pub full_grid_bytes: u64,
}

impl UploadRow {
    /// Share of the classic full grids that is sent before the first frame; best 0.
    #[must_use]
    pub fn start_share(&self) -> f64 {
        self.bytes_start as f64 / self.full_grid_bytes as f64
    }

    /// Share of the classic full grids that is sent in a frame in motion; best 0.
    #[must_use]
    pub fn frame_share(&self) -> f64 {
        self.bytes_per_frame / self.full_grid_bytes as f64
    }
}
