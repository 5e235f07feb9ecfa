//! Expands visible patches into vertices and triangles, where factors are uniform.

use super::spec::{Dispatch, EVERY_FRAME, PassSpec};
use super::{binding, flag};
use crate::gpu::{Counters, Ground, shaders};
use crate::scene::ColorMode;

const PLANE: [u32; 6] = [
    binding::FRAME,
    binding::SAMPLES,
    binding::PATCHES,
    binding::VISIBLE_SLOTS,
    binding::VERTICES,
    binding::INDICES,
];
/// Eight of all storage: all that default WebGPU grants a stage.
const CURVED: [u32; 4] = [binding::CURVE, binding::CHARTS, binding::ANCHORS, binding::SHADES];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |variant| match variant.color {
        ColorMode::Error => shaders::EXPAND_PATCHES_MARKED,
        ColorMode::Refill => shaders::EXPAND_PATCHES_REFILL,
        _ => shaders::EXPAND_PATCHES,
    },
    needed: |variant| !variant.by_error,
    runs: EVERY_FRAME,
    constants: |variant| {
        let mut all = vec![("HAS_VOIDS", flag(variant.has_voids)), ("MORPH", flag(variant.morph))];
        if variant.ground == Ground::Plane {
            all.push(("NORMALS", flag(variant.normals)));
        }
        all
    },
    bindings: |variant| {
        let mut all = variant.bindings(&PLANE, &CURVED);
        all.extend((variant.color == ColorMode::Refill).then_some(binding::HELD_BEFORE));
        all
    },
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Indirect(std::mem::offset_of!(Counters, expand_x) as u64),
};
