//! Brute force: every sample of the data in one static buffer, every triangle of them drawn in every frame,
//! in view or not (Brettell 2005, section 4: the display list). The speed of light for small terrain, and the
//! surface that errors are measured against.

use wgpu::BufferUsages as U;

use super::stage::{GridDraw, GridDraws, GridInstance, GridVertex, MeshPipeline, Stage};
use super::{DrawCount, DrawnMesh, Rival};
use crate::camera::Camera;
use crate::gpu::GpuError;
use crate::measure::FrameUpload;
use crate::renderer::{RenderError, Target};

/// Cells a side of the piece that one index pattern covers; the buffer of vertices is one all the same.
const TILE_CELLS: u32 = 256;
/// Vertices sent at once, so that no second copy of all of them is needed.
const CHUNK: usize = 1 << 20;

pub(crate) struct BruteForce {
    stage: Stage,
    pipeline: MeshPipeline,
    vertices: Vec<wgpu::Buffer>,
    indices: wgpu::Buffer,
    draws: GridDraws,
    /// Sent when it was made; told with the first frame.
    start: FrameUpload,
}

impl BruteForce {
    /// # Errors
    /// When the samples do not fit a buffer of this device.
    pub fn new(stage: Stage) -> Result<Self, GpuError> {
        let ground = stage.ground.clone();
        let [width, height] = ground.size;
        let count = ground.heights.len();
        let bytes = (count * size_of::<GridVertex>()) as u64;
        let vertices = stage.buffer("all samples", bytes, U::VERTEX)?;
        let mut at = 0;
        for (heights, normals) in ground.heights.chunks(CHUNK).zip(ground.normals().chunks(CHUNK)) {
            let made: Vec<GridVertex> =
                heights.iter().zip(normals).map(|(h, n)| GridVertex { height: *h, normal: *n }).collect();
            stage.queue.write_buffer(&vertices, at, bytemuck::cast_slice(&made));
            // The staging memory of this piece is free again before the next one.
            stage.queue.submit([]);
            at += size_of_val(&made[..]) as u64;
        }
        let (patterns, draws) = tiles([width, height]);
        let indices = stage.buffer("patterns", size_of_val(&patterns[..]) as u64, U::INDEX)?;
        stage.queue.write_buffer(&indices, 0, bytemuck::cast_slice(&patterns));
        let mut draws = GridDraws::of(draws);
        let start = FrameUpload {
            vertices: count as u64,
            vertex_bytes: bytes,
            index_bytes: size_of_val(&patterns[..]) as u64,
            control_bytes: draws.upload(&stage)?,
            ..FrameUpload::default()
        };
        let pipeline = stage.grid_pipeline();
        Ok(Self { stage, pipeline, vertices: vec![vertices], indices, draws, start })
    }
}

/// Index patterns of the sizes of tiles that occur, and a draw for each tile.
fn tiles(size: [u32; 2]) -> (Vec<u32>, Vec<GridDraw>) {
    let mut patterns: Vec<u32> = Vec::new();
    let mut known: Vec<([u32; 2], [u32; 2])> = Vec::new();
    let mut draws = Vec::new();
    for y in (0..size[1] - 1).step_by(TILE_CELLS as usize) {
        for x in (0..size[0] - 1).step_by(TILE_CELLS as usize) {
            let cells = [(size[0] - 1 - x).min(TILE_CELLS), (size[1] - 1 - y).min(TILE_CELLS)];
            let indices = match known.iter().find(|(c, _)| *c == cells) {
                Some((_, range)) => *range,
                None => {
                    let first = patterns.len() as u32;
                    push_cells(&mut patterns, cells, size[0]);
                    let range = [first, patterns.len() as u32 - first];
                    known.push((cells, range));
                    range
                }
            };
            let lo = [x.cast_signed(), y.cast_signed()];
            let instance = GridInstance { lo, step: 1, side: size[0], first: y * size[0] + x, tag: 0 };
            draws.push(GridDraw { pool: 0, indices, instance });
        }
    }
    (patterns, draws)
}

/// Two triangles a cell, cut from south-east to north-west as all methods cut them.
pub(crate) fn push_cells(indices: &mut Vec<u32>, cells: [u32; 2], row: u32) {
    for y in 0..cells[1] {
        for x in 0..cells[0] {
            let sw = y * row + x;
            indices.extend([sw, sw + 1, sw + row, sw + 1, sw + row + 1, sw + row]);
        }
    }
}

impl Rival for BruteForce {
    fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        camera.validate()?;
        let (_, uniform_bytes) = self.stage.look(camera, size_px);
        Ok(FrameUpload { uniform_bytes, ..std::mem::take(&mut self.start) })
    }

    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        let mut pass = self.stage.begin(encoder, target);
        let format = wgpu::IndexFormat::Uint32;
        self.draws.record(&mut pass, &self.pipeline, &self.vertices, &self.indices, format);
    }

    fn count(&self) -> Result<DrawCount, GpuError> {
        Ok(self.draws.count())
    }

    fn read_mesh(&self) -> Result<DrawnMesh, GpuError> {
        self.draws.read_mesh(&self.stage, &self.vertices, &self.indices, wgpu::IndexFormat::Uint32)
    }

    fn gpu_bytes(&self) -> u64 {
        self.vertices[0].size() + self.indices.size() + self.draws.gpu_bytes()
    }

    fn cpu_bytes(&self) -> u64 {
        size_of_val(&self.draws.draws[..]) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::tiles;

    #[test]
    fn tiles_cover_every_cell_once() {
        for size in [[2, 2], [257, 257], [258, 300], [600, 3]] {
            let (patterns, draws) = tiles(size);
            let mut seen = vec![0_u8; (size[0] * size[1]) as usize];
            for d in &draws {
                let [first, count] = d.indices.map(|v| v as usize);
                for t in patterns[first..first + count].chunks(3).step_by(2) {
                    seen[(t[0] + d.instance.first) as usize] += 1;
                }
            }
            let cells = seen.iter().filter(|c| **c == 1).count() as u32;
            assert_eq!(cells, (size[0] - 1) * (size[1] - 1), "{size:?}");
            assert!(seen.iter().all(|c| *c <= 1));
        }
    }
}
