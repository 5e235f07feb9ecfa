//! What methods that draw grids of samples from slots have in common: they differ in what they choose.

use super::slots::{IndexSets, VertexSlots};
use super::stage::{GridDraws, MeshPipeline, Stage};
use super::{DrawCount, DrawnMesh};
use crate::gpu::GpuError;
use crate::renderer::Target;

const FORMAT: wgpu::IndexFormat = wgpu::IndexFormat::Uint16;

/// Slots of vertices, index sets, and this frame's draws of them.
pub(crate) struct Slotted {
    pub stage: Stage,
    pipeline: MeshPipeline,
    pub vertices: VertexSlots,
    pub indices: IndexSets,
    pub draws: GridDraws,
}

impl Slotted {
    /// Nothing chosen yet.
    pub fn new(stage: Stage, vertices: VertexSlots, indices: IndexSets) -> Self {
        Self { pipeline: stage.grid_pipeline(), stage, vertices, indices, draws: GridDraws::default() }
    }

    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        let mut pass = self.stage.begin(encoder, target);
        if let Some(indices) = self.indices.buffer() {
            self.draws.record(&mut pass, &self.pipeline, &self.vertices.pools, indices, FORMAT);
        }
    }

    pub fn count(&self) -> DrawCount {
        self.draws.count()
    }

    pub fn read_mesh(&self) -> Result<DrawnMesh, GpuError> {
        let nothing = || GpuError::Readback { reason: "no frame was drawn".into() };
        let indices = self.indices.buffer().ok_or_else(nothing)?;
        self.draws.read_mesh(&self.stage, &self.vertices.pools, indices, FORMAT)
    }

    pub fn gpu_bytes(&self) -> u64 {
        self.vertices.gpu_bytes() + self.indices.gpu_bytes() + self.draws.gpu_bytes()
    }

    /// Book-keeping of slots and sets.
    pub fn cpu_bytes(&self) -> u64 {
        self.vertices.cpu_bytes() + self.indices.cpu_bytes()
    }
}
