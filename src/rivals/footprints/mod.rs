//! Footprints: the vertex data of a method as the CPU sends it, built for real and counted.

mod classic;
mod gpu_gems;
mod tessellated;

use serde::Serialize;

use crate::clipmap::ClipmapShape;
use crate::measure::FrameUpload;

/// One row of `tessclip footprints`.
#[derive(Clone, Debug, Serialize, PartialEq, Eq)]
pub struct Footprint {
    /// Samples per side of a window.
    pub n: u32,
    /// Levels.
    pub levels: u32,
    /// "tessellated" (ours), "classic" or "gpu-gems-2".
    pub method: &'static str,
    /// Control points per frame set-up as Song et al. count them (43 a level); null for the others.
    pub control_points: Option<u64>,
    /// Control points really in our buffers (44 a level, n0 to n43); null for the others.
    pub control_points_built: Option<u64>,
    /// Vertices that reach the GPU from the CPU.
    pub vertices: u64,
    /// Bytes of vertex, index and control buffers sent at start (heights excluded: all methods need them).
    pub bytes_start: u64,
    /// Bytes of vertex, index, control and per-block data sent in a frame in which the finest level
    /// shifts by one step (2 samples) on both axes (heights excluded).
    pub bytes_per_frame: u64,
    /// Those of them that a frame without a shift sends as well.
    #[serde(skip)]
    pub(crate) bytes_every_frame: u64,
    /// Bytes of vertices that every sample that comes into a window brings.
    #[serde(skip)]
    pub(crate) bytes_a_sample: u64,
}

impl Footprint {
    /// Bytes of mesh and control data that the method sends for the shifts of a frame of ours: what it sends in
    /// every frame, and the vertices of the samples that come in. Heights are left out, as everywhere here.
    #[must_use]
    pub fn bytes_for(&self, upload: &FrameUpload) -> u64 {
        if self.method == "tessellated" {
            return upload.control_bytes + upload.vertex_bytes + upload.index_bytes;
        }
        self.bytes_every_frame + self.bytes_a_sample * upload.height_bound_samples
    }
}

/// Counts all methods for one shape, by the length of buffers really built.
#[must_use]
pub fn footprints(shape: ClipmapShape) -> [Footprint; 3] {
    [tessellated::footprint(shape), classic::footprint(shape), gpu_gems::footprint(shape)]
}
