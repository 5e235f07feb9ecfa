//! Twin of shaders/expand_patches.wgsl: one patch becomes vertices and triangles. Those of a patch whose factors go
//! by error are shaders/expand_leaves.wgsl's, see `expand_leaves`.

use super::{Placement, Vertex, leaf_triangles};
use crate::pyramid::SampleSource;
use crate::quads::Patch;

/// Vertices and triangles of one patch; indices count from the patch's first vertex.
#[derive(Clone, Debug, Default)]
pub struct Expanded {
    /// Vertices, grid or own nodes first, then the extra ones of the south, north, west and east side.
    pub vertices: Vec<Vertex>,
    /// Base sample of each vertex.
    pub base: Vec<[i32; 2]>,
    /// False where the sample under the vertex is void.
    pub valid: Vec<bool>,
    /// Triangles, counter-clockwise from above, including those that touch void samples.
    pub triangles: Vec<[u32; 3]>,
}

/// Expands a patch. The packed normals are left zero: compare them by angle with
/// [`Placement::normal`].
#[must_use]
pub fn expand(placement: &Placement, source: &dyn SampleSource, patch: &Patch) -> Expanded {
    let mut out = Expanded::default();
    let level = patch.level;
    let base = patch.bases(placement.windows.lattice);
    for p in &base {
        let (position, valid) = placement.position(source, level, *p);
        let packed = level << 24 | (patch.kind as u32) << 29;
        out.vertices.push(Vertex { position, packed });
        out.valid.push(valid);
    }
    out.base = base;
    out.triangles = if patch.by_error.is_some() {
        leaf_triangles(patch)
    } else {
        let [w, h] = patch.cells();
        let cells = (0..h).flat_map(|y| (0..w).map(move |x| [x, y]));
        cells.flat_map(|cell| cell_triangles(patch, cell)).collect()
    };
    out
}

/// Triangles of one cell of a patch with uniform factors: the south chain is fanned from the north-west corner, the
/// north one from the south-east corner; the first triangle is fanned over the west edge's points, the last over
/// the east edge's. The diagonal stays, so every triangle lies in one half of the cell.
#[must_use]
pub fn cell_triangles(patch: &Patch, cell: [u32; 2]) -> Vec<[u32; 3]> {
    let [w, h] = patch.cells();
    let [x, y] = cell;
    let south = chain(patch, 0, y == 0, x, [grid(w, x, y), grid(w, x + 1, y)]);
    let north = chain(patch, 1, y + 1 == h, x, [grid(w, x, y + 1), grid(w, x + 1, y + 1)]);
    let west = chain(patch, 2, x == 0, y, [grid(w, x, y), grid(w, x, y + 1)]);
    let east = chain(patch, 3, x + 1 == w, y, [grid(w, x + 1, y), grid(w, x + 1, y + 1)]);
    let (sn, nn) = (south.len() - 1, north.len() - 1);
    let mut out = Vec::new();
    let (mut i, mut j) = (0, 0);
    for step in 0..sn + nn {
        let advance_south = i < sn;
        let third = if advance_south { south[i + 1] } else { north[j + 1] };
        if step == 0 {
            out.extend(west.windows(2).map(|e| [e[0], third, e[1]]));
        } else if step + 1 == sn + nn {
            let apex = if advance_south { south[i] } else { north[j] };
            out.extend(east.windows(2).map(|e| [e[0], e[1], apex]));
        } else {
            out.push([south[i], third, north[j]]);
        }
        if advance_south { i += 1 } else { j += 1 }
    }
    out
}

fn grid(w: u32, x: u32, y: u32) -> u32 {
    y * (w + 1) + x
}

/// Vertex indices along one edge of a cell, with the extra ones where the edge lies on the patch's
/// border and is divided.
fn chain(patch: &Patch, side: usize, on_border: bool, cell: u32, ends: [u32; 2]) -> Vec<u32> {
    let [w, h] = patch.cells();
    let span = patch.outer[side];
    let mut out = vec![ends[0]];
    if on_border && span.segments(cell) > 1 {
        let before: u32 = patch.outer[..side].iter().map(|span| span.extra()).sum();
        let first = (w + 1) * (h + 1) + before + span.extra_before(cell);
        out.extend((0..span.segments(cell) - 1).map(|t| first + t));
    }
    out.push(ends[1]);
    out
}
