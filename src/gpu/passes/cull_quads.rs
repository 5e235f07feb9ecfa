//! Cuts control quads into patches and tests them against the frustum.

use super::{ComputePass, Dispatch, Variant, binding, flag};
use crate::gpu::{Buffers, shaders};
use crate::quads::slots_per_level;

pub(crate) fn new(device: &wgpu::Device, buffers: &Buffers, variant: Variant) -> ComputePass {
    ComputePass::new(
        device,
        buffers,
        shaders::CULL_QUADS,
        &[
            binding::FRAME,
            binding::CONTROL_POINTS,
            binding::CONTROL_QUADS,
            binding::QUAD_CORNERS,
            binding::BLOCK_BOUNDS,
            binding::PATCHES,
        ],
        &[("MORPH", flag(variant.morph))],
        Dispatch::Groups(|shape, _| [(slots_per_level(shape) * shape.levels()).div_ceil(64), 1, 1]),
    )
}
