//! Drawing one frame into a PNG.

use std::path::Path;

use image::{ImageEncoder as _, codecs::png::PngEncoder};
use tessclip::gpu::{Gpu, Offscreen};
use tessclip::measure::invariants::draw;
use tessclip::{Camera, Renderer, Scene, Terrain};

/// Draws one frame; patches are never dropped: where room was short it grows and draws again.
pub fn picture(
    gpu: &Gpu,
    terrain: &Terrain,
    scene: &Scene,
    camera: &Camera,
    size: [u32; 2],
) -> anyhow::Result<Vec<u8>> {
    let target = Offscreen::new(&gpu.device, size)?;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, scene)?;
    draw_whole(gpu, &mut renderer, &target, camera)?;
    Ok(target.read_rgba(&gpu.device, &gpu.queue)?)
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
    Ok(())
}

/// Writes RGBA bytes as PNG.
pub fn write_png(path: &Path, rgba: &[u8], size: [u32; 2]) -> anyhow::Result<()> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes).write_image(rgba, size[0], size[1], image::ExtendedColorType::Rgba8)?;
    super::args::write_whole(path, &bytes)
}
