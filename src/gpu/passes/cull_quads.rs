//! Cuts control quads into patches and tests them against the frustum and, on a globe, the horizon.

use super::spec::{Dispatch, EVERY_FRAME, PassSpec};
use super::{Variant, binding, flag};
use crate::gpu::{Ground, shaders};
use crate::quads::slots_per_level;

const PLANE: [u32; 5] = [
    binding::FRAME,
    binding::CONTROL_POINTS,
    binding::CONTROL_QUADS,
    binding::QUAD_CORNERS,
    binding::PATCHES,
];
const CURVED: [u32; 2] = [binding::CURVE, binding::CHARTS];

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |variant| if variant.bounds { shaders::CULL_QUADS } else { shaders::CULL_QUADS_UNBOUNDED },
    needed: |_| true,
    runs: EVERY_FRAME,
    constants: |variant| {
        let mut all = vec![("MORPH", flag(variant.morph)), ("CULL", flag(variant.cull))];
        if variant.bounds && variant.ground != Ground::Plane {
            all.push(("HORIZON", flag(variant.horizon)));
        }
        all
    },
    bindings,
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Groups(|shape, work| [(slots_per_level(shape) * work.lanes).div_ceil(64), 1, 1]),
};

/// Anchors of the base surface say where bounds lie: without bounds they are not read either.
fn bindings(variant: Variant) -> Vec<u32> {
    let mut all = variant.bindings(&PLANE, &CURVED);
    if variant.bounds {
        all.push(binding::BLOCK_BOUNDS);
        all.extend((variant.ground != Ground::Plane).then_some(binding::ANCHORS));
    }
    all
}
