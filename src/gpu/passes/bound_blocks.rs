//! Bounds of blocks of samples; runs only when a window moved.

use super::{ComputePass, Dispatch, Variant, binding};
use crate::gpu::{Buffers, shaders};

const PLANE: [u32; 3] = [binding::FRAME, binding::SAMPLES, binding::BLOCK_BOUNDS];
const CURVED: [u32; 6] = [
    binding::FRAME,
    binding::SAMPLES,
    binding::BLOCK_BOUNDS,
    binding::CURVE,
    binding::CHARTS,
    binding::RECORDS,
];

pub(crate) fn new(device: &wgpu::Device, buffers: &Buffers, variant: Variant) -> ComputePass {
    ComputePass::new(
        device,
        buffers,
        shaders::BOUND_BLOCKS,
        variant.ground,
        variant.bindings(&PLANE, &CURVED),
        &[],
        Dispatch::Groups(|shape, work| {
            let side = ((shape.n() + 1) / 8).div_ceil(8);
            [side, side, if work.shifted { work.lanes } else { 0 }]
        }),
    )
}
