//! Factors by error: a patch is one block of the pyramid whose vertices are chosen one by one; each side has the
//! vertices that either of both patches which meet there wishes for.
//!
//! A patch's own nodes are closed (see [`super::closed`]), so they make a mesh without cracks by themselves. What
//! only the patch beyond a side wishes for is an extra vertex of that side: the triangle whose edge it divides is
//! fanned, and nothing inside the patch follows from it.

use std::cmp::Ordering;

use super::nodes::has;
use super::{BLOCK_NODES, PATCH_CELLS, Patch, block_nodes};
use crate::clipmap::{Lattice, Rect, Side, Windows};

/// Which vertices a patch has whose factors go by error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ByError {
    /// Own nodes: bit x of row y.
    pub rows: [u32; BLOCK_NODES],
    /// Extra vertices of the south, north, west and east side: bit j stands j half cells from its west or south end.
    pub extras: [u32; 4],
}

impl ByError {
    /// True for own nodes.
    #[must_use]
    pub fn has(&self, node: [u32; 2]) -> bool {
        has(&self.rows, node)
    }

    /// True where a side has an extra vertex.
    #[must_use]
    pub fn has_extra(&self, side: usize, j: u32) -> bool {
        (self.extras[side] >> j) & 1 == 1
    }

    /// Own nodes of a patch.
    fn own(&self) -> u32 {
        self.rows.iter().map(|row| row.count_ones()).sum()
    }

    /// Own nodes that lie on none of its sides.
    fn inner(&self, cells: [u32; 2]) -> u32 {
        let is_inner = |node: &[u32; 2]| (0..2).all(|a| 0 < node[a] && node[a] < cells[a]);
        block_nodes().filter(is_inner).map(|node| u32::from(self.has(node))).sum()
    }

    /// Vertices a patch has.
    #[must_use]
    pub fn vertex_count(&self) -> u32 {
        self.own() + self.extras.iter().map(|side| side.count_ones()).sum::<u32>()
    }

    /// Triangles a patch of so many cells has: by Euler's formula two for every vertex inside, one for every vertex
    /// on a side between its corners, and two.
    #[must_use]
    pub fn triangle_count(&self, cells: [u32; 2]) -> u32 {
        (self.vertex_count() + self.inner(cells)).saturating_sub(2)
    }

    /// Places of the vertices of a patch of so many cells, in half cells from its low corner: own nodes row by row
    /// from the south, then extra ones of the south, north, west and east side.
    #[must_use]
    pub fn places(&self, cells: [u32; 2]) -> Vec<[u32; 2]> {
        let own = block_nodes().filter(|node| self.has(*node)).map(|node| node.map(|v| 2 * v));
        let on_side = |side: usize| {
            let all = (1..2 * PATCH_CELLS).filter(move |j| self.has_extra(side, *j));
            all.map(move |j| side_place(cells, side, j))
        };
        own.chain((0..4).flat_map(on_side)).collect()
    }
}

/// Place of half cell `j` of a side of a patch of so many cells, in half cells from the patch's low corner.
#[must_use]
pub fn side_place(cells: [u32; 2], side: usize, j: u32) -> [u32; 2] {
    let is_high = side % 2 == 1;
    match side {
        0 | 1 => [j, if is_high { 2 * cells[1] } else { 0 }],
        _ => [if is_high { 2 * cells[0] } else { 0 }, j],
    }
}

/// What lies beyond half a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Beyond {
    /// Its level: the same, the next finer or the next coarser one.
    pub level: u32,
    /// Its block in that level.
    pub block: [i32; 2],
}

impl Beyond {
    /// Index along our shared side of its node at half cell `j` of our half `half`; `None` where it has none there.
    fn node(&self, level: u32, block_along: i32, half: u32, j: u32) -> Option<u32> {
        match self.level.cmp(&level) {
            Ordering::Less => j.checked_sub(16 * half),
            Ordering::Equal => j.is_multiple_of(2).then_some(j / 2),
            Ordering::Greater => {
                let first = if block_along.rem_euclid(2) == 0 { 0 } else { 8 };
                j.is_multiple_of(4).then_some(first + j / 4)
            }
        }
    }
}

/// Blocks a level would draw if no finer one did, first and last.
fn drawn(windows: &Windows, level: u32) -> Rect {
    let area = windows.loaded(level);
    let cells = PATCH_CELLS as i32;
    Rect { lo: area.lo.map(|v| v.div_euclid(cells)), hi: area.hi.map(|v| (v - 1).div_euclid(cells)) }
}

/// The block beyond half `half` (0: its west or south half) of a side of a block; `None` where nothing is drawn.
#[must_use]
pub fn beyond(windows: &Windows, level: u32, block: [i32; 2], side: Side, half: i32) -> Option<Beyond> {
    let (along, across) = (side.along(), 1 - side.along());
    let mut next = block;
    next[across] += if side.is_high() { 1 } else { -1 };
    if !drawn(windows, level).contains(next) {
        let coarse = next.map(|v| v.div_euclid(2));
        // Where the data ends the block beyond may be our own parent: nothing is drawn there.
        let parent = coarse[across] == block[across].div_euclid(2);
        let exists =
            !parent && level + 1 < windows.shape.levels() && drawn(windows, level + 1).contains(coarse);
        return exists.then_some(Beyond { level: level + 1, block: coarse });
    }
    if level > windows.finest {
        let fine = drawn(windows, level - 1);
        if fine.contains(next.map(|v| 2 * v)) {
            let mut at = next.map(|v| 2 * v);
            at[along] += half;
            at[across] += i32::from(!side.is_high());
            return fine.contains(at).then_some(Beyond { level: level - 1, block: at });
        }
    }
    Some(Beyond { level, block: next })
}

/// True when half cell `j` of a patch's side lies between its corners: before the data's end, where the last cell
/// may have no middle.
fn is_between(lattice: Lattice, patch: &Patch, along: usize, j: u32) -> bool {
    let nominal = ((2 * i64::from(patch.rect.lo[along]) + i64::from(j)) << patch.level) >> 1;
    j < 2 * patch.cells()[along] && nominal < i64::from(lattice.last[along])
}

/// The patch with its own nodes, and the extras its neighbours' own nodes give it. `own` is asked by level and
/// block; what it tells must be closed.
#[must_use]
pub fn by_error(
    windows: &Windows,
    patch: &Patch,
    own: &dyn Fn(u32, [i32; 2]) -> [u32; BLOCK_NODES],
) -> Patch {
    let (level, cells) = (patch.level, patch.cells());
    let block = patch.rect.lo.map(|v| v.div_euclid(PATCH_CELLS as i32));
    let mut out = ByError { rows: own(level, block), extras: [0; 4] };
    for side in Side::ALL {
        let along = side.along();
        for half in 0..2 {
            let Some(there) = beyond(windows, level, block, side, half) else { continue };
            let theirs = own(there.level, there.block);
            // Beyond a low side lies another block's high one, and it is whole there.
            let line = if side.is_high() { 0 } else { PATCH_CELLS };
            let half = half.unsigned_abs();
            // The middle belongs to both halves: of two finer blocks both have it.
            let from = (16 * half).max(1);
            for j in (from..=16 * half + 16).filter(|j| is_between(windows.lattice, patch, along, *j)) {
                let Some(t) = there.node(level, block[along], half, j) else { continue };
                let is_theirs = has(&theirs, if along == 0 { [t, line] } else { [line, t] });
                let ours = side_place(cells, side as usize, j).map(|v| v / 2);
                if is_theirs && !(j.is_multiple_of(2) && out.has(ours)) {
                    out.extras[side as usize] |= 1 << j;
                }
            }
        }
    }
    Patch { outer: Default::default(), by_error: Some(out), ..*patch }
}
