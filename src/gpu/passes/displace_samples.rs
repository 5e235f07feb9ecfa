//! Scatters the refill strips into the toroidal windows; runs only when a window moved.

use super::{ComputePass, Dispatch, Variant, binding, flag};
use crate::gpu::{Buffers, Ground, shaders};

const PLANE: [u32; 3] = [binding::FRAME, binding::SAMPLES, binding::STAGING];
const CURVED: [u32; 6] =
    [binding::FRAME, binding::SAMPLES, binding::STAGING, binding::CURVE, binding::CHARTS, binding::RECORDS];
const POINTS: [u32; 6] =
    [binding::FRAME, binding::SAMPLES, binding::STAGING, binding::CURVE, binding::CHARTS, binding::ANCHORS];

pub(crate) fn new(device: &wgpu::Device, buffers: &Buffers, variant: Variant) -> ComputePass {
    ComputePass::new(
        device,
        buffers,
        shaders::DISPLACE_SAMPLES,
        variant.ground,
        if variant.ground == Ground::Points { &POINTS } else { variant.bindings(&PLANE, &CURVED) },
        &[("SHORT", flag(variant.short))],
        Dispatch::Groups(|_, work| [work.largest_strip.div_ceil(64), work.strips, 1]),
    )
}
