//! The window's surface and the device that presents to it.

use std::sync::Arc;

use tessclip::gpu::{Gpu, GpuError};
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window;

use crate::cli::view::Vsync;

/// What became of the next frame's texture.
pub enum Acquired {
    /// Draw into it and present it.
    Frame(wgpu::SurfaceTexture),
    /// Nothing to draw into now; the surface was mended or is hidden.
    Skip {
        /// True when it is worth trying at once.
        again: bool,
    },
}

/// A surface, configured for the window's size; the window may have none (minimised).
pub struct Screen {
    pub gpu: Gpu,
    pub format: wgpu::TextureFormat,
    /// The same bytes without sRGB's curve, where the surface can be seen so: panels are blended as they look, and
    /// a software driver has no powers to compute for them.
    pub plain: wgpu::TextureFormat,
    /// Frames take copies of other textures.
    pub copies: bool,
    instance: wgpu::Instance,
    adapter: wgpu::Adapter,
    surface: wgpu::Surface<'static>,
    window: Arc<Window>,
    vsync: Vsync,
    /// Pixels; 0 while there is nothing to draw to.
    size: [u32; 2],
    depth: Option<wgpu::TextureView>,
}

impl Screen {
    /// Opens a device that can present to the window.
    pub fn open(window: &Arc<Window>, display: OwnedDisplayHandle, vsync: Vsync) -> anyhow::Result<Self> {
        let descriptor = wgpu::InstanceDescriptor::new_with_display_handle(Box::new(display));
        let instance = Gpu::instance(descriptor);
        let surface = instance.create_surface(window.clone())?;
        let (gpu, adapter) = pollster::block_on(Gpu::on(&instance, Some(&surface)))?;
        let format = format_of(&surface, &adapter)?;
        let mut screen = Self {
            gpu,
            format,
            plain: plain_of(format, &adapter),
            copies: takes_copies(&surface, &adapter),
            instance,
            adapter,
            surface,
            window: window.clone(),
            vsync,
            size: [0; 2],
            depth: None,
        };
        screen.resize(window.inner_size().into());
        Ok(screen)
    }

    /// Pixels drawn to; 0 while there is nothing to draw to.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    pub fn depth(&self) -> Option<&wgpu::TextureView> {
        self.depth.as_ref()
    }

    /// Takes the window's size. Beyond what the device's textures can hold, the picture is as large as they are
    /// and the window system stretches it. Returns whether that is so.
    pub fn resize(&mut self, size: [u32; 2]) -> bool {
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        self.size = if size.contains(&0) { [0; 2] } else { size.map(|v| v.min(most)) };
        self.configure();
        size.iter().any(|v| *v > most)
    }

    fn configure(&mut self) {
        self.depth = None;
        let [width, height] = self.size;
        if self.size.contains(&0) {
            return;
        }
        let known = self.surface.get_capabilities(&self.adapter).present_modes;
        if self.vsync != Vsync::Auto && !known.contains(&mode(self.vsync)) {
            log::warn!("the window has no --vsync {}; going on with auto", self.vsync.name());
            self.vsync = Vsync::Auto;
        }
        let config = wgpu::SurfaceConfiguration {
            usage: if self.copies { DRAWN | wgpu::TextureUsages::COPY_DST } else { DRAWN },
            format: self.format,
            color_space: wgpu::SurfaceColorSpace::Auto,
            width,
            height,
            present_mode: mode(self.vsync),
            // What is seen is one frame behind what was drawn, never more.
            desired_maximum_frame_latency: 1,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: if self.plain == self.format { Vec::new() } else { vec![self.plain] },
        };
        self.surface.configure(&self.gpu.device, &config);
        let depth = self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("window depth"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Depth32Float,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        self.depth = Some(depth.create_view(&wgpu::TextureViewDescriptor::default()));
    }

    /// The next texture to draw into; a surface that is outdated or lost is mended.
    pub fn acquire(&mut self) -> anyhow::Result<Acquired> {
        if self.size.contains(&0) {
            return Ok(Acquired::Skip { again: false });
        }
        match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(texture) => Ok(Acquired::Frame(texture)),
            // Still good for this frame; the resize that follows configures it anew.
            wgpu::CurrentSurfaceTexture::Suboptimal(texture) => Ok(Acquired::Frame(texture)),
            wgpu::CurrentSurfaceTexture::Timeout => Ok(Acquired::Skip { again: true }),
            wgpu::CurrentSurfaceTexture::Occluded => Ok(Acquired::Skip { again: false }),
            wgpu::CurrentSurfaceTexture::Outdated | wgpu::CurrentSurfaceTexture::Validation => {
                self.configure();
                Ok(Acquired::Skip { again: true })
            }
            wgpu::CurrentSurfaceTexture::Lost => {
                if !self.gpu.is_lost() {
                    self.surface = self.instance.create_surface(self.window.clone())?;
                    self.configure();
                }
                Ok(Acquired::Skip { again: true })
            }
        }
    }

    pub fn present(&self, texture: wgpu::SurfaceTexture) {
        self.gpu.queue.present(texture);
    }

    /// Another device, after this one was lost; the surface is made anew as well.
    pub fn reopen(&mut self) -> Result<(), GpuError> {
        let failed = |reason: String| GpuError::Readback { reason };
        self.surface =
            self.instance.create_surface(self.window.clone()).map_err(|e| failed(e.to_string()))?;
        (self.gpu, self.adapter) = pollster::block_on(Gpu::on(&self.instance, Some(&self.surface)))?;
        self.format = format_of(&self.surface, &self.adapter).map_err(|e| failed(e.to_string()))?;
        self.plain = plain_of(self.format, &self.adapter);
        self.copies = takes_copies(&self.surface, &self.adapter);
        self.configure();
        Ok(())
    }

    pub fn vsync(&self) -> Vsync {
        self.vsync
    }

    /// The next kind of synchronisation that the surface knows.
    pub fn next_vsync(&mut self) {
        let known = self.surface.get_capabilities(&self.adapter).present_modes;
        let all = [Vsync::Auto, Vsync::Fifo, Vsync::Mailbox, Vsync::Immediate];
        let at = all.iter().position(|v| *v == self.vsync).unwrap_or(0);
        let next = (1..=all.len()).map(|k| all[(at + k) % all.len()]);
        self.vsync =
            next.into_iter().find(|v| *v == Vsync::Auto || known.contains(&mode(*v))).unwrap_or(Vsync::Auto);
        self.configure();
    }
}

fn mode(vsync: Vsync) -> wgpu::PresentMode {
    match vsync {
        Vsync::Auto => wgpu::PresentMode::AutoVsync,
        Vsync::Fifo => wgpu::PresentMode::Fifo,
        Vsync::Mailbox => wgpu::PresentMode::Mailbox,
        Vsync::Immediate => wgpu::PresentMode::Immediate,
    }
}

const DRAWN: wgpu::TextureUsages = wgpu::TextureUsages::RENDER_ATTACHMENT;

fn takes_copies(surface: &wgpu::Surface<'_>, adapter: &wgpu::Adapter) -> bool {
    surface.get_capabilities(adapter).usages.contains(wgpu::TextureUsages::COPY_DST)
}

fn plain_of(format: wgpu::TextureFormat, adapter: &wgpu::Adapter) -> wgpu::TextureFormat {
    let flags = adapter.get_downlevel_capabilities().flags;
    let seen_both_ways = flags.contains(wgpu::DownlevelFlags::SURFACE_VIEW_FORMATS);
    if seen_both_ways { format.remove_srgb_suffix() } else { format }
}

/// A format of 8 bits a channel that encodes sRGB, as our pictures have it.
fn format_of(surface: &wgpu::Surface<'_>, adapter: &wgpu::Adapter) -> anyhow::Result<wgpu::TextureFormat> {
    let known = surface.get_capabilities(adapter).formats;
    let wanted = [wgpu::TextureFormat::Rgba8UnormSrgb, wgpu::TextureFormat::Bgra8UnormSrgb];
    let found = wanted.into_iter().find(|f| known.contains(f));
    found.ok_or_else(|| anyhow::anyhow!("the window takes none of the formats {wanted:?}, only {known:?}"))
}
