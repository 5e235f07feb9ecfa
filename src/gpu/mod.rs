//! The GPU: device, shared layouts, buffers, shaders, passes and read-back. The only layer, with the
//! renderer above it, that imports wgpu.

mod buffers;
mod device;
pub(crate) mod layouts;
mod offscreen;
pub(crate) mod passes;
mod readback;
mod shaders;

pub use buffers::{Buffers, Capacity};
pub use device::{Gpu, GpuError};
pub use layouts::{Counters, GpuControlQuad, GpuFrame, PatchRecord};
pub use offscreen::Offscreen;
pub use readback::{GpuMesh, read_buffer};
pub use shaders::{ShaderModuleSource, shader_sources};
