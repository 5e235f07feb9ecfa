//! Drawing one frame into a PNG.

use std::path::Path;
use std::time::Duration;

use anyhow::bail;
use tessclip::gpu::{Counters, Gpu, Offscreen};
use tessclip::rivals::Method;
use tessclip::{Camera, RenderError, Renderer, Scene, Target, Terrain};

use super::beside::{Beside, halves};
use super::png_pose::write_png_with;

/// What a picture shows of a terrain.
pub struct Shot<'a> {
    /// How it is drawn.
    pub scene: &'a Scene,
    /// From where.
    pub camera: Camera,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Wait for all that is on its way.
    pub wait: bool,
    /// Windows, factors and culling stay with this camera.
    pub frozen: Option<Camera>,
    /// A rival in the right half.
    pub beside: Option<Method>,
    /// Where the frame before was drawn from.
    pub before: Option<Camera>,
}

impl Shot<'_> {
    /// The camera whose samples are waited for.
    fn awaited(&self, camera: Camera) -> Option<Camera> {
        self.wait.then(|| self.frozen.unwrap_or(camera))
    }
}

/// Draws one frame of ours alone.
pub fn picture(
    gpu: &Gpu,
    terrain: &Terrain,
    scene: &Scene,
    camera: &Camera,
    size: [u32; 2],
    wait: bool,
) -> anyhow::Result<Vec<u8>> {
    let shot = Shot { scene, camera: *camera, size, wait, frozen: None, beside: None, before: None };
    shoot(gpu, terrain, &shot)
}

/// Draws a frame; patches are never dropped: where room was short it grows and draws again.
pub fn shoot(gpu: &Gpu, terrain: &Terrain, shot: &Shot<'_>) -> anyhow::Result<Vec<u8>> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let target = Offscreen::new(device, shot.size)?;
    let rival = shot.beside.map(|m| Beside::new(device, queue, Offscreen::FORMAT, terrain, shot.scene, m));
    let mut rival = rival.transpose()?;
    let mut renderer = Renderer::new(device, queue, Offscreen::FORMAT, terrain, shot.scene)?;
    renderer.freeze(shot.frozen)?;
    let part = Part { target: &target, area: rival.is_some().then(|| halves(shot.size)[0]) };
    if let (Some(rival), Some(before)) = (&mut rival, shot.before) {
        // Ours clears what this leaves in its half.
        rival.draw(gpu, &target, &before)?;
    }
    loop {
        if let Some(before) = shot.before {
            complete(gpu, &mut renderer, part, &before, shot.awaited(before))?;
        }
        let grew = complete(gpu, &mut renderer, part, &shot.camera, shot.awaited(shot.camera))?;
        // What has grown sends everything again, as if there had been no frame before.
        if shot.before.is_none() || !grew {
            break;
        }
    }
    if let Some(rival) = &mut rival {
        let drawn = rival.draw(gpu, &target, &shot.camera)?;
        let (name, triangles, calls) = (rival.method.name(), drawn.triangles, drawn.draw_calls);
        log::info!("beside: {name} drew {triangles} triangles in {calls} draw calls");
    }
    Ok(target.read_rgba(device, queue)?)
}

/// A target, or the part of it that is drawn into.
#[derive(Clone, Copy)]
struct Part<'a> {
    target: &'a Offscreen,
    /// Left, top, width and height in pixels; none for all of it.
    area: Option<[u32; 4]>,
}

impl Part<'_> {
    fn size(&self) -> [u32; 2] {
        self.area.map_or(self.target.size, |[_, _, width, height]| [width, height])
    }
}

/// Longest wait for the samples of one view.
const LONGEST_WAIT: Duration = Duration::from_secs(300);
/// Most frames until a view is drawn whose samples are there: they are sent bit by bit, and levels grow in.
const MOST_ARRIVING: u32 = 1_000;

/// Draws until everything the camera needs is there and drawn; of a terrain in memory, or without `wait`, once.
pub fn draw_complete(
    gpu: &Gpu,
    renderer: &mut Renderer,
    target: &Offscreen,
    camera: &Camera,
    wait: bool,
) -> anyhow::Result<()> {
    complete(gpu, renderer, Part { target, area: None }, camera, wait.then_some(*camera))?;
    Ok(())
}

/// Draws until everything the awaited camera needs is there and drawn. True when the buffers grew.
fn complete(
    gpu: &Gpu,
    renderer: &mut Renderer,
    part: Part<'_>,
    camera: &Camera,
    awaited: Option<Camera>,
) -> anyhow::Result<bool> {
    let Some(awaited) = awaited else { return whole(gpu, renderer, part, camera) };
    if !renderer.wait_complete(&awaited, LONGEST_WAIT)? {
        bail!(
            "the view is not complete after {} s; see -v, or draw what is there with --wait=false",
            LONGEST_WAIT.as_secs()
        );
    }
    let mut grew = whole(gpu, renderer, part, camera)?;
    for _ in 0..MOST_ARRIVING {
        if renderer.is_complete() {
            return Ok(grew);
        }
        grew |= whole(gpu, renderer, part, camera)?;
    }
    bail!("the view does not come to rest after {MOST_ARRIVING} frames; draw what is there with --wait=false")
}

/// Draws and, where patches were dropped, grows and draws again.
pub fn draw_whole(
    gpu: &Gpu,
    renderer: &mut Renderer,
    target: &Offscreen,
    camera: &Camera,
) -> anyhow::Result<()> {
    whole(gpu, renderer, Part { target, area: None }, camera)?;
    Ok(())
}

/// The same in a part of a target. True when the buffers grew.
fn whole(gpu: &Gpu, renderer: &mut Renderer, part: Part<'_>, camera: &Camera) -> anyhow::Result<bool> {
    draw(gpu, renderer, part, camera)?;
    let counters = renderer.read_counters()?;
    let grew = renderer.grow(&counters)?;
    if grew {
        draw(gpu, renderer, part, camera)?;
    }
    warn_of_budget(renderer, &counters);
    Ok(grew)
}

/// Draws one frame.
fn draw(gpu: &Gpu, renderer: &mut Renderer, part: Part<'_>, camera: &Camera) -> Result<(), RenderError> {
    renderer.prepare(camera, part.size())?;
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let (color, depth) = (&part.target.color, &part.target.depth);
    renderer.record(&mut encoder, Target { color, depth, clear: true, area: part.area });
    gpu.queue.submit([encoder.finish()]);
    Ok(())
}

/// A budget that cannot be met is said, with what the mesh has.
pub fn warn_of_budget(renderer: &Renderer, counters: &Counters) {
    let Some(budget) = renderer.budget() else { return };
    let triangles = counters.indices_needed / 3;
    if triangles > budget {
        log::warn!(
            "{triangles} triangles: no coarser mesh keeps to the budget of {budget} here; voids and patches at the \
             borders of levels set a least number"
        );
    }
}

/// Writes RGBA bytes as PNG.
pub fn write_png(path: &Path, rgba: &[u8], size: [u32; 2]) -> anyhow::Result<()> {
    write_png_with(path, rgba, size, &[])
}
