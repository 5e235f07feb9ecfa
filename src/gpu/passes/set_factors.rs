//! Finds the threshold and gives every visible patch the vertices it keeps.

use super::binding;
use super::spec::{Dispatch, EVERY_FRAME, PassSpec};
use crate::gpu::shaders;
use crate::quads::slots_per_level;

const PLANE: [u32; 8] = [
    binding::FRAME,
    binding::PATCHES,
    binding::COUNTERS,
    binding::CHOICE,
    binding::WISHES,
    binding::WEIGHTS,
    binding::GRADES,
    binding::LEAVES,
];
const CURVED: [u32; 2] = [binding::CURVE, binding::CHARTS];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |_| shaders::SET_FACTORS,
    needed: |variant| variant.by_error,
    runs: EVERY_FRAME,
    constants: |_| Vec::new(),
    bindings: |variant| variant.bindings(&PLANE, &CURVED),
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Groups(|shape, work| [(slots_per_level(shape) * work.lanes).div_ceil(64), 1, 1]),
};
