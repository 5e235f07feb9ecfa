//! A colour and depth target without a window.

use super::device::GpuError;
use super::passes::draw_terrain::DEPTH_FORMAT;
use super::readback::mapped;

/// Colour and depth textures of one size.
#[derive(Debug)]
pub struct Offscreen {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Colour view, of [`Offscreen::FORMAT`] where nothing else was asked for.
    pub color: wgpu::TextureView,
    /// Depth view, `Depth32Float`, reversed.
    pub depth: wgpu::TextureView,
    texture: wgpu::Texture,
    depth_texture: wgpu::Texture,
}

impl Offscreen {
    /// Colour format: 8 bits a channel, sRGB.
    pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

    /// Allocates the targets.
    ///
    /// # Errors
    /// When a side is zero or larger than the device allows.
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Result<Self, GpuError> {
        Self::with_format(device, size, Self::FORMAT, None)
    }

    /// As [`Offscreen::new`], with another colour format of 8 bits a channel, red or blue first, and perhaps one that
    /// it can be seen as besides ([`Offscreen::seen_as`]), which not every device allows.
    ///
    /// # Errors
    /// As [`Offscreen::new`].
    pub fn with_format(
        device: &wgpu::Device,
        size: [u32; 2],
        format: wgpu::TextureFormat,
        seen_as: Option<wgpu::TextureFormat>,
    ) -> Result<Self, GpuError> {
        let most = device.limits().max_texture_dimension_2d;
        let bytes = u64::from(size[0] * 4).next_multiple_of(256) * u64::from(size[1]);
        if size.contains(&0) || size[0].max(size[1]) > most || bytes > device.limits().max_buffer_size {
            return Err(GpuError::PictureSize { width: size[0], height: size[1], most });
        }
        let seen_as: Vec<wgpu::TextureFormat> = seen_as.into_iter().collect();
        let make = |label, format, usage, view_formats: &[wgpu::TextureFormat]| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats,
            })
        };
        let texture = make(
            "offscreen color",
            format,
            wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::COPY_DST,
            &seen_as,
        );
        let depth = make("offscreen depth", DEPTH_FORMAT, wgpu::TextureUsages::COPY_SRC, &[]);
        Ok(Self {
            size,
            color: texture.create_view(&wgpu::TextureViewDescriptor::default()),
            depth: depth.create_view(&wgpu::TextureViewDescriptor::default()),
            texture,
            depth_texture: depth,
        })
    }

    /// The colour texture, which takes copies.
    #[must_use]
    pub fn texture(&self) -> &wgpu::Texture {
        &self.texture
    }

    /// The colour texture seen as another format: its own, or that without sRGB's curve.
    #[must_use]
    pub fn seen_as(&self, format: wgpu::TextureFormat) -> wgpu::TextureView {
        let seen = wgpu::TextureViewDescriptor { format: Some(format), ..Default::default() };
        self.texture.create_view(&seen)
    }

    /// The picture as RGBA bytes (sRGB), rows from the top, whatever the format's order.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read_rgba(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<u8>, GpuError> {
        let mut bytes = self.read(device, queue, &self.texture)?;
        if matches!(
            self.texture.format(),
            wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Bgra8UnormSrgb
        ) {
            bytes.chunks_exact_mut(4).for_each(|p| p.swap(0, 2));
        }
        Ok(bytes)
    }

    /// The depth picture, rows from the top: near plane's distance / distance along the view, 0 where nothing
    /// was drawn.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read_depth(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<f32>, GpuError> {
        let bytes = self.read(device, queue, &self.depth_texture)?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    /// Four bytes a pixel, rows from the top.
    fn read(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        texture: &wgpu::Texture,
    ) -> Result<Vec<u8>, GpuError> {
        let row = self.size[0] as usize * 4;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize);
        let copy = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: (padded * self.size[1] as usize) as u64,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &copy,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: u32::try_from(padded).ok(),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        queue.submit([encoder.finish()]);
        let data = mapped(device, &copy)?;
        Ok(data.chunks(padded).flat_map(|r| &r[..row]).copied().collect())
    }
}
