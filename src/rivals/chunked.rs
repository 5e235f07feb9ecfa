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
use super::slotted::Slotted;
use super::stage::{GridDraw, GridInstance, GridVertex, Stage};
use super::{DrawCount, DrawnMesh, Rival};
use crate::camera::Camera;
use crate::gpu::GpuError;
use crate::measure::FrameUpload;
use crate::renderer::{RenderError, Target};

/// The method at work.
pub(crate) struct Chunked {
    grids: Slotted,
    tables: Arc<Tables>,
    pixel_error: f64,
    refinement: Refinement,
}

impl Chunked {
    /// # Errors
    /// None yet: buffers are made when they are needed.
    pub fn new(stage: Stage, tables: Arc<Tables>, pixel_error: f64) -> Result<Self, GpuError> {
        let cells = tables.cells;
        let vertices = VertexSlots::new(tables.nodes(), (cells + 1) * (cells + 1));
        let indices = IndexSets::new(patterns::set_count(cells));
        Ok(Self {
            refinement: Refinement::new(&tables),
            grids: Slotted::new(stage, vertices, indices),
            tables,
            pixel_error,
        })
    }
}

impl Rival for Chunked {
    fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        camera.validate()?;
        let (stand, uniform_bytes) = self.grids.stage.look(camera, size_px);
        let tables = &*self.tables;
        let cells = tables.cells;
        self.refinement.refine(tables, &stand, self.pixel_error, self.grids.stage.scene.cull);
        self.grids.vertices.begin_frame();
        self.grids.draws.draws.clear();
        for chunk in &self.refinement.chunks {
            let (node, coarser) = (chunk.node, chunk.coarser);
            let set = patterns::set_number(cells, coarser);
            let indices = self.grids.indices.range(set, || patterns::pattern(cells, coarser));
            let (pool, first) = self.grids.vertices.take(tables.number(node));
            let (lo, tag) = (tables.low(node), node.level << 24);
            let instance = GridInstance { lo, step: 1 << node.level, side: cells + 1, first, tag };
            self.grids.draws.draws.push(GridDraw { pool, indices, instance });
        }
        self.grids.draws.draws.sort_by_key(|draw| draw.pool);
        let mut ledger = FrameUpload { uniform_bytes, ..FrameUpload::default() };
        ledger.index_bytes = self.grids.indices.upload(&self.grids.stage)?;
        let ground = &*self.grids.stage.ground;
        let last = ground.last();
        self.grids.vertices.upload(&self.grids.stage, &mut ledger, |number, to: &mut [GridVertex]| {
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
        ledger.control_bytes = self.grids.draws.upload(&self.grids.stage)?;
        Ok(ledger)
    }

    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        self.grids.record(encoder, target);
    }

    fn count(&self) -> Result<DrawCount, GpuError> {
        Ok(self.grids.count())
    }

    fn read_mesh(&self) -> Result<DrawnMesh, GpuError> {
        self.grids.read_mesh()
    }

    fn gpu_bytes(&self) -> u64 {
        self.grids.gpu_bytes()
    }

    fn cpu_bytes(&self) -> u64 {
        self.tables.bytes() + self.grids.cpu_bytes() + self.refinement.bytes()
    }
}
