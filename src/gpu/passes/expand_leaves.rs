//! Expands visible patches into the vertices they keep and their triangles, where factors go by error.

use super::spec::{EVERY_FRAME, PassSpec};
use super::{binding, expand_patches};
use crate::gpu::shaders;
use crate::scene::ColorMode;

/// Patches' records lie before their leaves: with a binding of their own, curved surfaces would need nine of
/// all storage.
const PLANE: [u32; 6] = [
    binding::FRAME,
    binding::SAMPLES,
    binding::VISIBLE_SLOTS,
    binding::LEAVES,
    binding::VERTICES,
    binding::INDICES,
];
const CURVED: [u32; 4] = [binding::CURVE, binding::CHARTS, binding::ANCHORS, binding::SHADES];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |variant| match variant.color {
        ColorMode::Error => shaders::EXPAND_LEAVES_MARKED,
        ColorMode::Refill => shaders::EXPAND_LEAVES_REFILL,
        _ => shaders::EXPAND_LEAVES,
    },
    needed: |variant| variant.by_error,
    runs: EVERY_FRAME,
    constants: expand_patches::SPEC.constants,
    bindings: |variant| {
        let mut all = variant.bindings(&PLANE, &CURVED);
        all.extend((variant.color == ColorMode::Refill).then_some(binding::HELD_BEFORE));
        all
    },
    inputs: |_| Vec::new(),
    dispatch: expand_patches::SPEC.dispatch,
};
