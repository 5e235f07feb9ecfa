//! Gives every visible patch its place and writes the indirect arguments.

use super::{ComputePass, Dispatch, binding};
use crate::gpu::{Buffers, shaders};

pub(crate) fn new(device: &wgpu::Device, buffers: &Buffers) -> ComputePass {
    ComputePass::new(
        device,
        buffers,
        shaders::COMPACT_PATCHES,
        &[binding::FRAME, binding::PATCHES, binding::VISIBLE_SLOTS, binding::COUNTERS],
        &[],
        Dispatch::Groups(|_, _| [1, 1, 1]),
    )
}
