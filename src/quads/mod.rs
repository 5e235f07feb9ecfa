//! Control quads: the coarse M, R and L layout the CPU sends, its patches and their factors.
//!
//! Pure geometry, no heights and no GPU. Song et al. 2016, sections 3.1 to 3.3; by error, every vertex of a patch is
//! chosen by itself (`nodes`, `by_error`).

mod by_error;
mod control;
mod factors;
mod nodes;
mod patches;

pub use by_error::{Beyond, ByError, beyond, by_error, side_place};
pub use control::{
    BlockKind, CONTROL_POINTS, ControlQuad, FOOTPRINT_POINTS, L_FIRST, L_QUADS, QUADS_PER_LEVEL,
    control_points, control_quads, l_quads,
};
pub use factors::{OuterSpan, chart_spans, outer_spans};
pub use nodes::{
    BLOCK_NODES, Diamond, block_nodes, children, closed, diamond, full_cells, is_forced, parents, rank,
};
pub use patches::{PATCH_CELLS, Patch, chart_patches, patch_slots, patches, patches_across, slots_per_level};
