//! The GPU: device, shared layouts, buffers, shaders, passes and read-back. The only layer, with the
//! renderer above it, that imports wgpu.

mod buffers;
mod curve;
mod device;
pub(crate) mod layouts;
mod offscreen;
pub(crate) mod passes;
mod readback;
pub(crate) mod shaders;
mod sizes;

pub(crate) use buffers::most_bytes;
pub use buffers::{Buffers, ByErrorBuffers, CurvedBuffers, DeviationBuffers};
pub(crate) use curve::packed_charts;
pub use curve::{GpuChart, GpuCurve, GpuCurveLevel};
pub use device::{Gpu, GpuError};
pub use layouts::{Counters, GpuChoice, GpuControlQuad, GpuFrame, PatchNodes, PatchRecord};
pub use offscreen::Offscreen;
pub use passes::Variant;
pub use readback::{GpuMesh, read_buffer};
pub use shaders::{
    Ground, ShaderModuleSource, by_error_sources, rival_sources, shader_sources, view_sources,
};
pub use sizes::{BufferSize, Capacity, Extent, buffer_sizes};
pub(crate) use sizes::{DEVIATION_WORDS, MAX_LANES, bounds_side};
