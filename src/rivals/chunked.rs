//! The chunked quadtree (Ulrich 2002, "Rendering Massive Terrains using Chunked Level of Detail Control")
//! with the regular chunks, the refinement and the joined edges of Brandstetter 2007, "Multi-Resolution
//! Deformation in Out-of-Core Terrain Rendering": chunks of a fixed number of vertices, each level with twice
//! the samples between them; the finer of two neighbours leaves out the vertices that the coarser one lacks.

mod patterns;
mod refine;
mod tables;

use std::sync::Arc;

pub(crate) use self::tables::Tables;

use self::refine::Refinement;
use super::slots::{IndexSets, VertexSlots};
use super::stage::{GridDraw, GridDraws, GridInstance, GridVertex, MeshPipeline, Stage};
use super::{DrawCount, DrawnMesh, Rival};
use crate::camera::Camera;
use crate::gpu::GpuError;
use crate::measure::FrameUpload;
use crate::renderer::{RenderError, Target};

const FORMAT: wgpu::IndexFormat = wgpu::IndexFormat::Uint16;

/// The method at work.
pub(crate) struct Chunked {
    stage: Stage,
    tables: Arc<Tables>,
    pixel_error: f64,
    pipeline: MeshPipeline,
    refinement: Refinement,
    vertices: VertexSlots,
    indices: IndexSets,
    draws: GridDraws,
}

impl Chunked {
    /// # Errors
    /// None yet: buffers are made when they are needed.
    pub fn new(stage: Stage, tables: Arc<Tables>, pixel_error: f64) -> Result<Self, GpuError> {
        let cells = tables.cells;
        Ok(Self {
            pipeline: stage.grid_pipeline(),
            refinement: Refinement::new(&tables),
            vertices: VertexSlots::new(tables.nodes(), (cells + 1) * (cells + 1)),
            indices: IndexSets::new(patterns::set_count(cells)),
            draws: GridDraws::default(),
            stage,
            tables,
            pixel_error,
        })
    }
}

impl Rival for Chunked {
    fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        camera.validate()?;
        let (stand, uniform_bytes) = self.stage.look(camera, size_px);
        let tables = &*self.tables;
        let cells = tables.cells;
        self.refinement.refine(tables, &stand, self.pixel_error, self.stage.scene.cull);
        self.vertices.begin_frame();
        self.draws.draws.clear();
        for chunk in &self.refinement.chunks {
            let (node, coarser) = (chunk.node, chunk.coarser);
            let set = patterns::set_number(cells, coarser);
            let indices = self.indices.range(set, || patterns::pattern(cells, coarser));
            let (pool, first) = self.vertices.take(tables.number(node));
            let (lo, tag) = (tables.low(node), node.level << 24);
            let instance = GridInstance { lo, step: 1 << node.level, side: cells + 1, first, tag };
            self.draws.draws.push(GridDraw { pool, indices, instance });
        }
        self.draws.draws.sort_by_key(|draw| draw.pool);
        let mut ledger = FrameUpload { uniform_bytes, ..FrameUpload::default() };
        ledger.index_bytes = self.indices.upload(&self.stage)?;
        let ground = &*self.stage.ground;
        let last = ground.last();
        self.vertices.upload(&self.stage, &mut ledger, |number, to: &mut [GridVertex]| {
            let node = tables.node(number);
            let lo = tables.low(node);
            let step = 1_i32 << node.level;
            for (row, vertices) in (0_i32..).zip(to.chunks_mut(cells as usize + 1)) {
                for (column, vertex) in (0_i32..).zip(vertices) {
                    let at = [(lo[0] + column * step).min(last[0]), (lo[1] + row * step).min(last[1])];
                    *vertex = GridVertex { height: ground.height(at), normal: ground.normal(at, step) };
                }
            }
        })?;
        ledger.control_bytes = self.draws.upload(&self.stage)?;
        Ok(ledger)
    }

    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        let mut pass = self.stage.begin(encoder, target);
        if let Some(indices) = self.indices.buffer() {
            self.draws.record(&mut pass, &self.pipeline, &self.vertices.pools, indices, FORMAT);
        }
    }

    fn count(&self) -> Result<DrawCount, GpuError> {
        Ok(self.draws.count())
    }

    fn read_mesh(&self) -> Result<DrawnMesh, GpuError> {
        let nothing = || GpuError::Readback { reason: "no frame was drawn".into() };
        let indices = self.indices.buffer().ok_or_else(nothing)?;
        self.draws.read_mesh(&self.stage, &self.vertices.pools, indices, FORMAT)
    }

    fn gpu_bytes(&self) -> u64 {
        self.vertices.gpu_bytes() + self.indices.gpu_bytes() + self.draws.gpu_bytes()
    }

    fn cpu_bytes(&self) -> u64 {
        let books = self.vertices.cpu_bytes() + self.indices.cpu_bytes() + self.refinement.bytes();
        self.tables.bytes() + books
    }
}
