//! Gives every visible patch its place and writes the indirect arguments.

use super::binding;
use super::spec::{Dispatch, EVERY_FRAME, PassSpec};
use crate::gpu::shaders;

const PLANE: [u32; 4] = [binding::FRAME, binding::PATCHES, binding::VISIBLE_SLOTS, binding::COUNTERS];
const CURVED: [u32; 1] = [binding::CURVE];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |variant| {
        if variant.by_error { shaders::COMPACT_PATCHES_BY_ERROR } else { shaders::COMPACT_PATCHES }
    },
    needed: |_| true,
    runs: EVERY_FRAME,
    constants: |_| Vec::new(),
    bindings: |variant| {
        let mut all = variant.bindings(&PLANE, &CURVED);
        all.extend(variant.by_error.then_some(binding::LEAVES));
        all
    },
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Groups(|_, _| [1, 1, 1]),
};
