//! The methods we compare against, one file each, all behind one trait: they draw the same terrain for the
//! same camera into the same target with the same colours, and say what they send and hold.
//!
//! They know planes without voids, with all samples in memory where the method needs them there;
//! [`Lab::make`] says in one line what one cannot do. [`footprints`] counts what reaches the GPU without
//! drawing anything.

mod brute_force;
mod chunked;
mod classic;
mod footprint;
mod footprints;
mod geomipmap;
mod ground;
mod method;
mod roam;
mod slots;
mod slotted;
mod stage;
mod tessellated;

pub use self::footprints::{Footprint, footprints};
pub use self::ground::{Ground, Unfit};
pub use self::method::{Detail, Lab, Method};

use crate::camera::Camera;
use crate::gpu::GpuError;
use crate::measure::FrameUpload;
use crate::renderer::{RenderError, Target};

/// A method at work: one terrain, one scene, one detail.
pub trait Rival {
    /// The CPU's part of a frame: refinement and uploads. Call once before `record`.
    ///
    /// # Errors
    /// When the camera cannot be drawn with or memory runs out.
    fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError>;

    /// Records the prepared frame.
    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>);

    /// What the last submitted frame drew; may wait for the GPU.
    ///
    /// # Errors
    /// When the device fails.
    fn count(&self) -> Result<DrawCount, GpuError>;

    /// The triangles of the last submitted frame, from the buffers they were drawn from; waits for the GPU.
    ///
    /// # Errors
    /// When the device fails or nothing was drawn.
    fn read_mesh(&self) -> Result<DrawnMesh, GpuError>;

    /// GPU buffers held, bytes.
    fn gpu_bytes(&self) -> u64;

    /// Tables and trees that the CPU keeps for the method, bytes; heights of samples and their normals, which
    /// all methods share, are left out, as are the book-keeping of windows and the driver's own memory.
    fn cpu_bytes(&self) -> u64;
}

/// What a frame drew.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawCount {
    /// Triangles, those without area among them.
    pub triangles: u64,
    /// Draw calls.
    pub draw_calls: u64,
}

/// Triangles as drawn.
#[derive(Clone, Debug, Default)]
pub struct DrawnMesh {
    /// World position of the anchor in metres; add it to positions in f64.
    pub anchor_m: [f64; 3],
    /// Vertices in metres from the anchor; the same place may occur more than once.
    pub positions: Vec<[f32; 3]>,
    /// Triangles, counter-clockwise from above; some methods' have no area.
    pub triangles: Vec<[u32; 3]>,
}

/// How a method keeps its levels of detail together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrackPolicy {
    /// Neighbours share every edge.
    Conforming,
    /// Heights agree along edges, and triangles without area lie over vertices that only one side has.
    ZeroAreaTriangles,
}
