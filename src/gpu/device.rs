//! Finding an adapter and opening a device inside default WebGPU limits.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What goes wrong with the GPU, with the remedy.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No adapter at all.
    #[error(
        "no GPU adapter found: install a driver (on Debian or Ubuntu: apt-get install mesa-vulkan-drivers, a software one)"
    )]
    NoAdapter,
    /// WGPU_ADAPTER_NAME matched nothing.
    #[error("no adapter's name contains '{wanted}': set WGPU_ADAPTER_NAME to part of one of: {found}")]
    NoSuchAdapter {
        /// The name asked for.
        wanted: String,
        /// Names of the adapters present.
        found: String,
    },
    /// The adapter would not open a device.
    #[error("adapter '{adapter}' refused a device: {reason}; try another WGPU_BACKEND")]
    NoDevice {
        /// Adapter's name.
        adapter: String,
        /// wgpu's words.
        reason: String,
    },
    /// More than the device allows.
    #[error("{what} needs {bytes} bytes, this device allows {most}: lower n or the level count")]
    TooLarge {
        /// Which buffer or texture.
        what: &'static str,
        /// Bytes (or pixels of a side) it needs.
        bytes: u64,
        /// The limit.
        most: u64,
    },
    /// A picture side of zero or beyond the device's textures.
    #[error("a picture of {width} x {height} pixels cannot be drawn here: each side must be 1 to {most}")]
    PictureSize {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
        /// Largest side.
        most: u32,
    },
    /// The device was lost or failed while its results were read.
    #[error("the GPU did not give its results back: {reason}")]
    Readback {
        /// wgpu's words.
        reason: String,
    },
}

/// A use of the GPU that its rules forbid is a bug of ours.
#[expect(clippy::panic, reason = "going on would draw something wrong in silence")]
fn fault(text: &str) {
    panic!("{text}");
}

/// A device of our own, for the command line and tests; an embedding engine brings its own.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// What it runs on.
    pub info: wgpu::AdapterInfo,
    lost: Arc<AtomicBool>,
}

impl Gpu {
    /// Opens the best adapter, or the one that WGPU_BACKEND and WGPU_ADAPTER_NAME ask for.
    ///
    /// # Errors
    /// When there is none, none of that name, or it refuses a device.
    pub fn new() -> Result<Self, GpuError> {
        pollster::block_on(Self::open())
    }

    async fn open() -> Result<Self, GpuError> {
        let instance = Self::instance(wgpu::InstanceDescriptor::new_without_display_handle());
        Ok(Self::on(&instance, None).await?.0)
    }

    /// The instance that devices are opened from, after our habits and the environment's; a window's host gives
    /// the display handle with the descriptor.
    #[must_use]
    pub fn instance(mut descriptor: wgpu::InstanceDescriptor) -> wgpu::Instance {
        // Our indirect arguments are written by our own passes and clamped there; wgpu's check of them
        // is an extra pass a frame. The environment may switch it back on.
        descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
        descriptor.flags = descriptor.flags.with_env();
        // OpenGL has no place here (its adapters lack what WebGPU guarantees), unless asked for.
        descriptor.backends = wgpu::Backends::from_env().unwrap_or(wgpu::Backends::PRIMARY);
        wgpu::Instance::new(descriptor)
    }

    /// As [`Gpu::new`], from a given instance; where a surface is given, on an adapter that can present to it.
    ///
    /// # Errors
    /// As [`Gpu::new`].
    pub async fn on(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<(Self, wgpu::Adapter), GpuError> {
        let adapter = match std::env::var("WGPU_ADAPTER_NAME") {
            Ok(wanted) => Self::named(instance, &wanted).await?,
            Err(_) => {
                let options = wgpu::RequestAdapterOptions {
                    power_preference: wgpu::PowerPreference::HighPerformance,
                    compatible_surface: surface,
                    ..Default::default()
                };
                instance.request_adapter(&options).await.map_err(|_| GpuError::NoAdapter)?
            }
        };
        let info = adapter.get_info();
        let most = adapter.limits();
        // Default WebGPU limits suffice; larger buffers are taken where the adapter has them (n = 1023).
        let mut limits = wgpu::Limits::default();
        limits.max_buffer_size = limits.max_buffer_size.max(most.max_buffer_size.min(1 << 30));
        limits.max_storage_buffer_binding_size =
            limits.max_storage_buffer_binding_size.max(most.max_storage_buffer_binding_size.min(1 << 30));
        // Optional: per-pass times are null without it.
        let features = adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                label: Some("tessclip"),
                required_features: features,
                required_limits: limits,
                ..Default::default()
            })
            .await
            .map_err(|e| GpuError::NoDevice { adapter: info.name.clone(), reason: e.to_string() })?;
        let lost = Arc::new(AtomicBool::new(false));
        let flag = lost.clone();
        device.set_device_lost_callback(move |reason, message| {
            log::warn!("the GPU device was lost ({reason:?}): {message}");
            flag.store(true, Ordering::Release);
        });
        let flag = lost.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let text = error.to_string();
            // Whatever is asked of a device that is gone fails, at first as a use of things that could not be
            // made; that they could not would have been told here before. The host asks `is_lost`.
            let follows = ["label is invalid", "has been destroyed", "device is lost"];
            let follows = follows.iter().any(|words| text.contains(words));
            if flag.load(Ordering::Acquire) || follows {
                log::debug!("after the device was lost: {text}");
            } else {
                fault(&text);
            }
        }));
        Ok((Self { device, queue, info, lost }, adapter))
    }

    /// True when the device is gone (driver reset, adapter removed): open another, and make renderers and
    /// targets anew. Terrains stay as they are.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Acquire)
    }

    async fn named(instance: &wgpu::Instance, wanted: &str) -> Result<wgpu::Adapter, GpuError> {
        let adapters = instance.enumerate_adapters(wgpu::Backends::all()).await;
        let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
        let lower = wanted.to_lowercase();
        adapters
            .into_iter()
            .find(|a| a.get_info().name.to_lowercase().contains(&lower))
            .ok_or_else(|| GpuError::NoSuchAdapter { wanted: wanted.into(), found: names.join(", ") })
    }

    /// One line naming adapter, backend and driver.
    #[must_use]
    pub fn describe(&self) -> String {
        let i = &self.info;
        format!("{} ({:?}, {} {})", i.name, i.backend, i.driver, i.driver_info)
    }
}
