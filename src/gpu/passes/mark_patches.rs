//! Marks visible patches with their screen-space error, for the colouring that shows it.

use super::binding;
use super::spec::{Dispatch, EVERY_FRAME, PassSpec};
use crate::gpu::shaders;
use crate::quads::slots_per_level;
use crate::scene::ColorMode;

const PLANE: [u32; 5] =
    [binding::FRAME, binding::BLOCK_BOUNDS, binding::PATCHES, binding::CHOICE, binding::DEVIATIONS];
const CURVED: [u32; 3] = [binding::CURVE, binding::CHARTS, binding::ANCHORS];
/// Where patches leave nodes out besides.
const BY_ERROR: [u32; 2] = [binding::GRADES, binding::LEAVES];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |variant| if variant.by_error { shaders::MARK_PATCHES_BY_ERROR } else { shaders::MARK_PATCHES },
    needed: |variant| variant.color == ColorMode::Error,
    runs: EVERY_FRAME,
    constants: |_| Vec::new(),
    bindings: |variant| {
        let mut all = variant.bindings(&PLANE, &CURVED);
        if variant.by_error {
            all.extend(BY_ERROR);
        }
        all
    },
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Groups(|shape, work| [(slots_per_level(shape) * work.lanes).div_ceil(64), 1, 1]),
};
