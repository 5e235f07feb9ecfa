//! Drawing one frame into a PNG.

use std::path::Path;
use std::time::Duration;

use anyhow::bail;
use image::{ImageEncoder as _, codecs::png::PngEncoder};
use tessclip::gpu::{Counters, Gpu, Offscreen};
use tessclip::measure::invariants::draw;
use tessclip::{Camera, Renderer, Scene, Terrain};

/// Draws one frame; patches are never dropped: where room was short it grows and draws again.
pub fn picture(
    gpu: &Gpu,
    terrain: &Terrain,
    scene: &Scene,
    camera: &Camera,
    size: [u32; 2],
    wait: bool,
) -> anyhow::Result<Vec<u8>> {
    let target = Offscreen::new(&gpu.device, size)?;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, scene)?;
    draw_complete(gpu, &mut renderer, &target, camera, wait)?;
    Ok(target.read_rgba(&gpu.device, &gpu.queue)?)
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
    if !wait {
        return draw_whole(gpu, renderer, target, camera);
    }
    if !renderer.wait_complete(camera, LONGEST_WAIT)? {
        bail!(
            "the view is not complete after {} s; see -v, or draw what is there with --wait=false",
            LONGEST_WAIT.as_secs()
        );
    }
    draw_whole(gpu, renderer, target, camera)?;
    for _ in 0..MOST_ARRIVING {
        if renderer.is_complete() {
            return Ok(());
        }
        draw_whole(gpu, renderer, target, camera)?;
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
    draw(gpu, renderer, target, camera)?;
    let counters = renderer.read_counters()?;
    if renderer.grow(&counters)? {
        draw(gpu, renderer, target, camera)?;
    }
    warn_of_budget(renderer, &counters);
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
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes).write_image(rgba, size[0], size[1], image::ExtendedColorType::Rgba8)?;
    super::args::write_whole(path, &bytes)
}
