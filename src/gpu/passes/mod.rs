//! One file a pass: its pipeline, what it binds and how much it dispatches.

pub(crate) mod bound_blocks;
pub(crate) mod compact_patches;
pub(crate) mod cull_quads;
pub(crate) mod displace_samples;
pub(crate) mod draw_terrain;
pub(crate) mod expand_patches;

use super::Buffers;
use super::shaders::{Ground, ShaderModuleSource};
use crate::clipmap::ClipmapShape;

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
}

/// Which variant of the shaders a scene needs; everything else is not compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Variant {
    pub ground: Ground,
    pub charts: u32,
    pub has_voids: bool,
    pub morph: bool,
    pub short: bool,
}

impl Variant {
    /// `plane` bindings on a plane, else `curved`.
    pub fn bindings(self, plane: &'static [u32], curved: &'static [u32]) -> &'static [u32] {
        if self.ground == Ground::Plane { plane } else { curved }
    }

    pub fn extent(self) -> super::Extent {
        super::Extent { ground: self.ground, charts: self.charts, short: self.short }
    }
}

/// What this frame asks of the passes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameWork {
    /// Refill strips in staging.
    pub strips: u32,
    /// Samples of the largest strip.
    pub largest_strip: u32,
    /// True when any window moved.
    pub shifted: bool,
    /// Levels of all charts.
    pub lanes: u32,
}

/// How much a compute pass dispatches.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Dispatch {
    /// Workgroups, from this frame's work; nothing is recorded when any is zero.
    Groups(fn(ClipmapShape, FrameWork) -> [u32; 3]),
    /// From the counters, at this byte offset.
    Indirect(u64),
}

/// A compute pass ready to record.
#[derive(Debug)]
pub(crate) struct ComputePass {
    pub stem: &'static str,
    pipeline: wgpu::ComputePipeline,
    bindings: &'static [u32],
    bind_group: wgpu::BindGroup,
    dispatch: Dispatch,
}

impl ComputePass {
    /// Compiles the pass with the given override constants and binds its buffers.
    pub fn new(
        device: &wgpu::Device,
        buffers: &Buffers,
        source: ShaderModuleSource,
        ground: Ground,
        bindings: &'static [u32],
        constants: &[(&str, f64)],
        dispatch: Dispatch,
    ) -> Self {
        let module = create_module(device, source, ground);
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(source.stem),
            layout: None,
            module: &module,
            entry_point: Some(source.stem),
            compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
            cache: None,
        });
        let layout = pipeline.get_bind_group_layout(0);
        let bind_group = bind(device, source.stem, &layout, buffers, bindings);
        Self { stem: source.stem, pipeline, bindings, bind_group, dispatch }
    }

    /// Binds other buffers, after they have grown.
    pub fn rebind(&mut self, device: &wgpu::Device, buffers: &Buffers) {
        let layout = self.pipeline.get_bind_group_layout(0);
        self.bind_group = bind(device, self.stem, &layout, buffers, self.bindings);
    }

    /// True when there is anything to do this frame.
    pub fn has_work(&self, shape: ClipmapShape, work: FrameWork) -> bool {
        match self.dispatch {
            Dispatch::Groups(groups) => !groups(shape, work).contains(&0),
            Dispatch::Indirect(_) => true,
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
    let entries: Vec<_> = bindings
        .iter()
        .map(|&number| wgpu::BindGroupEntry {
            binding: number,
            resource: buffer(buffers, number).as_entire_binding(),
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

pub(crate) fn flag(on: bool) -> f64 {
    f64::from(u8::from(on))
}

fn buffer(buffers: &Buffers, number: u32) -> &wgpu::Buffer {
    if let Some(curved) = &buffers.curved {
        match number {
            binding::CURVE => return &curved.curve,
            binding::CHARTS => return &curved.charts,
            binding::RECORDS => return &curved.records,
            binding::ANCHORS => return &curved.anchors,
            binding::SHADES => return &curved.shades,
            _ => {}
        }
    }
    match number {
        binding::FRAME => &buffers.frame,
        binding::CONTROL_POINTS => &buffers.control_points,
        binding::CONTROL_QUADS => &buffers.control_quads,
        binding::SAMPLES => &buffers.samples,
        binding::BLOCK_BOUNDS => &buffers.block_bounds,
        binding::PATCHES => &buffers.patches,
        binding::VISIBLE_SLOTS => &buffers.visible_slots,
        binding::COUNTERS => &buffers.counters,
        binding::VERTICES => &buffers.vertices,
        binding::INDICES => &buffers.indices,
        binding::QUAD_CORNERS => &buffers.quad_corners,
        _ => &buffers.staging,
    }
}
