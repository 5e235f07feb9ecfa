//! GPU-based geometry clipmaps: a few static footprints, set down wherever a block is in view, heights
//! fetched in the vertex stage.
//!
//! Asirvatham and Hoppe, *Terrain Rendering Using GPU-Based Geometry Clipmaps*, GPU Gems 2, chapter 2, 2005,
//! as Fruehstueck 2008, section 2.3.1 describes it: 12 m x m blocks a level, ring fix-ups, an interior trim, a
//! ring of triangles without area along the perimeter, the transition morph, and culling by block on the CPU.
//! Blocks of the same footprint are instances of one draw, which the original (one draw a block) had no way
//! to say.

mod pieces;

use wgpu::BufferUsages as U;

use self::pieces::{Piece, Pieces, pieces};
use super::tessellated::renderer;
use super::{DrawCount, DrawnMesh, Ground, Lab, Rival, Unfit};
use crate::camera::Camera;
use crate::clipmap::{Rect, Windows};
use crate::gpu::passes::draw_terrain::{Drawing, SPEC, begin_pass, terrain_pipeline};
use crate::gpu::passes::{create_module, flag};
use crate::gpu::{GpuError, Ground as Samples, shaders};
use crate::measure::FrameUpload;
use crate::plan::variant;
use crate::quads::{control_points, control_quads};
use crate::reference::Placement;
use crate::renderer::{RenderError, Renderer, Target};
use crate::scene::Scene;

/// Where a footprint is set down (`vs_block`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Block {
    /// Low corner in the level's lattice.
    lo: [i32; 2],
    /// Level << 24 | kind << 29.
    tag: u32,
}

pub(crate) struct FootprintClipmap {
    /// Its windows, samples and uploads are those of ours; its passes are not.
    renderer: Renderer,
    ground: std::sync::Arc<Ground>,
    cull: bool,
    background: [f32; 3],
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    bind_group: wgpu::BindGroup,
    pieces: Pieces,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    instances: wgpu::Buffer,
    /// Blocks in view by piece.
    blocks: Vec<Vec<Block>>,
    /// Sent when it was made; told with the first frame.
    start: FrameUpload,
}

impl FootprintClipmap {
    pub fn new(lab: &Lab, scene: &Scene) -> Result<Self, Unfit> {
        let ground = lab.ground()?.clone();
        // Geomorph is the method's own; our culling is left out.
        let ours = Scene { morph: true, cull: false, ..scene.clone() };
        let renderer = renderer(lab, &ours)?;
        let pieces = pieces(renderer.shape());
        let device = &lab.device;
        let make = |label, bytes: usize, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: (bytes as u64).next_multiple_of(4),
                usage: usage | U::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let vertices = make("footprints", size_of_val(&pieces.vertices[..]), U::VERTEX);
        let indices = make("footprint indices", size_of_val(&pieces.indices[..]), U::INDEX);
        let most_blocks = 32 * renderer.shape().levels() as usize;
        let instances = make("blocks", most_blocks * size_of::<Block>(), U::VERTEX);
        lab.queue.write_buffer(&vertices, 0, bytemuck::cast_slice(&pieces.vertices));
        lab.queue.write_buffer(&indices, 0, bytemuck::cast_slice(&pieces.indices));
        let variant = variant(&ours, &lab.terrain);
        let mut constants = (SPEC.constants)(variant);
        constants.extend([("MORPH", 1.0), ("NORMALS", flag(variant.normals))]);
        let layouts = [
            Some(wgpu::VertexBufferLayout {
                array_stride: 4,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Uint16x2],
            }),
            Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Block>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &wgpu::vertex_attr_array![1 => Sint32x2, 2 => Uint32],
            }),
        ];
        let module = create_module(device, shaders::RIVAL_CLIPMAPS, Samples::Plane);
        let drawing =
            Drawing { vertex: "vs_block", buffers: &layouts, constants: &constants, ..Drawing::default() };
        let pipeline = terrain_pipeline(device, lab.format, &module, &drawing);
        let buffers = renderer.buffers();
        let bound = [(0, &buffers.frame), (3, &buffers.samples)];
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("vs_block"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &bound.map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            }),
        });
        let start = FrameUpload {
            vertices: pieces.vertices.len() as u64,
            vertex_bytes: size_of_val(&pieces.vertices[..]) as u64,
            index_bytes: size_of_val(&pieces.indices[..]) as u64,
            ..FrameUpload::default()
        };
        let blocks = vec![Vec::new(); pieces.all.len()];
        Ok(Self {
            renderer,
            ground,
            cull: scene.cull,
            background: scene.background,
            queue: lab.queue.clone(),
            pipeline,
            bind_group,
            pieces,
            vertices,
            indices,
            instances,
            blocks,
            start,
        })
    }

    /// The blocks in view, and the perimeters of levels in view that have a coarser one around them.
    fn choose(&mut self) {
        self.blocks.iter_mut().for_each(Vec::clear);
        let Some(placement) = self.renderer.placement() else { return };
        let windows = &placement.windows;
        let points = control_points(windows.shape);
        let place = |level: u32, lo, hi| self.sees(placement, windows, level, level_rect(level, lo, hi));
        let mut chosen: Vec<(usize, Block)> = Vec::new();
        for level in windows.finest..windows.shape.levels() {
            let origin = windows.origins[level as usize];
            let fills = level == windows.finest;
            for quad in control_quads(windows.shape, windows.l_position_of_data(level)) {
                let at = |k: usize| points[quad.corners[k] as usize].map(u32::cast_signed);
                let (lo, hi) = (at(0), at(3));
                for (piece, rect) in self.pieces.cover(quad.kind, Rect { lo, hi }, fills) {
                    let corner = [0, 1].map(|a| origin[a] + rect.lo[a]);
                    let end = [0, 1].map(|a| origin[a] + rect.hi[a]);
                    if place(level, corner, end) {
                        let tag = level << 24 | (quad.kind as u32) << 29;
                        chosen.push((piece, Block { lo: corner, tag }));
                    }
                }
            }
            let window = windows.window(level);
            if level + 1 < windows.shape.levels() && place(level, window.lo, window.hi) {
                chosen.push((self.pieces.ring, Block { lo: origin, tag: level << 24 }));
            }
        }
        for (piece, block) in chosen {
            self.blocks[piece].push(block);
        }
    }

    /// Whether base samples `rect` may be in view. Outside the data there is nothing to see.
    fn sees(&self, placement: &Placement, windows: &Windows, level: u32, rect: Rect) -> bool {
        let rect = rect.intersect(windows.lattice.domain());
        if !rect.has_area() {
            return false;
        }
        if !self.cull {
            return true;
        }
        let Some(frustum) = self.renderer.frustum() else { return true };
        // Morphed heights lie between those of samples around.
        let around = 2 << level;
        let [low, high] = self.ground.range_over(rect.lo.map(|v| v - around), rect.hi.map(|v| v + around));
        let [x0, y0] = placement.ground(rect.lo);
        let [x1, y1] = placement.ground(rect.hi);
        let up = |h: f32| h - placement.anchor_height_m;
        frustum.planes.iter().all(|p| {
            let far = |a: usize, lo: f32, hi: f32| if p[a] >= 0.0 { p[a] * hi } else { p[a] * lo };
            far(0, x0, x1) + far(1, y0, y1) + far(2, up(low), up(high)) + p[3] >= 0.0
        })
    }
}

/// Base samples under nodes `lo..=hi` of a level.
fn level_rect(level: u32, lo: [i32; 2], hi: [i32; 2]) -> Rect {
    Rect { lo: lo.map(|v| v << level), hi: hi.map(|v| v << level) }
}

impl Rival for FootprintClipmap {
    fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        let ours = self.renderer.prepare(camera, size_px)?;
        self.choose();
        let all: Vec<Block> = self.blocks.iter().flatten().copied().collect();
        self.queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&all));
        let start = std::mem::take(&mut self.start);
        Ok(FrameUpload {
            // The strips' heads and its own blocks; our control quads it has no use for.
            control_bytes: ours.strip_bytes + size_of_val(&all[..]) as u64,
            control_points: 0,
            vertices: start.vertices,
            vertex_bytes: start.vertex_bytes,
            index_bytes: start.index_bytes,
            ..ours
        })
    }

    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        self.renderer.record_passes(encoder, |stem| stem == "displace_samples");
        let mut pass = begin_pass(encoder, target, self.background, None);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_vertex_buffer(1, self.instances.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint16);
        let mut first = 0;
        for (piece, blocks) in self.pieces.all.iter().zip(&self.blocks) {
            let end = first + blocks.len() as u32;
            if end > first {
                let [from, count] = piece.indices;
                pass.draw_indexed(from..from + count, piece.first_vertex.cast_signed(), first..end);
            }
            first = end;
        }
    }

    fn count(&self) -> Result<DrawCount, GpuError> {
        let drawn = self.pieces.all.iter().zip(&self.blocks).filter(|(_, b)| !b.is_empty());
        let mut count = DrawCount::default();
        for (piece, blocks) in drawn {
            count.triangles += u64::from(piece.indices[1] / 3) * blocks.len() as u64;
            count.draw_calls += 1;
        }
        Ok(count)
    }

    fn read_mesh(&self) -> Result<DrawnMesh, GpuError> {
        let nothing = || GpuError::Readback { reason: "no frame was drawn".into() };
        let placement = self.renderer.placement().ok_or_else(nothing)?;
        let anchor = self.renderer.anchor_m().ok_or_else(nothing)?;
        let source = self.renderer.source();
        let mut mesh = DrawnMesh { anchor_m: anchor.to_array(), ..DrawnMesh::default() };
        for (piece, blocks) in self.pieces.all.iter().zip(&self.blocks) {
            for block in blocks {
                self.push_block(&mut mesh, placement, source.as_ref(), piece, *block);
            }
        }
        Ok(mesh)
    }

    fn gpu_bytes(&self) -> u64 {
        let shared = self.renderer.buffers();
        shared.frame.size()
            + shared.samples.size()
            + shared.staging.size()
            + self.vertices.size()
            + self.indices.size()
            + self.instances.size()
    }

    fn cpu_bytes(&self) -> u64 {
        self.ground.range_bytes()
    }
}

impl FootprintClipmap {
    /// Twin of `vs_block` for all vertices of a block.
    fn push_block(
        &self,
        mesh: &mut DrawnMesh,
        placement: &Placement,
        source: &dyn crate::pyramid::SampleSource,
        piece: &Piece,
        block: Block,
    ) {
        let level = (block.tag >> 24) & 31;
        let area = placement.windows.loaded(level);
        let first = mesh.positions.len() as u32;
        let vertices = piece.first_vertex as usize..(piece.first_vertex + piece.vertices) as usize;
        mesh.positions.extend(self.pieces.vertices[vertices].iter().map(|cell| {
            let node = [0, 1].map(|a| (block.lo[a] + i32::from(cell[a])).clamp(area.lo[a], area.hi[a]));
            let base = placement.windows.lattice.base(level, node);
            let [x, y] = placement.ground(base);
            [x, y, placement.height(source, level, base) - placement.anchor_height_m]
        }));
        let [from, count] = piece.indices.map(|v| v as usize);
        let triangles = self.pieces.indices[from..from + count].chunks_exact(3);
        mesh.triangles.extend(triangles.map(|t| [t[0], t[1], t[2]].map(|ix| first + u32::from(ix))));
    }
}
