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
use super::slotted::Slotted;
use super::stage::{GridDraw, GridInstance, GridVertex, Stage};
use super::{DrawCount, DrawnMesh, Rival};
use crate::camera::Camera;
use crate::gpu::GpuError;
use crate::measure::FrameUpload;
use crate::renderer::{RenderError, Target};

/// Largest patch whose index sets are all made at the start; those of larger ones are many and mostly unused.
const ALL_SETS_CELLS: u32 = 32;

/// The method at work.
pub(crate) struct Geomipmap {
    grids: Slotted,
    tables: Arc<Tables>,
    pixel_error: f64,
    selection: Selection,
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
        let vertices = VertexSlots::new(patches, (cells + 1) * (cells + 1));
        Ok(Self {
            selection: Selection::new(&tables),
            start_bytes,
            grids: Slotted::new(stage, vertices, indices),
            tables,
            pixel_error,
        })
    }
}

impl Rival for Geomipmap {
    fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        camera.validate()?;
        let (stand, uniform_bytes) = self.grids.stage.look(camera, size_px);
        let tables = &*self.tables;
        let cells = tables.cells;
        self.selection.choose(tables, &stand, self.pixel_error, self.grids.stage.scene.cull);
        self.grids.vertices.begin_frame();
        self.grids.draws.draws.clear();
        for patch in &self.selection.chosen {
            let (level, extra) = (patch.level, patch.extra);
            let set = patterns::set_number(level, extra);
            let indices = self.grids.indices.range(set, || patterns::pattern(cells, level, extra));
            let (pool, first) = self.grids.vertices.take(tables.number(patch.at) as u32);
            // Numbers count at full resolution: coarse levels leave vertices out.
            let lo = tables.low(patch.at);
            let instance = GridInstance { lo, step: 1, side: cells + 1, first, tag: level << 24 };
            self.grids.draws.draws.push(GridDraw { pool, indices, instance });
        }
        self.grids.draws.draws.sort_by_key(|draw| draw.pool);
        let mut ledger = FrameUpload { uniform_bytes, ..FrameUpload::default() };
        ledger.index_bytes =
            self.grids.indices.upload(&self.grids.stage)? + std::mem::take(&mut self.start_bytes);
        let ground = &*self.grids.stage.ground;
        let normals = ground.normals();
        self.grids.vertices.upload(&self.grids.stage, &mut ledger, |patch, to: &mut [GridVertex]| {
            let lo = tables.low(tables.place(patch));
            let rows = to.chunks_mut(cells as usize + 1);
            for (y, row) in (lo[1]..).zip(rows) {
                for (x, vertex) in (lo[0]..).zip(row) {
                    let at = ground.index([x, y]);
                    *vertex = GridVertex { height: ground.heights[at], normal: normals[at] };
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
        self.tables.bytes() + self.grids.cpu_bytes() + self.selection.bytes()
    }
}
