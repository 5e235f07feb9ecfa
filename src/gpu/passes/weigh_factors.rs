//! Adds up how many triangles each threshold would draw; only under a budget.

use super::binding;
use super::spec::{Dispatch, EVERY_FRAME, PassSpec};
use crate::gpu::shaders;
use crate::quads::slots_per_level;

const PLANE: [u32; 5] =
    [binding::FRAME, binding::PATCHES, binding::WISHES, binding::WEIGHTS, binding::GRADES];
const CURVED: [u32; 2] = [binding::CURVE, binding::CHARTS];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |_| shaders::WEIGH_FACTORS,
    needed: |variant| variant.by_error && variant.budget,
    runs: EVERY_FRAME,
    constants: |_| Vec::new(),
    bindings: |variant| variant.bindings(&PLANE, &CURVED),
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Groups(|shape, work| [(slots_per_level(shape) * work.lanes).div_ceil(64), 1, 1]),
};
