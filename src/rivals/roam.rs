//! Real-time optimally adapting meshes: a triangulation of right isosceles triangles that is split and merged
//! from frame to frame until no triangle's error on screen is above a threshold.
//!
//! Duchaineau, Wolinsky, Sigeti, Miller, Aldrich and Mineev-Weinstein, *ROAMing Terrain: Real-time Optimally
//! Adapting Meshes*, 1997, as Brettell 2005, sections 2.1.1 and 4, has it: frame-to-frame coherent, with two
//! queues, and with a threshold in place of a number of triangles. What of it suits today's hardware is done
//! here: vertices stay on the GPU in slots of one buffer and only new ones are sent, and one list of indices
//! is drawn at once. Priorities are computed anew in every frame, in parallel, rather than put off by bounds
//! on the camera's speed: the mesh is then a function of the path of the camera and not of the clock.

mod errors;
mod queues;
#[cfg(test)]
mod tests;
mod triangles;

use std::sync::Arc;

use wgpu::BufferUsages as U;

use self::errors::Bound;
pub(crate) use self::errors::Errors;
use self::triangles::{OUT_OF_VIEW, Triangulation};
use super::stage::{MeshPipeline, MeshVertex, Stage, Stand, place};
use super::{DrawCount, DrawnMesh, Rival};
use crate::camera::Camera;
use crate::gpu::{GpuError, read_buffer};
use crate::measure::FrameUpload;
use crate::renderer::{RenderError, Target};

/// Most triangles of the triangulation: about 32 MB of vertices and indices, 250 MB of trees.
const MOST_LEAVES: usize = 2_000_000;
/// Bytes that buffers start with.
const FIRST_BYTES: u64 = 1 << 16;
/// Bytes of a vertex.
const VERTEX_BYTES: u64 = size_of::<MeshVertex>() as u64;

pub(crate) struct Roam {
    stage: Stage,
    errors: Arc<Errors>,
    pixel_error: f32,
    mesh: Triangulation,
    pipeline: MeshPipeline,
    /// A vertex a slot of the triangulation.
    vertices: wgpu::Buffer,
    /// New vertices on their way, close together: one write, however their slots are scattered.
    staging: wgpu::Buffer,
    indices: wgpu::Buffer,
    /// Slots whose vertices were not set in place yet.
    pending: Vec<u32>,
    /// From staging to slots: source, destination and bytes.
    copies: Vec<[u64; 3]>,
    /// Indices of this frame.
    list: Vec<u32>,
    has_warned: bool,
}

impl Roam {
    /// # Errors
    /// When the device has no room for the first buffers.
    pub fn new(stage: Stage, errors: Arc<Errors>, pixel_error: f64) -> Result<Self, GpuError> {
        let mesh = Triangulation::new(stage.ground.clone(), errors.clone());
        // Made at the first call, which should not be in a frame.
        let _ = stage.ground.normals();
        Ok(Self {
            pipeline: stage.mesh_pipeline(),
            vertices: stage.buffer("roam vertices", FIRST_BYTES, U::VERTEX)?,
            staging: stage.buffer("roam staging", FIRST_BYTES, U::empty())?,
            indices: stage.buffer("roam indices", FIRST_BYTES, U::INDEX)?,
            pixel_error: pixel_error.max(0.0) as f32,
            stage,
            errors,
            mesh,
            pending: Vec::new(),
            copies: Vec::new(),
            list: Vec::new(),
            has_warned: false,
        })
    }

    /// Sends the vertices that came in; all of them when their buffer has become too small.
    fn send_vertices(&mut self, upload: &mut FrameUpload) -> Result<(), GpuError> {
        self.pending.append(&mut self.mesh.changed);
        let needed = self.mesh.vertices.len() as u64 * VERTEX_BYTES;
        if self.vertices.size() < needed {
            self.vertices = self.stage.buffer("roam vertices", needed.next_power_of_two(), U::VERTEX)?;
            self.pending.clear();
            self.pending.extend(0..self.mesh.vertices.len() as u32);
        }
        self.pending.sort_unstable();
        self.pending.dedup();
        let made: Vec<MeshVertex> = self.pending.iter().map(|slot| self.vertex(*slot)).collect();
        let bytes = made.len() as u64 * VERTEX_BYTES;
        if self.staging.size() < bytes {
            self.staging = self.stage.buffer("roam staging", bytes.next_power_of_two(), U::empty())?;
        }
        if !made.is_empty() {
            self.stage.queue.write_buffer(&self.staging, 0, bytemuck::cast_slice(&made));
        }
        runs(&self.pending, &mut self.copies);
        upload.vertices = made.len() as u64;
        upload.vertex_bytes = bytes;
        Ok(())
    }

    /// The vertex of a slot; beyond the data it stands on the last sample.
    fn vertex(&self, slot: u32) -> MeshVertex {
        let ground = &self.stage.ground;
        let (at, last) = (self.mesh.vertices[slot as usize], ground.last());
        let base = [at[0].min(last[0]), at[1].min(last[1])];
        let ix = ground.index(base);
        // Two depths of the trees are a level. Bits 29 and up are not the level's.
        let level = (at[0] | at[1]).trailing_zeros().min(31);
        MeshVertex { base, height: ground.heights[ix], packed: ground.normals()[ix] | level << 24 }
    }

    fn send_indices(&mut self, upload: &mut FrameUpload) -> Result<(), GpuError> {
        let before = std::mem::take(&mut self.list);
        self.mesh.list(&mut self.list);
        if self.list == before {
            return Ok(()); // the buffer holds them already
        }
        let bytes = size_of_val(&self.list[..]) as u64;
        if self.indices.size() < bytes {
            self.indices = self.stage.buffer("roam indices", bytes.next_power_of_two(), U::INDEX)?;
        }
        if !self.list.is_empty() {
            self.stage.queue.write_buffer(&self.indices, 0, bytemuck::cast_slice(&self.list));
        }
        upload.index_bytes = bytes;
        Ok(())
    }
}

/// Copies of ascending slots from where they lie close together, a run at a time.
fn runs(slots: &[u32], copies: &mut Vec<[u64; 3]>) {
    copies.clear();
    let mut source = 0;
    for run in slots.chunk_by(|a, b| a + 1 == *b) {
        let bytes = run.len() as u64 * VERTEX_BYTES;
        copies.push([source, u64::from(run[0]) * VERTEX_BYTES, bytes]);
        source += bytes;
    }
}

/// Error of a triangle on screen, pixels, at its nearest point: a bound.
fn priority(stand: &Stand, cull: bool, bound: &Bound) -> f32 {
    let is_seen = || !cull || stand.sees(bound.lo, bound.hi, bound.range_m);
    if !bound.has_area() || !is_seen() {
        return OUT_OF_VIEW;
    }
    if bound.error_m == 0.0 {
        return 0.0;
    }
    let distance_m = stand.distance_m(bound.lo, bound.hi, bound.range_m);
    stand.error_px(bound.error_m, distance_m) as f32
}

impl Rival for Roam {
    fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        camera.validate()?;
        let (stand, uniform_bytes) = self.stage.look(camera, size_px);
        let cull = self.stage.scene.cull;
        let view = |bound: &Bound| priority(&stand, cull, bound);
        let is_full = self.mesh.refine(self.pixel_error, MOST_LEAVES, &view);
        if is_full && !self.has_warned {
            log::warn!("roam: {MOST_LEAVES} triangles do not reach {} pixels", self.pixel_error);
            self.has_warned = true;
        }
        let mut upload = FrameUpload { uniform_bytes, ..FrameUpload::default() };
        self.send_vertices(&mut upload)?;
        self.send_indices(&mut upload)?;
        Ok(upload)
    }

    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        for [source, destination, bytes] in self.copies.drain(..) {
            encoder.copy_buffer_to_buffer(&self.staging, source, &self.vertices, destination, bytes);
        }
        self.pending.clear();
        let mut pass = self.stage.begin(encoder, target);
        if self.list.is_empty() {
            return;
        }
        pass.set_pipeline(&self.pipeline.pipeline);
        pass.set_bind_group(0, &self.pipeline.bind_group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.list.len() as u32, 0, 0..1);
    }

    fn count(&self) -> Result<DrawCount, GpuError> {
        let draw_calls = u64::from(!self.list.is_empty());
        Ok(DrawCount { triangles: self.list.len() as u64 / 3, draw_calls })
    }

    fn read_mesh(&self) -> Result<DrawnMesh, GpuError> {
        let nothing = || GpuError::Readback { reason: "no frame was drawn".into() };
        let stand = self.stage.stand.ok_or_else(nothing)?;
        let (device, queue) = (&self.stage.device, &self.stage.queue);
        let vertices: Vec<MeshVertex> = read_buffer(device, queue, &self.vertices, self.mesh.vertices.len())?;
        let indices: Vec<u32> = read_buffer(device, queue, &self.indices, self.list.len())?;
        Ok(DrawnMesh {
            anchor_m: stand.plane.anchor_m.to_array(),
            positions: vertices.iter().map(|v| place(&stand, v.base, v.height)).collect(),
            triangles: indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        })
    }

    fn gpu_bytes(&self) -> u64 {
        self.vertices.size() + self.staging.size() + self.indices.size()
    }

    fn cpu_bytes(&self) -> u64 {
        let lists = (self.pending.capacity() + self.list.capacity()) * size_of::<u32>()
            + self.copies.capacity() * size_of::<[u64; 3]>();
        self.errors.bytes() + self.mesh.bytes() + self.stage.ground.range_bytes() + lists as u64
    }
}
