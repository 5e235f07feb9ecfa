//! Geometry clipmaps with vertex buffers: the CPU makes the vertices a shift asks for, writes them into the
//! levels' toroidal arrays, crops each level to the view and rebuilds the index strips in every frame.
//!
//! Losasso and Hoppe, *Geometry Clipmaps*, 2004, as Brettell 2005, chapter 3 built it, with two differences:
//! windows are n = 2^k - 1 wide (Losasso and Hoppe's own choice) and stand where ours stand, so that both draw
//! the same triangles, and they hang over the data's border instead of stopping before it. Vertices of one
//! frame travel in one piece and are set in place by copies on the GPU. Indices have 32 bits, for all levels
//! in one draw; 16 would do for n up to 127. They are sent again only when they have changed.

mod strips;
mod vertices;

use wgpu::BufferUsages as U;

use self::strips::{RESTART, Strips};
use self::vertices::{ClipVertex, Maker};
use super::stage::Stage;
use super::{DrawCount, DrawnMesh, Lab, Rival, Unfit};
use crate::camera::Camera;
use crate::clipmap::{ClipmapShape, Rect, refill_from};
use crate::gpu::{GpuError, read_buffer};
use crate::measure::FrameUpload;
use crate::reference::Placement;
use crate::renderer::{RenderError, Target, windows_over_plane};
use crate::scene::Scene;

pub(crate) struct Classic {
    stage: Stage,
    shape: ClipmapShape,
    pipeline: super::stage::MeshPipeline,
    /// All levels, (n + 1)^2 vertices each, toroidal.
    vertices: wgpu::Buffer,
    staging: wgpu::Buffer,
    indices: wgpu::Buffer,
    strips: Strips,
    /// What each level's array holds.
    held: Vec<Option<Rect>>,
    /// From staging to the arrays: source, destination and bytes.
    copies: Vec<[u64; 3]>,
    placement: Option<Placement>,
}

impl Classic {
    pub fn new(lab: &Lab, scene: &Scene) -> Result<Self, Unfit> {
        let ground = lab.ground()?;
        let stage = Stage::new(&lab.device, &lab.queue, lab.format, &lab.terrain, scene, ground);
        let shape = scene.shape(&lab.terrain).map_err(|e| Unfit(e.to_string()))?;
        let side = u64::from(shape.n()) + 1;
        let bytes = side * side * u64::from(shape.levels()) * size_of::<ClipVertex>() as u64;
        let unfit = |e: GpuError| Unfit(e.to_string());
        let vertices = stage.buffer("clipmap vertices", bytes, U::VERTEX).map_err(unfit)?;
        let staging = stage.buffer("clipmap staging", 1 << 16, U::empty()).map_err(unfit)?;
        let indices = stage.buffer("clipmap strips", 1 << 16, U::INDEX).map_err(unfit)?;
        Ok(Self {
            pipeline: stage.clip_pipeline(),
            strips: Strips::default(),
            held: vec![None; shape.levels() as usize],
            copies: Vec::new(),
            placement: None,
            stage,
            shape,
            vertices,
            staging,
            indices,
        })
    }

    /// Makes the vertices that the windows lack, and where they belong.
    fn refill(&mut self, placement: &Placement, upload: &mut FrameUpload) -> Result<(), GpuError> {
        let windows = &placement.windows;
        let refill = refill_from(|level| self.held[level as usize], windows);
        let source = self.stage.terrain.source.clone();
        let maker = Maker { source: source.as_ref(), placement };
        let mut made: Vec<ClipVertex> = Vec::new();
        self.copies.clear();
        for strip in &refill.strips {
            let from = made.len();
            maker.make(strip.level, strip.rect, &mut made);
            self.place(strip.level, strip.rect, from);
        }
        for &level in &refill.shifted {
            self.held[level as usize] = Some(windows.window(level));
        }
        let bytes = size_of_val(&made[..]) as u64;
        if self.staging.size() < bytes {
            self.staging = self.stage.buffer("clipmap staging", bytes.next_power_of_two(), U::empty())?;
        }
        self.stage.queue.write_buffer(&self.staging, 0, bytemuck::cast_slice(&made));
        upload.vertices = made.len() as u64;
        upload.vertex_bytes = bytes;
        upload.shifts = refill.shifted.len() as u64;
        Ok(())
    }

    /// Copies of a strip's rows; a row that wraps round takes two.
    fn place(&mut self, level: u32, rect: Rect, from: usize) {
        let size = size_of::<ClipVertex>() as u64;
        let side = i64::from(self.shape.n()) + 1;
        let width = i64::from(rect.hi[0]) - i64::from(rect.lo[0]) + 1;
        let mut source = from as u64;
        for y in rect.lo[1]..=rect.hi[1] {
            let row = i64::from(level) * side + (i64::from(y) & (side - 1));
            let (mut x, mut left) = (i64::from(rect.lo[0]), width);
            while left > 0 {
                let column = x & (side - 1);
                let run = left.min(side - column);
                let (to, run_length) = ((row * side + column).cast_unsigned(), run.cast_unsigned());
                self.copies.push([source * size, to * size, run_length * size]);
                source += run_length;
                x += run;
                left -= run;
            }
        }
    }
}

impl Rival for Classic {
    fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        camera.validate()?;
        let (stand, uniform_bytes) = self.stage.look(camera, size_px);
        let windows = windows_over_plane(&self.stage.terrain, &self.stage.scene, self.shape, camera);
        let placement = Placement {
            windows,
            anchor: stand.plane.anchor,
            anchor_height_m: stand.plane.anchor_height_m,
            spacing_m: stand.spacing_m.map(|v| v as f32),
            eye_samples: stand.plane.eye_samples,
            morph: true,
            fades: [0.0; crate::clipmap::MAX_LEVELS as usize],
        };
        let mut upload = FrameUpload { uniform_bytes, ..FrameUpload::default() };
        self.refill(&placement, &mut upload)?;
        let before = std::mem::take(&mut self.strips);
        self.strips.rebuild(&placement.windows, &stand, &self.stage.ground, self.stage.scene.cull);
        self.placement = Some(placement);
        if before.indices == self.strips.indices {
            return Ok(upload);
        }
        let bytes = size_of_val(&self.strips.indices[..]) as u64;
        if self.indices.size() < bytes {
            self.indices = self.stage.buffer("clipmap strips", bytes.next_power_of_two(), U::INDEX)?;
        }
        self.stage.queue.write_buffer(&self.indices, 0, bytemuck::cast_slice(&self.strips.indices));
        upload.index_bytes = bytes;
        Ok(upload)
    }

    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        for [source, destination, bytes] in self.copies.drain(..) {
            encoder.copy_buffer_to_buffer(&self.staging, source, &self.vertices, destination, bytes);
        }
        let mut pass = self.stage.begin(encoder, target);
        pass.set_pipeline(&self.pipeline.pipeline);
        pass.set_bind_group(0, &self.pipeline.bind_group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.strips.indices.len() as u32, 0, 0..1);
    }

    fn count(&self) -> Result<DrawCount, GpuError> {
        Ok(DrawCount { triangles: self.strips.triangles, draw_calls: 1 })
    }

    fn read_mesh(&self) -> Result<DrawnMesh, GpuError> {
        let nothing = || GpuError::Readback { reason: "no frame was drawn".into() };
        let placement = self.placement.as_ref().ok_or_else(nothing)?;
        let stand = self.stage.stand.ok_or_else(nothing)?;
        let (device, queue) = (&self.stage.device, &self.stage.queue);
        let count = (self.vertices.size() / size_of::<ClipVertex>() as u64) as usize;
        let vertices: Vec<ClipVertex> = read_buffer(device, queue, &self.vertices, count)?;
        let indices: Vec<u32> = read_buffer(device, queue, &self.indices, self.strips.indices.len())?;
        let positions = vertices.iter().map(|v| v.position(placement)).collect();
        let mut triangles = Vec::new();
        for strip in indices.split(|ix| *ix == RESTART) {
            for (k, t) in strip.windows(3).enumerate() {
                // Rows go south to north first: every even triangle turns clockwise.
                triangles.push(if k % 2 == 0 { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] });
            }
        }
        Ok(DrawnMesh { anchor_m: stand.plane.anchor_m.to_array(), positions, triangles })
    }

    fn gpu_bytes(&self) -> u64 {
        self.vertices.size() + self.staging.size() + self.indices.size()
    }

    fn cpu_bytes(&self) -> u64 {
        size_of_val(&self.strips.indices[..]) as u64 + self.stage.ground.range_bytes()
    }
}
