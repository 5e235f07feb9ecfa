//! Cuts control quads into patches and tests them against the frustum and, on a globe, the horizon.

use super::{ComputePass, Dispatch, Variant, binding, flag};
use crate::gpu::{Buffers, shaders};
use crate::quads::slots_per_level;

const PLANE: [u32; 6] = [
    binding::FRAME,
    binding::CONTROL_POINTS,
    binding::CONTROL_QUADS,
    binding::QUAD_CORNERS,
    binding::BLOCK_BOUNDS,
    binding::PATCHES,
];
const CURVED: [u32; 9] = [
    binding::FRAME,
    binding::CONTROL_POINTS,
    binding::CONTROL_QUADS,
    binding::QUAD_CORNERS,
    binding::BLOCK_BOUNDS,
    binding::PATCHES,
    binding::CURVE,
    binding::CHARTS,
    binding::ANCHORS,
];

pub(crate) fn new(device: &wgpu::Device, buffers: &Buffers, variant: Variant) -> ComputePass {
    ComputePass::new(
        device,
        buffers,
        shaders::CULL_QUADS,
        variant.ground,
        variant.bindings(&PLANE, &CURVED),
        &[("MORPH", flag(variant.morph))],
        Dispatch::Groups(|shape, work| [(slots_per_level(shape) * work.lanes).div_ceil(64), 1, 1]),
    )
}
