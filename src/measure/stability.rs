//! Numerical stability, measured: what is drawn against an independent evaluation in f64.
//!
//! Every judge takes what was read back and adds its figures to a row, so that tests can hand it
//! something broken and see it fail (tests/stability.rs).

mod depth;
mod extremes;
mod motion;
mod positions;
mod worlds;

pub use depth::judge_order;
pub use extremes::faults_of;
pub use motion::{Deviations, deviations, judge_displacement, judge_jitter};
pub use positions::{PositionRows, judge_vertices};

use super::invariants::{CheckRow, Effort};
use super::oracle::Lens;
use crate::camera::Camera;
use crate::clipmap::ChartWindows;
use crate::gpu::{Gpu, GpuError, GpuMesh, Offscreen};
use crate::heights::{HeightError, HeightGrid};
use crate::renderer::{RenderError, Renderer, Target};
use crate::scene::{BaseFitError, Scene, Terrain};

/// Why the checks could not be run.
#[derive(Debug, thiserror::Error)]
pub enum StabilityError {
    /// A terrain to try could not be made.
    #[error(transparent)]
    Heights(#[from] HeightError),
    /// It does not fit its base surface.
    #[error(transparent)]
    Fit(#[from] BaseFitError),
    /// It could not be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The GPU failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// Picture that positions on screen are judged in.
pub const SIZE_PX: [u32; 2] = [1280, 720];

/// Metres a drawn vertex may lie off within a kilometre of the camera.
pub const MOST_M: f64 = 1e-3;

/// Pixels it may lie off anywhere on screen, from frame to frame, and after a move of the world.
pub const MOST_PX: f64 = 0.01;

/// Degrees a normal may be off, at the 99th percentile.
pub const MOST_DEG: f64 = 0.1;

/// All rows: synthetic worlds and extremes, and positions and normals on `grid` itself.
///
/// # Errors
/// When the GPU fails or a terrain cannot be made.
pub fn check_stability(
    gpu: &Gpu,
    grid: &HeightGrid,
    effort: Effort,
) -> Result<Vec<CheckRow>, StabilityError> {
    let mut rows = positions::check_positions(gpu, grid, effort)?;
    rows.extend(motion::check_motion(gpu, effort)?);
    rows.extend(depth::check_depth(gpu, effort)?);
    rows.extend(extremes::check_extremes(gpu, effort)?);
    Ok(rows)
}

/// One frame's mesh and what it was made for.
#[derive(Clone, Debug)]
pub struct Shot {
    /// What the GPU made.
    pub mesh: GpuMesh,
    /// Where the windows stood.
    pub windows: ChartWindows,
    /// The camera's picture.
    pub lens: Lens,
}

/// Makes the mesh a camera sees and reads it back; nothing is drawn.
///
/// # Errors
/// When the camera cannot be drawn with or the GPU fails.
pub fn shoot(gpu: &Gpu, renderer: &mut Renderer, camera: &Camera) -> Result<Shot, StabilityError> {
    renderer.prepare(camera, SIZE_PX)?;
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    renderer.record_mesh(&mut encoder);
    gpu.queue.submit([encoder.finish()]);
    let mesh = renderer.read_mesh()?;
    let no_frame = || GpuError::Readback { reason: "no frame was prepared".into() };
    let windows = renderer.windows().ok_or_else(no_frame)?.clone();
    let lens = Lens::new(renderer, camera, mesh.anchor_m, SIZE_PX);
    Ok(Shot { mesh, windows, lens })
}

fn renderer_for(gpu: &Gpu, terrain: &Terrain, scene: &Scene) -> Result<Renderer, StabilityError> {
    Ok(Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, scene)?)
}

/// Draws the prepared camera into a target, over what is there or not.
fn draw_into(
    gpu: &Gpu,
    renderer: &mut Renderer,
    target: &Offscreen,
    camera: &Camera,
    clear: bool,
) -> Result<(), StabilityError> {
    renderer.prepare(camera, target.size)?;
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    renderer.record(&mut encoder, Target { color: &target.color, depth: &target.depth, clear, area: None });
    gpu.queue.submit([encoder.finish()]);
    Ok(())
}

/// Pixels in which two pictures of one size differ.
#[must_use]
pub fn differing_pixels(a: &[u8], b: &[u8]) -> usize {
    a.len().abs_diff(b.len()) / 4 + a.chunks(4).zip(b.chunks(4)).filter(|(p, q)| p != q).count()
}
