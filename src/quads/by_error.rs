//! Factors by error: a patch is one block of the pyramid, drawn with steps of 1 to 16 cells; each half of its sides
//! takes the finer wish of both patches that meet there.
//!
//! An edge's chain is named by an exponent: its vertices lie `2^exponent` base samples apart. A patch of level `l`
//! with a step of `2^k` cells wishes for `l + k`; the edge has the smaller wish. That holds across the border of a
//! level as well, where the finer level's steps are smaller by nature: doubling is the case `k = 0` on both sides.

use super::{PATCH_CELLS, Patch};
use crate::clipmap::{Rect, Side, Windows};

/// Step and divisions of a patch whose factors go by error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ByError {
    /// log2 of the cells a step spans, 0 to 4.
    pub step: u32,
    /// log2 of the segments a step has on the south, north, west and east side: in the side's first 8 cells, then
    /// in the others. Equal where one step spans both.
    pub log2: [[u32; 2]; 4],
    /// Segments that each side's last step lacks, because the data ends before it would.
    pub lost: [u32; 4],
}

impl ByError {
    /// log2 of the segments that a whole step has where step `at` of a side lies.
    #[must_use]
    pub fn log2_at(&self, side: usize, at: u32) -> u32 {
        self.log2[side][usize::from(at >= 8 >> self.step)]
    }

    /// Segments of step `at` of a side with `steps` steps.
    #[must_use]
    pub fn segments(&self, side: usize, at: u32, steps: u32) -> u32 {
        let lost = if at + 1 == steps { self.lost[side] } else { 0 };
        (1 << self.log2_at(side, at)) - lost
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

/// log2 of the largest step a block may take wherever it lies: beside a finer level the halves of a side differ,
/// so that no step may span both.
#[must_use]
pub fn most_step(windows: &Windows, level: u32, block: [i32; 2]) -> u32 {
    let finer = |side: Side, half| beyond(windows, level, block, side, half).is_some_and(|b| b.level < level);
    let beside = Side::ALL.into_iter().any(|side| finer(side, 0) || finer(side, 1));
    if beside { 3 } else { 4 }
}

/// The patch with the factors that a field of steps gives it and its neighbours. `step_of` is asked for log2 of
/// the steps of blocks, never more than [`most_step`].
#[must_use]
pub fn by_error(windows: &Windows, patch: &Patch, step_of: &dyn Fn(u32, [i32; 2]) -> u32) -> Patch {
    let lattice = windows.lattice;
    let (level, cells) = (patch.level, PATCH_CELLS as i32);
    let block = patch.rect.lo.map(|v| v.div_euclid(cells));
    let step = step_of(level, block);
    let mut out = ByError { step, ..ByError::default() };
    for side in Side::ALL {
        let along = side.along();
        let (from, to) = (patch.rect.lo[along], patch.rect.hi[along]);
        for half in 0..2 {
            let wish = beyond(windows, level, block, side, half).map(|b| b.level + step_of(b.level, b.block));
            let exponent = wish.map_or(level + step, |w| w.min(level + step));
            out.log2[side as usize][half as usize] = level + step - exponent;
        }
        if to - from <= 8 || step == 4 {
            // One half only, or one step over both.
            out.log2[side as usize][1] = if step == 4 { out.log2[side as usize][0] } else { 0 };
        }
        // The last step ends where the data does.
        let steps = (to - from + (1 << step) - 1) >> step;
        let start = (from + ((steps - 1) << step)) << level;
        let mut end = [0, 0];
        end[along] = to;
        let length = lattice.base(level, end)[along] - start;
        let log2 = out.log2_at(side as usize, u32::try_from(steps - 1).unwrap_or(0));
        let exponent = level + step - log2;
        let segments = (length + (1 << exponent) - 1) >> exponent;
        out.lost[side as usize] = (1 << log2) - u32::try_from(segments).unwrap_or(1);
    }
    Patch { outer: Default::default(), by_error: Some(out), ..*patch }
}
