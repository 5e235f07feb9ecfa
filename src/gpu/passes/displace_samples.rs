//! Scatters the refill strips into the toroidal windows; runs only when a window moved.

use super::{ComputePass, Dispatch, binding};
use crate::gpu::{Buffers, shaders};

pub(crate) fn new(device: &wgpu::Device, buffers: &Buffers) -> ComputePass {
    ComputePass::new(
        device,
        buffers,
        shaders::DISPLACE_SAMPLES,
        &[binding::FRAME, binding::SAMPLES, binding::STAGING],
        &[],
        Dispatch::Groups(|_, work| [work.largest_strip.div_ceil(64), work.strips, 1]),
    )
}
