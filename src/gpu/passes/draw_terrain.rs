//! The one indirect draw.

use super::spec::{Dispatch, EVERY_FRAME, PassSpec};
use super::{Variant, bind, binding, create_module, flag};
use crate::gpu::{Buffers, Counters, Ground, shaders};
use crate::scene::ColorMode;

/// Depth format: reversed, so that 32 bits of float keep their precision in the distance.
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |_| shaders::DRAW_TERRAIN,
    needed: |_| true,
    runs: EVERY_FRAME,
    constants: |variant| vec![("COLOR_MODE", mode(variant.color)), ("FOG", flag(variant.fog))],
    bindings: |variant| match (variant.wireframe, variant.ground == Ground::Plane) {
        (false, _) => vec![binding::FRAME],
        (true, true) => vec![binding::FRAME, binding::VERTICES, binding::INDICES],
        (true, false) => vec![binding::FRAME, binding::VERTICES, binding::INDICES, binding::SHADES],
    },
    inputs: |variant| match (variant.wireframe, variant.ground == Ground::Plane) {
        (true, _) => Vec::new(),
        (false, true) => vec!["vertices", "indices"],
        (false, false) => vec!["vertices", "indices", "shades"],
    },
    dispatch: Dispatch::Draw,
};

/// The number of a colouring in the shader.
fn mode(color: ColorMode) -> f64 {
    match color {
        ColorMode::Shaded => 0.0,
        ColorMode::Levels => 1.0,
        ColorMode::Blocks => 2.0,
        ColorMode::Elevation => 3.0,
        ColorMode::Slope => 4.0,
    }
}

/// The draw of a scene: solid from vertex and index buffers, or wireframe by vertex pulling.
#[derive(Debug)]
pub(crate) struct DrawTerrain {
    pipeline: wgpu::RenderPipeline,
    bind_group: wgpu::BindGroup,
    bindings: Vec<u32>,
    wireframe: bool,
}

impl DrawTerrain {
    pub fn new(
        device: &wgpu::Device,
        buffers: &Buffers,
        format: wgpu::TextureFormat,
        variant: Variant,
    ) -> Self {
        let module = create_module(device, (SPEC.source)(variant), variant.ground);
        let plane = variant.ground == Ground::Plane;
        let constants = (SPEC.constants)(variant);
        let options = wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
        let wireframe = variant.wireframe;
        let (vertex_entry, fragment_entry) =
            if wireframe { ("vs_wire", "fs_wire") } else { ("vs_solid", "fs_solid") };
        let vertex_layout = wgpu::VertexBufferLayout {
            array_stride: 16,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Uint32],
        };
        let shade_layout = wgpu::VertexBufferLayout {
            array_stride: 4,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![2 => Uint32],
        };
        let vertex_buffers = [Some(vertex_layout), Some(shade_layout)];
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("draw_terrain"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(vertex_entry),
                compilation_options: options.clone(),
                buffers: if wireframe { &[] } else { &vertex_buffers[..if plane { 1 } else { 2 }] },
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(fragment_entry),
                compilation_options: options,
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let bindings = (SPEC.bindings)(variant);
        let bind_group = bind(device, "draw_terrain", &pipeline.get_bind_group_layout(0), buffers, &bindings);
        Self { pipeline, bind_group, bindings, wireframe }
    }

    pub fn rebind(&mut self, device: &wgpu::Device, buffers: &Buffers) {
        let layout = self.pipeline.get_bind_group_layout(0);
        self.bind_group = bind(device, "draw_terrain", &layout, buffers, &self.bindings);
    }

    pub fn record(&self, pass: &mut wgpu::RenderPass<'_>, buffers: &Buffers) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        if self.wireframe {
            let offset = std::mem::offset_of!(Counters, wire_vertex_count) as u64;
            pass.draw_indirect(&buffers.counters, offset);
        } else {
            pass.set_vertex_buffer(0, buffers.vertices.slice(..));
            if let Some(curved) = &buffers.curved {
                pass.set_vertex_buffer(1, curved.shades.slice(..));
            }
            pass.set_index_buffer(buffers.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed_indirect(&buffers.counters, 0);
        }
    }

    /// The same draw from other buffers, `index_count` indices: the static rival of the benches.
    pub fn record_static(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        vertices: &wgpu::Buffer,
        indices: &wgpu::Buffer,
        index_count: u32,
    ) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..index_count, 0, 0..1);
    }
}
