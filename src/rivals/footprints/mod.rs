//! Footprints: the vertex data of a method as the CPU sends it, built for real and counted.

mod classic;
mod gpu_gems;
mod tessellated;

use serde::Serialize;

use crate::clipmap::ClipmapShape;

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
}

/// Counts all methods for one shape, by the length of buffers really built.
#[must_use]
pub fn footprints(shape: ClipmapShape) -> [Footprint; 3] {
    [tessellated::footprint(shape), classic::footprint(shape), gpu_gems::footprint(shape)]
}
