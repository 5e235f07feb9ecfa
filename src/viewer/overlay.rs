//! A picture of the panels, painted when they change and put over every frame: what panels cost is then little
//! more than copying the pixels they cover, also where a CPU draws them.

use egui::Rect;

use super::hud;

/// The picture, and where panels are in it.
pub struct Overlay {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    /// Where frames cannot be copied into.
    draw: Option<(wgpu::RenderPipeline, wgpu::BindGroup)>,
    /// Left, top, width and height in pixels.
    places: Vec<[u32; 4]>,
    size: [u32; 2],
}

impl Overlay {
    /// An empty one for frames of a size; `copies` when they take copies.
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat, size: [u32; 2], copies: bool) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("panels"),
            size: wgpu::Extent3d { width: size[0].max(1), height: size[1].max(1), depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let draw = (!copies).then(|| {
            let pipeline = pipeline(device, format);
            let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("panels"),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &[wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&view),
                }],
            });
            (pipeline, bind_group)
        });
        Self { texture, view, draw, places: Vec::new(), size }
    }

    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// To paint into; all of it is cleared to what lies behind panels first.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// What lies behind panels.
    pub fn clear(&self) -> wgpu::LoadOp<wgpu::Color> {
        let fill = hud::FILL;
        let [r, g, b] = if self.texture.format().is_srgb() {
            let [r, g, b, _] = egui::Rgba::from(fill).to_array();
            [r, g, b].map(f64::from)
        } else {
            [fill.r(), fill.g(), fill.b()].map(|v| f64::from(v) / 255.0)
        };
        wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 })
    }

    /// Takes the places that panels are in, in pixels.
    pub fn cover(&mut self, places: &[Rect]) {
        self.places = places.iter().filter_map(|r| whole(*r, self.size)).collect();
    }

    /// Puts the picture over a frame of its size.
    pub fn put(&self, encoder: &mut wgpu::CommandEncoder, frame: &wgpu::Texture, seen: &wgpu::TextureView) {
        let Some((pipeline, bind_group)) = &self.draw else {
            for [x, y, width, height] in &self.places {
                let at = |texture| wgpu::TexelCopyTextureInfo {
                    texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d { x: *x, y: *y, z: 0 },
                    aspect: wgpu::TextureAspect::All,
                };
                let size = wgpu::Extent3d { width: *width, height: *height, depth_or_array_layers: 1 };
                encoder.copy_texture_to_texture(at(&self.texture), at(frame), size);
            }
            return;
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("panels"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: seen,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, bind_group, &[]);
        for [x, y, width, height] in &self.places {
            pass.set_scissor_rect(*x, *y, *width, *height);
            pass.draw(0..3, 0..1);
        }
    }
}

fn pipeline(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("overlay"),
        source: wgpu::ShaderSource::Wgsl(include_str!("../../shaders/viewer/overlay.wgsl").into()),
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("overlay"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vs_overlay"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fs_overlay"),
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// The whole pixels of a picture that a place touches; none where it lies outside.
fn whole(place: Rect, size: [u32; 2]) -> Option<[u32; 4]> {
    let within = |v: f32, most: u32| v.clamp(0.0, most as f32) as u32;
    let [left, top] = [within(place.min.x.floor(), size[0]), within(place.min.y.floor(), size[1])];
    let [right, bottom] = [within(place.max.x.ceil(), size[0]), within(place.max.y.ceil(), size[1])];
    (left < right && top < bottom).then(|| [left, top, right - left, bottom - top])
}

#[cfg(test)]
mod tests {
    use egui::{Rect, pos2};

    use super::whole;

    #[test]
    fn places_are_whole_pixels_inside_the_picture() {
        let of = |x0, y0, x1, y1| whole(Rect::from_min_max(pos2(x0, y0), pos2(x1, y1)), [100, 50]);
        assert_eq!(of(1.5, 2.0, 3.5, 4.0), Some([1, 2, 3, 2]));
        assert_eq!(of(-9.0, -9.0, 900.0, 900.0), Some([0, 0, 100, 50]));
        assert_eq!(of(f32::NEG_INFINITY, 0.0, f32::INFINITY, 1.0), Some([0, 0, 100, 1]));
        for nothing in [of(3.0, 3.0, 3.0, 9.0), of(120.0, 0.0, 130.0, 9.0), of(5.0, 5.0, 2.0, 9.0)] {
            assert_eq!(nothing, None);
        }
        assert_eq!(of(f32::NAN, 0.0, 5.0, 5.0).map(|p| p[2] <= 100), Some(true));
    }
}
