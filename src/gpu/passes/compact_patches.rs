//! Gives every visible patch its place and writes the indirect arguments.

use super::{ComputePass, Dispatch, Variant, binding};
use crate::gpu::{Buffers, shaders};

const PLANE: [u32; 4] = [binding::FRAME, binding::PATCHES, binding::VISIBLE_SLOTS, binding::COUNTERS];
const CURVED: [u32; 5] =
    [binding::FRAME, binding::PATCHES, binding::VISIBLE_SLOTS, binding::COUNTERS, binding::CURVE];

pub(crate) fn new(device: &wgpu::Device, buffers: &Buffers, variant: Variant) -> ComputePass {
    ComputePass::new(
        device,
        buffers,
        shaders::COMPACT_PATCHES,
        variant.ground,
        variant.bindings(&PLANE, &CURVED),
        &[],
        Dispatch::Groups(|_, _| [1, 1, 1]),
    )
}
