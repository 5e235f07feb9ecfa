//! A path as an animated picture.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context as _, bail};
use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, RgbaImage};
use tessclip::gpu::{Gpu, Offscreen};
use tessclip::{Renderer, Scene, Terrain};

use super::args::write_whole;
use super::paths::{Course, Tempo};
use super::picture::draw_complete;

/// Least and greatest number of frames.
pub const FRAMES: [i64; 2] = [2, 1000];
/// Time that a frame is shown.
const SHOWN: Duration = Duration::from_millis(80);
/// How thoroughly colours are chosen, 1 (best) to 30.
const SPEED: i32 = 10;

/// What is filmed.
pub struct Film<'a> {
    pub terrain: &'a Terrain,
    pub scene: &'a Scene,
    /// A name or a file, spread over the frames.
    pub path: &'a str,
    pub frames: u32,
    pub fov_deg: f64,
    pub size: [u32; 2],
    /// Every frame waits for all that is on its way.
    pub wait: bool,
}

impl Film<'_> {
    /// Draws all frames and writes them as a GIF.
    pub fn shoot(&self, gpu: &Gpu, output: &Path) -> anyhow::Result<()> {
        let tempo = Tempo { frames: self.frames, hz: None, speed_m_s: None };
        let course = Course::open(self.path, self.terrain, tempo)?;
        let target = Offscreen::new(&gpu.device, self.size)?;
        let mut renderer =
            Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, self.terrain, self.scene)?;
        let mut bytes = Vec::new();
        let mut gif = GifEncoder::new_with_speed(&mut bytes, SPEED);
        gif.set_repeat(Repeat::Infinite)?;
        for frame in 0..self.frames {
            let (_, camera) = course.at(frame, self.fov_deg);
            camera.validate()?;
            draw_complete(gpu, &mut renderer, &target, &camera, self.wait)?;
            let rgba = target.read_rgba(&gpu.device, &gpu.queue)?;
            let picture = RgbaImage::from_raw(self.size[0], self.size[1], rgba);
            let picture = picture.context("the picture is not as large as it was asked for")?;
            gif.encode_frame(Frame::from_parts(picture, 0, 0, Delay::from_saturating_duration(SHOWN)))?;
        }
        drop(gif);
        write_whole(output, &bytes)
    }
}

/// Only GIF files hold films.
pub fn check_name(output: &Path) -> anyhow::Result<()> {
    if output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("gif")) {
        bail!("{}: a path is filmed into a GIF: name a file .gif", output.display());
    }
    Ok(())
}
