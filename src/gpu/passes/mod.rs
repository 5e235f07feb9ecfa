//! One file a pass: its pipeline, what it binds and how much it dispatches.

pub(crate) mod bound_blocks;
pub(crate) mod compact_patches;
pub(crate) mod cull_quads;
pub(crate) mod displace_samples;
pub(crate) mod draw_bounds;
pub(crate) mod draw_terrain;
pub(crate) mod expand_leaves;
pub(crate) mod expand_patches;
pub(crate) mod grade_nodes;
pub(crate) mod mark_patches;
pub(crate) mod set_factors;
pub(crate) mod spec;
pub(crate) mod weigh_factors;
pub(crate) mod wish_factors;

use self::spec::{Dispatch, FrameWork, PassSpec};
use super::Buffers;
use super::shaders::{Ground, ShaderModuleSource};
use crate::clipmap::ClipmapShape;
use crate::scene::ColorMode;

/// Binding numbers: one a buffer in all shaders.
pub(crate) mod binding {
    pub const FRAME: u32 = 0;
    pub const CONTROL_POINTS: u32 = 1;
    pub const CONTROL_QUADS: u32 = 2;
    pub const SAMPLES: u32 = 3;
    pub const BLOCK_BOUNDS: u32 = 4;
    pub const PATCHES: u32 = 5;
    pub const VISIBLE_SLOTS: u32 = 6;
    pub const COUNTERS: u32 = 7;
    pub const VERTICES: u32 = 8;
    pub const INDICES: u32 = 9;
    pub const QUAD_CORNERS: u32 = 10;
    pub const STAGING: u32 = 11;
    pub const CURVE: u32 = 12;
    pub const CHARTS: u32 = 13;
    pub const ANCHORS: u32 = 14;
    pub const SHADES: u32 = 15;
    pub const RECORDS: u32 = 16;
    pub const CHOICE: u32 = 17;
    pub const DEVIATIONS: u32 = 18;
    pub const WISHES: u32 = 19;
    pub const WEIGHTS: u32 = 20;
    pub const HELD_BEFORE: u32 = 21;
    pub const GRADES: u32 = 22;
    pub const FRESH: u32 = 23;
    pub const LEAVES: u32 = 24;
}

/// Which variant of the shaders a scene needs; everything else is not compiled, bound, allocated or run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// What samples are.
    pub ground: Ground,
    /// Charts of the base surface.
    pub charts: u32,
    /// Triangles that touch a void sample are collapsed.
    pub has_voids: bool,
    /// Vertices near a level's perimeter move towards the coarser level.
    pub morph: bool,
    /// Samples travel as two bytes.
    pub short: bool,
    /// Patches out of view are not drawn.
    pub cull: bool,
    /// Patches behind the horizon are not drawn.
    pub horizon: bool,
    /// Blocks of samples have bounds.
    pub bounds: bool,
    /// Vertices have normals; always on a curved surface.
    pub normals: bool,
    /// Shaded colours fade into fog.
    pub fog: bool,
    /// Patches leave nodes out by what that deviates by, not all alike.
    pub by_error: bool,
    /// The threshold of that is found under a budget of triangles.
    pub budget: bool,
    /// Triangle edges are drawn.
    pub wireframe: bool,
    /// Bounds of visible patches are drawn.
    pub boxes: bool,
    /// Colouring.
    pub color: ColorMode,
    /// Cells of a block of the base surface, a power of two.
    pub block_cells: u32,
}

impl Variant {
    /// `plane` bindings, on a curved surface `curved` besides.
    fn bindings(self, plane: &[u32], curved: &[u32]) -> Vec<u32> {
        let more = if self.ground == Ground::Plane { &[] } else { curved };
        [plane, more].concat()
    }

    /// What the sizes of buffers follow from.
    #[must_use]
    pub fn extent(self) -> super::Extent {
        super::Extent {
            ground: self.ground,
            charts: self.charts,
            short: self.short,
            bounds: self.bounds,
            deviations: self.by_error || self.color == ColorMode::Error,
            by_error: self.by_error,
            refill: self.color == ColorMode::Refill,
            boxes: self.boxes,
            block_cells: self.block_cells,
        }
    }
}

/// A compute pass ready to record.
#[derive(Debug)]
pub(crate) struct ComputePass {
    pub stem: &'static str,
    pipeline: wgpu::ComputePipeline,
    bindings: Vec<u32>,
    bind_group: wgpu::BindGroup,
    dispatch: Dispatch,
}

impl ComputePass {
    /// Compiles the pass for a variant and binds its buffers.
    pub fn new(device: &wgpu::Device, buffers: &Buffers, spec: &PassSpec, variant: Variant) -> Self {
        let source = (spec.source)(variant);
        let bindings = (spec.bindings)(variant);
        let constants = (spec.constants)(variant);
        let module = create_module(device, source, variant.ground);
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(source.stem),
            layout: None,
            module: &module,
            entry_point: Some(source.stem),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                // The passes write before they read; on a software device the zeros cost more than the work.
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        });
        let layout = pipeline.get_bind_group_layout(0);
        let bind_group = bind(device, source.stem, &layout, buffers, &bindings);
        Self { stem: source.stem, pipeline, bindings, bind_group, dispatch: spec.dispatch }
    }

    /// Binds other buffers, after they have grown.
    pub fn rebind(&mut self, device: &wgpu::Device, buffers: &Buffers) {
        let layout = self.pipeline.get_bind_group_layout(0);
        self.bind_group = bind(device, self.stem, &layout, buffers, &self.bindings);
    }

    /// True when there is anything to do this frame.
    pub fn has_work(&self, shape: ClipmapShape, work: FrameWork) -> bool {
        match self.dispatch {
            Dispatch::Groups(groups) => !groups(shape, work).contains(&0),
            Dispatch::Indirect(_) | Dispatch::Draw => true,
        }
    }

    /// Records the pass.
    pub fn record(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        shape: ClipmapShape,
        work: FrameWork,
        counters: &wgpu::Buffer,
    ) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        match self.dispatch {
            Dispatch::Groups(groups) => {
                let [x, y, z] = groups(shape, work);
                pass.dispatch_workgroups(x, y, z);
            }
            Dispatch::Indirect(offset) => pass.dispatch_workgroups_indirect(counters, offset),
            Dispatch::Draw => {}
        }
    }
}

pub(crate) fn create_module(
    device: &wgpu::Device,
    source: ShaderModuleSource,
    ground: Ground,
) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(source.stem),
        source: wgpu::ShaderSource::Wgsl(source.text(ground).into()),
    })
}

pub(crate) fn bind(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    buffers: &Buffers,
    bindings: &[u32],
) -> wgpu::BindGroup {
    bind_with(device, label, layout, buffers, (bindings, &buffers.frame))
}

/// As [`bind`], for what is drawn: its frame is that of the camera that looks, which culling need not follow.
pub(crate) fn bind_view(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    buffers: &Buffers,
    bindings: &[u32],
) -> wgpu::BindGroup {
    let frame = buffers.view_frame.as_ref().unwrap_or(&buffers.frame);
    bind_with(device, label, layout, buffers, (bindings, frame))
}

fn bind_with(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    buffers: &Buffers,
    (bindings, frame): (&[u32], &wgpu::Buffer),
) -> wgpu::BindGroup {
    let entries: Vec<_> = bindings
        .iter()
        .filter_map(|&number| {
            let own = if number == binding::FRAME { frame } else { buffer(buffers, number)? };
            Some(wgpu::BindGroupEntry { binding: number, resource: own.as_entire_binding() })
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

pub(crate) fn flag(on: bool) -> f64 {
    f64::from(u8::from(on))
}

fn buffer(buffers: &Buffers, number: u32) -> Option<&wgpu::Buffer> {
    let name = spec::binding_name(number);
    buffers.all().into_iter().find(|(n, _)| *n == name).map(|(_, b)| b)
}
