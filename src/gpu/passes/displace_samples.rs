//! Scatters the refill strips into the toroidal windows; runs only when a window moved.

use super::spec::{Dispatch, ON_SHIFT, PassSpec};
use super::{binding, flag};
use crate::gpu::{Ground, shaders};

const PLANE: [u32; 3] = [binding::FRAME, binding::SAMPLES, binding::STAGING];
const CURVED: [u32; 3] = [binding::CURVE, binding::CHARTS, binding::RECORDS];
const POINTS: [u32; 3] = [binding::CURVE, binding::CHARTS, binding::ANCHORS];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |_| shaders::DISPLACE_SAMPLES,
    needed: |_| true,
    runs: ON_SHIFT,
    constants: |variant| vec![("SHORT", flag(variant.short))],
    bindings: |variant| match variant.ground {
        Ground::Points => variant.bindings(&PLANE, &POINTS),
        _ => variant.bindings(&PLANE, &CURVED),
    },
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Groups(|_, work| [work.largest_strip.div_ceil(64), work.strips, 1]),
};
