//! Grades the nodes of blocks that came into a window: what leaving each of them out may deviate by.

use super::spec::{Dispatch, ON_FRESH_BLOCKS, PassSpec};
use super::{binding, flag};
use crate::gpu::shaders;

const PLANE: [u32; 5] =
    [binding::FRAME, binding::SAMPLES, binding::DEVIATIONS, binding::GRADES, binding::FRESH];
/// Chords lie off a curved surface, and the limits say how far.
const CURVED: [u32; 4] = [binding::CHOICE, binding::CURVE, binding::CHARTS, binding::ANCHORS];

/// Workgroups of a row of the dispatch: default WebGPU grants 65,535 along an axis.
const ROW: u32 = 32_768;

pub(crate) const SPEC: PassSpec = PassSpec {
    source: |_| shaders::GRADE_NODES,
    needed: |variant| variant.by_error,
    runs: ON_FRESH_BLOCKS,
    constants: |variant| vec![("HAS_VOIDS", flag(variant.has_voids))],
    bindings: |variant| variant.bindings(&PLANE, &CURVED),
    inputs: |_| Vec::new(),
    dispatch: Dispatch::Groups(|_, work| {
        let count = work.fresh_blocks;
        [count.min(ROW), count.div_ceil(ROW), 1]
    }),
};
