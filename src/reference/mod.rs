//! CPU twins of the compute shaders, one file a shader with the same stem: slow and obvious.
//!
//! They say what the GPU must compute; tests hold the GPU's buffers against them. They read the
//! pyramid directly where the GPU reads its toroidal windows, so that a wrong address shows.

mod cull_quads;
mod expand_leaves;
mod expand_patches;
mod grade_nodes;
mod positions;

pub use cull_quads::{Bounds, Frustum, patch_bounds, visible};
pub use expand_leaves::{Leaf, leaf_at, leaf_triangles};
pub use expand_patches::{Expanded, cell_triangles, expand};
pub use grade_nodes::{Grade, grades};
pub(crate) use positions::coarse_ends;
pub use positions::{Placement, Vertex, unpack_normal};
