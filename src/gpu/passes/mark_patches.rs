//! Marks visible patches with their screen-space error, for the colouring that shows it.

use super::spec::{Dispatch, EVERY_FRAME, PassSpec};
use super::{binding, flag};
use crate::gpu::shaders;
use crate::quads::slots_per_level;
use crate::scene::ColorMode;

const PLANE: [u32; 5] =
    [binding::FRAME, binding::BLOCK_BOUNDS, binding::PATCHES, binding::CHOICE, binding::DEVIATIONS];
const CURVED: [u32; 3] = [binding::CURVE, binding::CHARTS, binding::ANCHORS];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |_| shaders::MARK_PATCHES,
    needed: |variant| variant.color == ColorMode::Error,
    runs: EVERY_FRAME,
    constants: |variant| vec![("BY_ERROR", flag(variant.by_error))],
    bindings: |variant| variant.bindings(&PLANE, &CURVED),
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Groups(|shape, work| [(slots_per_level(shape) * work.lanes).div_ceil(64), 1, 1]),
};
