//! The one indirect draw.

use super::spec::{Dispatch, EVERY_FRAME, PassSpec};
use super::{Variant, bind_view, binding, create_module, flag};
use crate::gpu::{Buffers, Counters, Ground, shaders};
use crate::renderer::Target;
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
        ColorMode::Error => 5.0,
        ColorMode::Refill => 6.0,
    }
}

/// What differs between the pipelines that draw terrain; ours and the rivals' have all else in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawing<'a> {
    /// Entry points.
    pub vertex: &'a str,
    pub fragment: &'a str,
    pub buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    /// Override constants.
    pub constants: &'a [(&'a str, f64)],
    /// Triangle strips with a restart index, not lists.
    pub strips: bool,
}

impl Default for Drawing<'_> {
    fn default() -> Self {
        Self { vertex: "vs_solid", fragment: "fs_solid", buffers: &[], constants: &[], strips: false }
    }
}

/// A pipeline that draws terrain.
pub(crate) fn terrain_pipeline(
    device: &wgpu::Device,
    format: wgpu::TextureFormat,
    module: &wgpu::ShaderModule,
    drawing: &Drawing<'_>,
) -> wgpu::RenderPipeline {
    let options = wgpu::PipelineCompilationOptions { constants: drawing.constants, ..Default::default() };
    let lists = wgpu::PrimitiveState::default();
    let strips = wgpu::PrimitiveState {
        topology: wgpu::PrimitiveTopology::TriangleStrip,
        strip_index_format: Some(wgpu::IndexFormat::Uint32),
        ..lists
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("draw_terrain"),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(drawing.vertex),
            compilation_options: options.clone(),
            buffers: drawing.buffers,
        },
        primitive: if drawing.strips { strips } else { lists },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(drawing.fragment),
            compilation_options: options,
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// A render pass over the target, cleared to `background` (linear RGB) and depth 0 where it asks for that.
pub(crate) fn begin_pass<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    target: Target<'_>,
    background: [f32; 3],
    timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
) -> wgpu::RenderPass<'e> {
    let [r, g, b] = background.map(f64::from);
    let color = wgpu::Color { r, g, b, a: 1.0 };
    let load = if target.clear { wgpu::LoadOp::Clear(color) } else { wgpu::LoadOp::Load };
    let depth_load = if target.clear { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load };
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("draw_terrain"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: target.color,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: target.depth,
            depth_ops: Some(wgpu::Operations { load: depth_load, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    if let Some([x, y, w, h]) = target.area {
        let [left, top, width, height] = [x, y, w, h].map(|v| v as f32);
        pass.set_viewport(left, top, width, height, 0.0, 1.0);
        pass.set_scissor_rect(x, y, w, h);
    }
    pass
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
        let wireframe = variant.wireframe;
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
        let drawing = if wireframe {
            Drawing { vertex: "vs_wire", fragment: "fs_wire", constants: &constants, ..Drawing::default() }
        } else {
            let buffers = &vertex_buffers[..if plane { 1 } else { 2 }];
            Drawing { buffers, constants: &constants, ..Drawing::default() }
        };
        let pipeline = terrain_pipeline(device, format, &module, &drawing);
        let bindings = (SPEC.bindings)(variant);
        let bind_group =
            bind_view(device, "draw_terrain", &pipeline.get_bind_group_layout(0), buffers, &bindings);
        Self { pipeline, bind_group, bindings, wireframe }
    }

    pub fn rebind(&mut self, device: &wgpu::Device, buffers: &Buffers) {
        let layout = self.pipeline.get_bind_group_layout(0);
        self.bind_group = bind_view(device, "draw_terrain", &layout, buffers, &self.bindings);
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
