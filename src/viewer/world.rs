//! The terrain, how it is looked at, and the renderers that draw it: all that a picture needs but the camera.

use anyhow::Context as _;
use glam::DVec3;
use tessclip::gpu::{Counters, Gpu};
use tessclip::measure::FrameUpload;
use tessclip::renderer::{DrawnSurface, Target};
use tessclip::{Camera, Factors, Renderer, Terrain};

use super::facts::UnderCursor;
use super::look::Look;
use crate::cli::beside::{Beside, halves};

/// What is drawn.
pub struct World {
    /// As it is drawn, heights exaggerated.
    pub terrain: Terrain,
    /// The look that the renderers have.
    pub look: Look,
    /// With its own heights.
    plain: Terrain,
    renderer: Renderer,
    beside: Option<Beside>,
    /// Where patches go by error their factors are known a frame later: then the surface is that old.
    surface: Option<DrawnSurface>,
    counters: Option<Counters>,
    /// What the last frame of ours sent.
    pub upload: FrameUpload,
}

impl World {
    /// Renderers for a terrain with its own heights.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat, plain: &Terrain, look: &Look) -> anyhow::Result<Self> {
        let terrain = exaggerated(plain, look.exaggeration)?;
        let renderer = renderer(gpu, format, &terrain, look)?;
        let mut world = Self {
            terrain,
            look: Look { beside: None, ..look.clone() },
            plain: plain.clone(),
            renderer,
            beside: None,
            surface: None,
            counters: None,
            upload: FrameUpload::default(),
        };
        world.stand_beside(gpu, format, look)?;
        Ok(world)
    }

    /// Takes another look. What cannot be drawn is said: then everything stays as it was, or, where only a rival
    /// cannot draw it, all but the rival.
    pub fn take(&mut self, gpu: &Gpu, format: wgpu::TextureFormat, look: &Look) -> anyhow::Result<()> {
        if *look == self.look {
            return Ok(());
        }
        frozen(&self.terrain, look).map_or(Ok(()), |camera| camera.validate())?;
        let same_heights = look.exaggeration == self.look.exaggeration;
        if !same_heights || !self.renderer.restyle(&look.scene) {
            let terrain = match same_heights {
                true => self.terrain.clone(),
                false => exaggerated(&self.plain, look.exaggeration)?,
            };
            self.renderer = renderer(gpu, format, &terrain, look)?;
            self.terrain = terrain;
            self.surface = None;
            self.counters = None;
        } else {
            self.renderer.freeze(frozen(&self.terrain, look))?;
        }
        let next = Look { beside: self.look.beside, ..look.clone() };
        let before = std::mem::replace(&mut self.look, next);
        if !same_heights {
            self.beside = None;
        }
        let drawn_alike = before.scene == look.scene && same_heights && before.beside == look.beside;
        if drawn_alike { Ok(()) } else { self.stand_beside(gpu, format, look) }
    }

    /// The rival that the look asks for, made for its scene.
    fn stand_beside(&mut self, gpu: &Gpu, format: wgpu::TextureFormat, look: &Look) -> anyhow::Result<()> {
        self.look.beside = None;
        let kept = self.beside.take();
        let Some(method) = look.beside else { return Ok(()) };
        let Some(mut beside) = kept else {
            let (device, queue) = (&gpu.device, &gpu.queue);
            self.beside = Some(Beside::new(device, queue, format, &self.terrain, &look.scene, method)?);
            self.look.beside = Some(method);
            return Ok(());
        };
        let before = beside.method;
        let failed = beside.restyle(&look.scene, method).err();
        // The one that stood there stays where another one cannot.
        if failed.is_none() || beside.restyle(&look.scene, before).is_ok() {
            self.look.beside = Some(beside.method);
            self.beside = Some(beside);
        }
        failed.map_or(Ok(()), Err)
    }

    /// Uploads what this camera needs.
    pub fn prepare(&mut self, camera: &Camera, size: [u32; 2]) -> anyhow::Result<FrameUpload> {
        let [_, _, w, h] = self.parts(size).map_or([0, 0, size[0], size[1]], |[left, _]| left);
        self.upload = self.renderer.prepare(camera, [w, h])?;
        if let (Some([_, [_, _, w, h]]), Some(beside)) = (self.parts(size), &mut self.beside) {
            beside.prepare(camera, [w, h])?;
        }
        if self.look.scene.factors == Factors::Uniform {
            self.surface = self.renderer.drawn().ok();
        }
        Ok(self.upload)
    }

    /// Records the prepared frame.
    pub fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        [color, depth]: [&wgpu::TextureView; 2],
        size: [u32; 2],
    ) {
        let target = Target { color, depth, clear: true, area: None };
        let (Some([left, right]), Some(beside)) = (self.parts(size), &mut self.beside) else {
            self.renderer.record(encoder, target);
            return;
        };
        self.renderer.record(encoder, Target { area: Some(left), ..target });
        beside.record(encoder, Target { area: Some(right), clear: false, ..target });
    }

    /// After the frame's submission: what came back of earlier ones. Makes room where patches were dropped;
    /// true when the frame must be drawn again.
    pub fn after(&mut self) -> anyhow::Result<bool> {
        let by_error = self.look.scene.factors.by_error();
        let Some(watched) = self.renderer.watched() else { return Ok(false) };
        let counters = watched.counters;
        if by_error && watched.surface.is_some() {
            self.surface = watched.surface.clone();
        }
        self.counters = Some(counters);
        Ok(self.renderer.grow(&counters)?)
    }

    /// Counters of the last frame that the GPU told about.
    pub fn counters(&self) -> Option<&Counters> {
        self.counters.as_ref()
    }

    pub fn renderer(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    /// Triangles that the rival drew last. The frame must be done: some methods ask the GPU.
    pub fn beside_triangles(&self) -> Option<u64> {
        Some(self.beside.as_ref()?.count().ok()?.triangles)
    }

    /// Height of a point above the ground as it is drawn, metres; above the full resolution where nothing was
    /// drawn yet.
    pub fn above(&self, p: DVec3) -> Option<f64> {
        let drawn = self.surface.as_ref().and_then(|s| s.at(p));
        drawn.or_else(|| self.terrain.surface_at(p)).map(|spot| spot.above_m)
    }

    /// The ground that a camera sees at a pixel.
    pub fn under(&self, camera: &Camera, pixel: [u32; 2], size: [u32; 2]) -> Option<(DVec3, UnderCursor)> {
        let direction = self.ray(camera, pixel, size);
        let reach_m = 4.0 * (camera.eye_m.length() + self.reach_m());
        let hit = self.terrain.pick(camera.eye_m, direction, reach_m)?;
        let full = self.terrain.surface_at(hit);
        let drawn = self.surface.as_ref().and_then(|s| s.at(hit)).or(full)?;
        let [x, y, _] = self.terrain.native_at_point(hit);
        let cursor = UnderCursor {
            place: [x, y],
            drawn_m: drawn.height_m,
            full_m: full.map(|f| f.height_m),
            slope_deg: full.map_or(drawn.slope_deg, |f| f.slope_deg),
            distance_m: camera.eye_m.distance(drawn.point_m),
            level: drawn.level,
        };
        Some((drawn.point_m, cursor))
    }

    /// Through the middle of a pixel; in either half of a split picture as that half shows it.
    fn ray(&self, camera: &Camera, pixel: [u32; 2], size: [u32; 2]) -> DVec3 {
        let Some([ours, theirs]) = self.parts(size) else { return camera.ray(pixel, size) };
        let [left, top, w, h] = if pixel[0] < theirs[0] { ours } else { theirs };
        camera.ray([pixel[0] - left, pixel[1] - top], [w, h])
    }

    /// Both halves while a rival stands beside; a window may be too narrow for two.
    fn parts(&self, size: [u32; 2]) -> Option<[[u32; 4]; 2]> {
        (self.beside.is_some() && size[0] > 1).then(|| halves(size))
    }

    /// Lowest and highest height as drawn, metres.
    pub fn heights_m(&self) -> Option<[f32; 2]> {
        match &self.terrain.curved {
            Some(curved) => curved.height_range(),
            None => self.terrain.source.height_range(),
        }
    }

    /// A length that is large beside the terrain, metres.
    pub fn reach_m(&self) -> f64 {
        match &self.terrain.curved {
            Some(curved) => 2.0 * curved.surface.reach_m(),
            None => {
                let [low, high] = self.terrain.extent_m();
                (high[0] - low[0]).hypot(high[1] - low[1])
            }
        }
    }
}

fn exaggerated(plain: &Terrain, factor: f64) -> anyhow::Result<Terrain> {
    let terrain = plain.clone().exaggerated(factor as f32);
    if let Some(curved) = &terrain.curved {
        curved.check_relief().with_context(|| format!("heights times {factor}"))?;
    }
    Ok(terrain)
}

fn frozen(terrain: &Terrain, look: &Look) -> Option<Camera> {
    look.frozen.map(|pose| terrain.camera(pose, look.fov_deg))
}

fn renderer(
    gpu: &Gpu,
    format: wgpu::TextureFormat,
    terrain: &Terrain,
    look: &Look,
) -> anyhow::Result<Renderer> {
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, format, terrain, &look.scene)?;
    renderer.time_passes();
    renderer.watch();
    renderer.freeze(frozen(terrain, look))?;
    Ok(renderer)
}
