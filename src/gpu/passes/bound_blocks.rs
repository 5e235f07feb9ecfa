//! Height ranges of blocks of samples; runs only when a window moved.

use super::{ComputePass, Dispatch, binding};
use crate::gpu::{Buffers, shaders};

pub(crate) fn new(device: &wgpu::Device, buffers: &Buffers) -> ComputePass {
    ComputePass::new(
        device,
        buffers,
        shaders::BOUND_BLOCKS,
        &[binding::FRAME, binding::SAMPLES, binding::BLOCK_BOUNDS],
        &[],
        Dispatch::Groups(|shape, work| {
            let side = ((shape.n() + 1) / 8).div_ceil(8);
            [side, side, if work.shifted { shape.levels() } else { 0 }]
        }),
    )
}
