//! Bounds of blocks of samples; runs only when a window moved.

use super::{ComputePass, Dispatch, FrameWork, Variant, binding};
use crate::gpu::{Buffers, Ground, bounds_side, shaders};

const PLANE: [u32; 3] = [binding::FRAME, binding::SAMPLES, binding::BLOCK_BOUNDS];
const CURVED: [u32; 6] = [
    binding::FRAME,
    binding::SAMPLES,
    binding::BLOCK_BOUNDS,
    binding::CURVE,
    binding::CHARTS,
    binding::ANCHORS,
];

pub(crate) fn new(device: &wgpu::Device, buffers: &Buffers, variant: Variant) -> ComputePass {
    ComputePass::new(
        device,
        buffers,
        shaders::BOUND_BLOCKS,
        variant.ground,
        variant.bindings(&PLANE, &CURVED),
        &[],
        if variant.ground == Ground::Plane {
            Dispatch::Groups(|shape, work| groups(bounds_side(shape, Ground::Plane), work))
        } else {
            Dispatch::Groups(|shape, work| groups(bounds_side(shape, Ground::Curved), work))
        },
    )
}

fn groups(side: u32, work: FrameWork) -> [u32; 3] {
    [side.div_ceil(8), side.div_ceil(8), if work.shifted { work.lanes } else { 0 }]
}
