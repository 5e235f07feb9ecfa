//! Expands visible patches into vertices and triangles.

use super::{ComputePass, Dispatch, Variant, binding, flag};
use crate::gpu::{Buffers, Counters, shaders};

const PLANE: [u32; 6] = [
    binding::FRAME,
    binding::SAMPLES,
    binding::PATCHES,
    binding::VISIBLE_SLOTS,
    binding::VERTICES,
    binding::INDICES,
];
/// Eight of them storage: all that default WebGPU grants a stage.
const CURVED: [u32; 10] = [
    binding::FRAME,
    binding::SAMPLES,
    binding::PATCHES,
    binding::VISIBLE_SLOTS,
    binding::VERTICES,
    binding::INDICES,
    binding::CURVE,
    binding::CHARTS,
    binding::ANCHORS,
    binding::SHADES,
];

pub(crate) fn new(device: &wgpu::Device, buffers: &Buffers, variant: Variant) -> ComputePass {
    ComputePass::new(
        device,
        buffers,
        shaders::EXPAND_PATCHES,
        variant.ground,
        variant.bindings(&PLANE, &CURVED),
        &[("HAS_VOIDS", flag(variant.has_voids)), ("MORPH", flag(variant.morph))],
        Dispatch::Indirect(std::mem::offset_of!(Counters, expand_x) as u64),
    )
}
