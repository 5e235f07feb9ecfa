//! Bounds of blocks of samples; runs only when a window moved, and only where bounds are read.

use super::binding;
use super::spec::{Dispatch, ON_SHIFT, PassSpec};
use crate::gpu::shaders;

const PLANE: [u32; 3] = [binding::FRAME, binding::SAMPLES, binding::BLOCK_BOUNDS];
const CURVED: [u32; 3] = [binding::CURVE, binding::CHARTS, binding::ANCHORS];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |_| shaders::BOUND_BLOCKS,
    needed: |variant| variant.bounds,
    runs: ON_SHIFT,
    constants: |_| Vec::new(),
    bindings: |variant| variant.bindings(&PLANE, &CURVED),
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Groups(|_, work| {
        let side = work.bounds_side.div_ceil(8);
        [side, side, if work.shifted { work.lanes } else { 0 }]
    }),
};
