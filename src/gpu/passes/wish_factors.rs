//! Says by how many bins a block's grades move on the scale of thresholds, for how large a metre shows there.

use super::binding;
use super::spec::{Dispatch, EVERY_FRAME, PassSpec};
use crate::gpu::shaders;
use crate::quads::slots_per_level;

const PLANE: [u32; 8] = [
    binding::FRAME,
    binding::BLOCK_BOUNDS,
    binding::PATCHES,
    binding::CHOICE,
    binding::DEVIATIONS,
    binding::WISHES,
    binding::WEIGHTS,
    binding::GRADES,
];
const CURVED: [u32; 3] = [binding::CURVE, binding::CHARTS, binding::ANCHORS];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |_| shaders::WISH_FACTORS,
    needed: |variant| variant.by_error,
    runs: EVERY_FRAME,
    constants: |_| Vec::new(),
    bindings: |variant| variant.bindings(&PLANE, &CURVED),
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Groups(|shape, work| [(slots_per_level(shape) * work.lanes).div_ceil(64), 1, 1]),
};
