//! Expands visible patches into vertices and triangles.

use super::{ComputePass, Dispatch, Variant, binding, flag};
use crate::gpu::{Buffers, Counters, shaders};

pub(crate) fn new(device: &wgpu::Device, buffers: &Buffers, variant: Variant) -> ComputePass {
    ComputePass::new(
        device,
        buffers,
        shaders::EXPAND_PATCHES,
        &[
            binding::FRAME,
            binding::SAMPLES,
            binding::PATCHES,
            binding::VISIBLE_SLOTS,
            binding::VERTICES,
            binding::INDICES,
        ],
        &[("HAS_VOIDS", flag(variant.has_voids)), ("MORPH", flag(variant.morph))],
        Dispatch::Indirect(std::mem::offset_of!(Counters, expand_x) as u64),
    )
}
