//! Ours, behind the trait of the rivals: as it is, and with the expansion moved into the vertex stage.

use super::{DrawCount, DrawnMesh, Lab, Rival, Unfit};
use crate::camera::Camera;
use crate::clipmap::Rect;
use crate::gpu::passes::draw_terrain::{Drawing, SPEC, begin_pass, terrain_pipeline};
use crate::gpu::passes::{create_module, flag};
use crate::gpu::{Counters, GpuError, Ground, PatchRecord, shaders};
use crate::measure::FrameUpload;
use crate::plan::variant;
use crate::quads::{BlockKind, OuterSpan, PATCH_CELLS, Patch};
use crate::reference::{Placement, cell_triangles};
use crate::renderer::{RenderError, Renderer, Target};
use crate::scene::Scene;

/// A renderer for a rival's scene; its terrain must be whole planes for the twins that read meshes back.
pub(super) fn renderer(lab: &Lab, scene: &Scene) -> Result<Renderer, Unfit> {
    let made = Renderer::new(&lab.device, &lab.queue, lab.format, &lab.terrain, scene);
    made.map_err(|e| Unfit(e.to_string()))
}

/// Ours.
pub(crate) struct Tessellated {
    renderer: Renderer,
}

impl Tessellated {
    pub fn new(lab: &Lab, scene: &Scene) -> Result<Self, Unfit> {
        Ok(Self { renderer: renderer(lab, scene)? })
    }
}

impl Rival for Tessellated {
    fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        self.renderer.prepare(camera, size_px)
    }

    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        self.renderer.record(encoder, target);
    }

    fn count(&self) -> Result<DrawCount, GpuError> {
        let counters = self.renderer.read_counters()?;
        whole(&counters)?;
        Ok(DrawCount { triangles: u64::from(counters.index_count / 3), draw_calls: 1 })
    }

    fn read_mesh(&self) -> Result<DrawnMesh, GpuError> {
        let mesh = self.renderer.read_mesh()?;
        Ok(DrawnMesh {
            anchor_m: mesh.anchor_m,
            positions: mesh.vertices.iter().map(|v| v.position).collect(),
            triangles: mesh.triangles,
        })
    }

    fn gpu_bytes(&self) -> u64 {
        self.renderer.gpu_bytes()
    }

    fn cpu_bytes(&self) -> u64 {
        0
    }
}

/// A frame from which patches were dropped must not be measured.
fn whole(counters: &Counters) -> Result<(), GpuError> {
    match counters.patches_dropped {
        0 => Ok(()),
        dropped => Err(GpuError::Readback { reason: format!("{dropped} patches found no room") }),
    }
}

/// Vertices a row of the pattern.
const SIDE: u32 = PATCH_CELLS + 1;

/// The pattern of `vs_expand`: a patch whose sides are all divided.
fn pattern() -> Vec<u16> {
    let cells = PATCH_CELLS as i32;
    let divided = OuterSpan { from: 0, to: PATCH_CELLS, log2: 1 };
    let patch = Patch {
        chart: 0,
        level: 0,
        kind: BlockKind::M,
        rect: Rect { lo: [0, 0], hi: [cells, cells] },
        outer: [divided; 4],
        by_error: None,
    };
    let all = (0..PATCH_CELLS).flat_map(|y| (0..PATCH_CELLS).map(move |x| [x, y]));
    // At most 17 x 17 + 64 vertices.
    all.flat_map(|cell| cell_triangles(&patch, cell)).flatten().map(|ix| ix as u16).collect()
}

/// Of the pattern's cells along an axis a patch of fewer has the first ones and the last one; of a single one
/// that is the last, or the first when the low side is divided.
fn squeezed(corner: u32, cells: u32, low: bool) -> u32 {
    match (corner, cells) {
        (_, 1) if low => corner.min(1),
        (PATCH_CELLS, _) => cells,
        _ => corner.min(cells - 1),
    }
}

/// The cell of the patch that a cell of the pattern is; none where it has no width.
fn cell_of(along: u32, cells: u32, low: bool) -> Option<u32> {
    match along {
        _ if cells == 1 && low => (along == 0).then_some(0),
        _ if along == PATCH_CELLS - 1 => Some(cells - 1),
        _ => (along + 1 < cells).then_some(along),
    }
}

/// Twin of `vs_expand`: the base sample of a vertex of the pattern.
fn pattern_base(placement: &Placement, patch: &Patch, ix: u32) -> [i32; 2] {
    let cells = patch.cells();
    let [south, _, west, _] = patch.outer.map(|span| span != OuterSpan::default());
    let low = [west, south];
    let grid = SIDE * SIDE;
    let (mut corner, mut step) = ([ix % SIDE, ix / SIDE], [0, 0]);
    if ix >= grid {
        let (side, along) = ((ix - grid) / PATCH_CELLS, (ix - grid) % PATCH_CELLS);
        let axis = usize::from(side >= 2);
        let cell = cell_of(along, cells[axis], low[axis]);
        let divided = cell.is_some_and(|c| patch.outer[side as usize].segments(c) == 2);
        corner = [along + u32::from(!divided && side < 2 && along == 0); 2];
        corner[1 - axis] = if side % 2 == 1 { PATCH_CELLS } else { 0 };
        step[axis] = if divided { 1 << patch.level >> 1 } else { 0 };
    }
    let node = [0, 1].map(|a| patch.rect.lo[a] + squeezed(corner[a], cells[a], low[a]).cast_signed());
    let base = placement.windows.lattice.base(patch.level, node);
    [base[0] + step[0], base[1] + step[1]]
}

/// Ours without the expansion's own pass: each patch is an instance of one pattern, and its vertices are made
/// where they are drawn.
pub(crate) struct VertexStage {
    renderer: Renderer,
    pipeline: wgpu::RenderPipeline,
    bind_group: wgpu::BindGroup,
    pattern: wgpu::Buffer,
    indices: Vec<u16>,
    /// Arguments of the draw; the count of instances is copied from the counters.
    arguments: wgpu::Buffer,
    queue: wgpu::Queue,
    background: [f32; 3],
    sent: bool,
}

impl VertexStage {
    pub fn new(lab: &Lab, scene: &Scene) -> Result<Self, Unfit> {
        if lab.terrain.curved.is_some() {
            return Err(Unfit(format!(
                "is made for planes only, not base {}: give --base plane",
                lab.terrain.base()
            )));
        }
        if lab.terrain.source.has_voids() {
            return Err(Unfit("has no rule for voids: fill them (--nodata fill)".into()));
        }
        let renderer = renderer(lab, scene)?;
        let device = &lab.device;
        let indices = pattern();
        let make = |label, size: usize, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let pattern = make("pattern", size_of_val(&indices[..]), wgpu::BufferUsages::INDEX);
        let arguments = make("arguments", 20, wgpu::BufferUsages::INDIRECT);
        let variant = variant(scene, &lab.terrain);
        let mut constants = (SPEC.constants)(variant);
        constants.extend([("MORPH", flag(scene.morph)), ("NORMALS", flag(variant.normals))]);
        let module = create_module(device, shaders::RIVAL_CLIPMAPS, Ground::Plane);
        let drawing = Drawing { vertex: "vs_expand", constants: &constants, ..Drawing::default() };
        let pipeline = terrain_pipeline(device, lab.format, &module, &drawing);
        let buffers = renderer.buffers();
        let bound =
            [(0, &buffers.frame), (3, &buffers.samples), (5, &buffers.patches), (6, &buffers.visible_slots)];
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("vs_expand"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &bound.map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            }),
        });
        Ok(Self {
            renderer,
            pipeline,
            bind_group,
            pattern,
            indices,
            arguments,
            queue: lab.queue.clone(),
            background: scene.background,
            sent: false,
        })
    }
}

impl Rival for VertexStage {
    fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        let mut upload = self.renderer.prepare(camera, size_px)?;
        if !self.sent {
            let arguments = [self.indices.len() as u32, 0, 0, 0, 0];
            self.queue.write_buffer(&self.arguments, 0, bytemuck::cast_slice(&arguments));
            self.queue.write_buffer(&self.pattern, 0, bytemuck::cast_slice(&self.indices));
            upload.index_bytes += size_of_val(&self.indices[..]) as u64;
            self.sent = true;
        }
        Ok(upload)
    }

    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        self.renderer.record_passes(encoder, |stem| stem != "expand_patches");
        let visible = std::mem::offset_of!(Counters, expand_x) as u64;
        encoder.copy_buffer_to_buffer(&self.renderer.buffers().counters, visible, &self.arguments, 4, 4);
        let mut pass = begin_pass(encoder, target, self.background, None);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        pass.set_index_buffer(self.pattern.slice(..), wgpu::IndexFormat::Uint16);
        pass.draw_indexed_indirect(&self.arguments, 0);
    }

    fn count(&self) -> Result<DrawCount, GpuError> {
        let counters = self.renderer.read_counters()?;
        whole(&counters)?;
        let a_patch = self.indices.len() as u64 / 3;
        Ok(DrawCount { triangles: u64::from(counters.expand_x) * a_patch, draw_calls: 1 })
    }

    fn read_mesh(&self) -> Result<DrawnMesh, GpuError> {
        let nothing = || GpuError::Readback { reason: "no frame was drawn".into() };
        let placement = self.renderer.placement().ok_or_else(nothing)?;
        let anchor = self.renderer.anchor_m().ok_or_else(nothing)?;
        let mut mesh = DrawnMesh { anchor_m: anchor.to_array(), ..DrawnMesh::default() };
        let last = SIDE * SIDE + 4 * PATCH_CELLS;
        let records: Vec<PatchRecord> = self.renderer.read_visible_patches()?;
        for record in records {
            let patch = record.patch();
            let first = mesh.positions.len() as u32;
            mesh.positions.extend((0..last).map(|ix| {
                let base = pattern_base(placement, &patch, ix);
                placement.position(self.renderer.source().as_ref(), patch.level, base).0
            }));
            let triangles = self.indices.chunks_exact(3);
            mesh.triangles.extend(triangles.map(|t| [t[0], t[1], t[2]].map(|ix| first + u32::from(ix))));
        }
        Ok(mesh)
    }

    fn gpu_bytes(&self) -> u64 {
        // The expansion's own buffers are allocated with the rest, but this method has no use for them.
        let buffers = self.renderer.buffers();
        let unused = buffers.vertices.size() + buffers.indices.size();
        self.renderer.gpu_bytes() - unused + self.pattern.size() + self.arguments.size()
    }

    fn cpu_bytes(&self) -> u64 {
        0
    }
}
