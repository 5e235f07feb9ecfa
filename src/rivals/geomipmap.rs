//! Geometrical mipmapping (de Boer 2000) as Brodersen 2005, "Real-Time Visualization of Large Textured
//! Terrains", draws large terrain with it: patches of a fixed size, each as coarse as its error on screen
//! allows; finer neighbours add their vertices to the border; index sets of all combinations made beforehand;
//! vertices in slots that the least recently used patch gives up.

#[cfg(test)]
pub(super) mod check;
pub(super) mod grid;
mod patterns;
mod select;
mod tables;

use std::sync::Arc;

pub(crate) use self::tables::Tables;

use self::select::Selection;
use super::slots::{IndexSets, VertexSlots};
use super::stage::{GridDraw, GridDraws, GridInstance, GridVertex, MeshPipeline, Stage};
use super::{DrawCount, DrawnMesh, Rival};
use crate::camera::Camera;
use crate::gpu::GpuError;
use crate::measure::FrameUpload;
use crate::renderer::{RenderError, Target};

/// Largest patch whose index sets are all made at the start; those of larger ones are many and mostly unused.
const ALL_SETS_CELLS: u32 = 32;

const FORMAT: wgpu::IndexFormat = wgpu::IndexFormat::Uint16;

/// The method at work.
pub(crate) struct Geomipmap {
    stage: Stage,
    tables: Arc<Tables>,
    pixel_error: f64,
    pipeline: MeshPipeline,
    selection: Selection,
    vertices: VertexSlots,
    indices: IndexSets,
    draws: GridDraws,
    /// Index bytes sent when it was made; told with the first frame.
    start_bytes: u64,
}

impl Geomipmap {
    /// # Errors
    /// When the index sets do not fit a buffer of this device.
    pub fn new(stage: Stage, tables: Arc<Tables>, pixel_error: f64) -> Result<Self, GpuError> {
        let cells = tables.cells;
        let mut indices = IndexSets::new(patterns::set_count(tables.levels));
        if cells <= ALL_SETS_CELLS {
            for (number, (level, extra)) in patterns::all_sets(tables.levels).enumerate() {
                indices.range(number, || patterns::pattern(cells, level, extra));
            }
        }
        let start_bytes = indices.upload(&stage)?;
        // Made at the first call: not in the first frame.
        let _ = stage.ground.normals();
        let patches = tables.patches[0] as usize * tables.patches[1] as usize;
        Ok(Self {
            pipeline: stage.grid_pipeline(),
            selection: Selection::new(&tables),
            vertices: VertexSlots::new(patches, (cells + 1) * (cells + 1)),
            indices,
            draws: GridDraws::default(),
            start_bytes,
            stage,
            tables,
            pixel_error,
        })
    }
}

impl Rival for Geomipmap {
    fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        camera.validate()?;
        let (stand, uniform_bytes) = self.stage.look(camera, size_px);
        let tables = &*self.tables;
        let cells = tables.cells;
        self.selection.choose(tables, &stand, self.pixel_error, self.stage.scene.cull);
        self.vertices.begin_frame();
        self.draws.draws.clear();
        for patch in &self.selection.chosen {
            let (level, extra) = (patch.level, patch.extra);
            let set = patterns::set_number(level, extra);
            let indices = self.indices.range(set, || patterns::pattern(cells, level, extra));
            let (pool, first) = self.vertices.take(tables.number(patch.at) as u32);
            // Numbers count at full resolution: coarse levels leave vertices out.
            let lo = tables.low(patch.at);
            let instance = GridInstance { lo, step: 1, side: cells + 1, first, tag: level << 24 };
            self.draws.draws.push(GridDraw { pool, indices, instance });
        }
        self.draws.draws.sort_by_key(|draw| draw.pool);
        let mut ledger = FrameUpload { uniform_bytes, ..FrameUpload::default() };
        ledger.index_bytes = self.indices.upload(&self.stage)? + std::mem::take(&mut self.start_bytes);
        let ground = &*self.stage.ground;
        let normals = ground.normals();
        self.vertices.upload(&self.stage, &mut ledger, |patch, to: &mut [GridVertex]| {
            let lo = tables.low(tables.place(patch));
            let rows = to.chunks_mut(cells as usize + 1);
            for (y, row) in (lo[1]..).zip(rows) {
                for (x, vertex) in (lo[0]..).zip(row) {
                    let at = ground.index([x, y]);
                    *vertex = GridVertex { height: ground.heights[at], normal: normals[at] };
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
        let books = self.vertices.cpu_bytes() + self.indices.cpu_bytes() + self.selection.bytes();
        self.tables.bytes() + books
    }
}
