//! The nodes of a block and how they need each other: longest-edge bisection of right triangles (Evans, Kirkpatrick
//! and Townsend 2001; Lindstrom and Pascucci 2002, section 2).
//!
//! Nodes are `[x, y]`, 0 to 16 each, from the block's south-west corner. The block begins as two triangles, cut from
//! south-east to north-west; each is halved at the middle of its longest edge, and so on. A node is a vertex only
//! where all its parents are: then no triangle ends in the middle of another one's edge.

use super::PATCH_CELLS;
use crate::clipmap::{Lattice, Rect};

/// Nodes a row of a block.
pub const BLOCK_NODES: usize = 17;

/// log2 of the scale of a block's corners, which halve nothing.
const CORNER: u32 = 4;

/// What a node halves: two triangles, or one where the other would lie outside the block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diamond {
    /// Ends of the edge whose middle the node is.
    pub ends: [[u32; 2]; 2],
    /// Right angles of the triangles that have this edge.
    pub apexes: Vec<[u32; 2]>,
}

/// All nodes of a block, row by row from the south-west.
pub fn block_nodes() -> impl Iterator<Item = [u32; 2]> {
    (0..=PATCH_CELLS).flat_map(|y| (0..=PATCH_CELLS).map(move |x| [x, y]))
}

/// log2 of a coordinate's scale.
fn scale(v: u32) -> u32 {
    v.trailing_zeros().min(CORNER)
}

/// log2 of a node's scale: half the length of the edge it halves along an axis, or half the side of the cell whose
/// diagonal it halves.
fn node_scale(node: [u32; 2]) -> u32 {
    scale(node[0]).min(scale(node[1]))
}

/// True for middles of diagonals.
fn is_centre(node: [u32; 2]) -> bool {
    scale(node[0]) == scale(node[1])
}

/// The node so many cells east and north, where the block has it.
fn beside(node: [u32; 2], by: [i32; 2]) -> Option<[u32; 2]> {
    let at = [node[0].checked_add_signed(by[0])?, node[1].checked_add_signed(by[1])?];
    (at[0] <= PATCH_CELLS && at[1] <= PATCH_CELLS).then_some(at)
}

/// How early a node is there: 1 and 2 for middles of edges of two cells and of diagonals of cells of side 2, up to
/// 8 for the block's middle; 9 for its corners. Children have lower ranks than their parents.
#[must_use]
pub fn rank(node: [u32; 2]) -> u32 {
    match node_scale(node) {
        CORNER => 9,
        scale => 2 * scale + 1 + u32::from(is_centre(node)),
    }
}

/// What a node halves; nothing for the block's corners.
#[must_use]
pub fn diamond(node: [u32; 2]) -> Option<Diamond> {
    let scale_log2 = node_scale(node);
    if scale_log2 == CORNER {
        return None;
    }
    let size = 1_i32 << scale_log2;
    let at = |east: i32, north: i32| beside(node, [east * size, north * size]);
    let (ends, apexes) = if is_centre(node) {
        let (rising, falling) = ([at(-1, -1), at(1, 1)], [at(1, -1), at(-1, 1)]);
        // Right angles are at the corners that are middles of a longer edge; the whole block's at two of its own.
        let cell = node.map(|v| v >> (scale_log2 + 1));
        let is_rising_halved = scale_log2 < 3 && (cell[0] + cell[1]).is_multiple_of(2);
        if is_rising_halved { (rising, falling) } else { (falling, rising) }
    } else {
        let (along_x, along_y) = ([at(-1, 0), at(1, 0)], [at(0, -1), at(0, 1)]);
        if scale(node[0]) < scale(node[1]) { (along_x, along_y) } else { (along_y, along_x) }
    };
    let [Some(from), Some(to)] = ends else { return None };
    Some(Diamond { ends: [from, to], apexes: apexes.into_iter().flatten().collect() })
}

/// Nodes that need this one, inside the block: middles of the edges and diagonals that its triangles' halves have.
#[must_use]
pub fn children(node: [u32; 2]) -> Vec<[u32; 2]> {
    let size = 1_i32 << node_scale(node);
    let half = size / 2;
    let all = match rank(node) {
        1 | 9 => return Vec::new(),
        rank if rank.is_multiple_of(2) => [[-size, 0], [size, 0], [0, -size], [0, size]],
        _ => [[-half, -half], [half, -half], [-half, half], [half, half]],
    };
    all.into_iter().filter_map(|by| beside(node, by)).collect()
}

/// Nodes that this one needs, inside the block; its corners are always there and none of them.
#[must_use]
pub fn parents(node: [u32; 2]) -> Vec<[u32; 2]> {
    let apexes = diamond(node).map(|d| d.apexes).unwrap_or_default();
    apexes.into_iter().filter(|apex| node_scale(*apex) != CORNER).collect()
}

/// True for the nodes of a patch of so many cells.
fn is_inside(cells: [u32; 2], node: [u32; 2]) -> bool {
    node[0] <= cells[0] && node[1] <= cells[1]
}

/// True when a triangle touches the inside of a patch and reaches beyond its last node that stands at its nominal
/// place: what ends with the data is halved until it fits.
fn straddles(cells: [u32; 2], full: [u32; 2], corners: [[u32; 2]; 3]) -> bool {
    let [a, b, c] = corners;
    let touches = |k: usize| a[k].min(b[k]).min(c[k]) < cells[k];
    let reaches = |k: usize| a[k].max(b[k]).max(c[k]) > full[k];
    touches(0) && touches(1) && (reaches(0) || reaches(1))
}

/// True for the nodes that a patch has wherever the data ends in it: of so many `cells`, the last nodes at their
/// nominal places being `full`.
#[must_use]
pub fn is_forced(cells: [u32; 2], full: [u32; 2], node: [u32; 2]) -> bool {
    let Some(Diamond { ends: [from, to], apexes }) = diamond(node) else { return false };
    is_inside(cells, node) && apexes.into_iter().any(|apex| straddles(cells, full, [apex, from, to]))
}

/// Index of a patch's last node east and north that stands at its nominal place: one less than its cells where the
/// data's last cell is narrower.
#[must_use]
pub fn full_cells(lattice: Lattice, level: u32, rect: Rect) -> [u32; 2] {
    [0, 1].map(|a: usize| {
        let whole = (lattice.last[a] >> level) - rect.lo[a];
        rect.hi[a].abs_diff(rect.lo[a]).min(u32::try_from(whole).unwrap_or(0))
    })
}

/// True when a node is among those of `rows`: bit x of row y.
pub(crate) fn has(rows: &[u32; BLOCK_NODES], [x, y]: [u32; 2]) -> bool {
    (rows[y as usize] >> x) & 1 == 1
}

/// A patch's own nodes when it wishes for those of `rows`: with the corners of its cells, what is forced and all
/// parents, without what lies outside. Slow and obvious.
#[must_use]
pub fn closed(cells: [u32; 2], full: [u32; 2], rows: [u32; BLOCK_NODES]) -> [u32; BLOCK_NODES] {
    let mut own = [0; BLOCK_NODES];
    for node in block_nodes().filter(|node| is_inside(cells, *node)) {
        let is_corner = (0..2).all(|a| node[a] == 0 || node[a] == cells[a]);
        if is_corner || has(&rows, node) || is_forced(cells, full, node) {
            own[node[1] as usize] |= 1 << node[0];
        }
    }
    loop {
        let before = own;
        for node in block_nodes().filter(|node| has(&before, *node)) {
            for [x, y] in parents(node).into_iter().filter(|parent| is_inside(cells, *parent)) {
                own[y as usize] |= 1 << x;
            }
        }
        if own == before {
            return own;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::full_cells;
    use crate::clipmap::{Lattice, Rect};

    #[test]
    fn the_last_node_at_its_nominal_place_is_found() {
        for last in 20..300_i32 {
            let lattice = Lattice { last: [last, 300] };
            for level in 0..=lattice.coarsest_level() {
                let end = lattice.last_at(level);
                for lo in (0..end[0]).step_by(16) {
                    let rect = Rect { lo: [lo, 0], hi: [(lo + 16).min(end[0]), end[1].min(16)] };
                    let nominal = |k: &i32| lattice.base(level, [*k, 0])[0] == *k << level;
                    let wanted = (lo..=rect.hi[0]).rfind(nominal).unwrap() - lo;
                    let found = full_cells(lattice, level, rect)[0].cast_signed();
                    assert_eq!(found, wanted, "{last} {level} {lo}");
                }
            }
        }
    }
}
