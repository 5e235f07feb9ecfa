//! Draws the boxes of the visible patches as lines, over what the terrain's draw left.

use super::draw_terrain::DEPTH_FORMAT;
use super::spec::{Dispatch, EVERY_FRAME, PassSpec};
use super::{Variant, bind_view, binding, create_module, flag};
use crate::gpu::{Buffers, Counters, shaders};

const PLANE: [u32; 4] = [binding::FRAME, binding::BLOCK_BOUNDS, binding::PATCHES, binding::VISIBLE_SLOTS];
const CURVED: [u32; 3] = [binding::CURVE, binding::CHARTS, binding::ANCHORS];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |_| shaders::DRAW_BOUNDS,
    needed: |variant| variant.boxes,
    runs: EVERY_FRAME,
    constants: |variant| vec![("MORPH", flag(variant.morph))],
    bindings: |variant| variant.bindings(&PLANE, &CURVED),
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Draw,
};

/// Vertices of a box: two for each of its edges.
const BOX_VERTICES: u32 = 24;

/// The draw: one instance a visible patch.
#[derive(Debug)]
pub(crate) struct DrawBounds {
    pipeline: wgpu::RenderPipeline,
    bind_group: wgpu::BindGroup,
    bindings: Vec<u32>,
}

impl DrawBounds {
    pub fn new(
        device: &wgpu::Device,
        buffers: &Buffers,
        format: wgpu::TextureFormat,
        variant: Variant,
    ) -> Self {
        let module = create_module(device, (SPEC.source)(variant), variant.ground);
        let constants = (SPEC.constants)(variant);
        let options = wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("draw_bounds"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vs_bounds"),
                compilation_options: options.clone(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::LineList,
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(false),
                depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fs_bounds"),
                compilation_options: options,
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let bindings = (SPEC.bindings)(variant);
        let layout = pipeline.get_bind_group_layout(0);
        let bind_group = bind_view(device, "draw_bounds", &layout, buffers, &bindings);
        Self { pipeline, bind_group, bindings }
    }

    pub fn rebind(&mut self, device: &wgpu::Device, buffers: &Buffers) {
        let layout = self.pipeline.get_bind_group_layout(0);
        self.bind_group = bind_view(device, "draw_bounds", &layout, buffers, &self.bindings);
    }

    /// Puts the count of this frame's visible patches into the draw's arguments. Before the render pass.
    pub fn count(encoder: &mut wgpu::CommandEncoder, buffers: &Buffers) {
        let Some(arguments) = &buffers.box_arguments else { return };
        let visible = std::mem::offset_of!(Counters, expand_x) as u64;
        encoder.copy_buffer_to_buffer(&buffers.counters, visible, arguments, 4, 4);
    }

    /// What never changes of the arguments: vertices, then instances, first vertex and first instance.
    pub fn arguments() -> [u32; 4] {
        [BOX_VERTICES, 0, 0, 0]
    }

    pub fn record(&self, pass: &mut wgpu::RenderPass<'_>, buffers: &Buffers) {
        let Some(arguments) = &buffers.box_arguments else { return };
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        pass.draw_indirect(arguments, 0);
    }
}
