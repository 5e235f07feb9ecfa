//! What each pass compiles, binds and dispatches in a variant: the one array that the renderer records
//! from and the plan prints.

use super::{Variant, binding};
use crate::clipmap::ClipmapShape;
use crate::gpu::shaders::ShaderModuleSource;

/// What this frame asks of the passes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameWork {
    /// Refill strips in staging.
    pub strips: u32,
    /// Samples of the largest strip.
    pub largest_strip: u32,
    /// True when any window moved.
    pub shifted: bool,
    /// Levels of all charts.
    pub lanes: u32,
    /// Blocks of bounds a side of each.
    pub bounds_side: u32,
    /// Blocks whose nodes are to be graded.
    pub fresh_blocks: u32,
}

/// How much a pass does.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Dispatch {
    /// Workgroups, from this frame's work; nothing is recorded when any is zero.
    Groups(fn(ClipmapShape, FrameWork) -> [u32; 3]),
    /// From the counters, at this byte offset.
    Indirect(u64),
    /// The draw, from the counters.
    Draw,
}

/// A pass, by what a variant makes of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PassSpec {
    /// Its module.
    pub source: fn(Variant) -> ShaderModuleSource,
    /// True when the variant has it at all.
    pub needed: fn(Variant) -> bool,
    /// When it runs, in words.
    pub runs: &'static str,
    /// Override constants.
    pub constants: fn(Variant) -> Vec<(&'static str, f64)>,
    /// Numbers of its bindings.
    pub bindings: fn(Variant) -> Vec<u32>,
    /// Vertex and index buffers it draws from.
    pub inputs: fn(Variant) -> Vec<&'static str>,
    /// How much it does.
    pub dispatch: Dispatch,
}

/// In every frame.
pub(crate) const EVERY_FRAME: &str = "every frame";
/// Only in some.
pub(crate) const ON_SHIFT: &str = "when a window moved";
/// The same, as far as whole blocks come in.
pub(crate) const ON_FRESH_BLOCKS: &str = "when blocks came into a window";

/// All passes in the order of the frame.
pub(crate) const PASSES: [PassSpec; 13] = [
    super::displace_samples::SPEC,
    super::bound_blocks::SPEC,
    super::grade_nodes::SPEC,
    super::cull_quads::SPEC,
    super::wish_factors::SPEC,
    super::weigh_factors::SPEC,
    super::set_factors::SPEC,
    super::mark_patches::SPEC,
    super::compact_patches::SPEC,
    super::expand_patches::SPEC,
    super::expand_leaves::SPEC,
    super::draw_terrain::SPEC,
    super::draw_bounds::SPEC,
];

/// Name of a binding: that of its buffer.
pub(crate) fn binding_name(number: u32) -> &'static str {
    match number {
        binding::FRAME => "frame",
        binding::CONTROL_POINTS => "control_points",
        binding::CONTROL_QUADS => "control_quads",
        binding::SAMPLES => "samples",
        binding::BLOCK_BOUNDS => "block_bounds",
        binding::PATCHES => "patches",
        binding::VISIBLE_SLOTS => "visible_slots",
        binding::COUNTERS => "counters",
        binding::VERTICES => "vertices",
        binding::INDICES => "indices",
        binding::QUAD_CORNERS => "quad_corners",
        binding::STAGING => "staging",
        binding::CURVE => "curve",
        binding::CHARTS => "charts",
        binding::RECORDS => "records",
        binding::ANCHORS => "anchors",
        binding::CHOICE => "choice",
        binding::DEVIATIONS => "deviations",
        binding::WISHES => "wishes",
        binding::WEIGHTS => "weights",
        binding::HELD_BEFORE => "held_before",
        binding::GRADES => "grades",
        binding::FRESH => "fresh",
        binding::LEAVES => "leaves",
        _ => "shades",
    }
}
