//! What geomipmapping knows about its patches beforehand (Brodersen 2005, section 4).

use rayon::prelude::*;

use super::grid::{cell_error, height_range, joined};
use crate::rivals::Ground;
use crate::rivals::stage::Stand;

/// Patches a side of a map block, the unit that is culled first.
pub(super) const BLOCK_PATCHES: u32 = 16;

/// Per patch the error of each level and the range of heights.
pub(crate) struct Tables {
    /// Cells a side of a patch.
    pub cells: u32,
    /// Levels of detail; the coarsest has two cells a side, as the paper's: 3 x 3 vertices.
    pub levels: u32,
    /// Patches east and north.
    pub patches: [u32; 2],
    /// Map blocks east and north.
    pub blocks: [u32; 2],
    last: [i32; 2],
    /// Metres; the levels of a patch one after the other.
    errors: Vec<f32>,
    ranges: Vec<[f32; 2]>,
    block_ranges: Vec<[f32; 2]>,
}

/// A box: base samples and heights.
pub(super) type Bounds = ([i32; 2], [i32; 2], [f32; 2]);

impl Tables {
    /// Measures every level of every patch against all its samples.
    #[must_use]
    pub fn of(ground: &Ground, patch_cells: u32) -> Self {
        let cells = patch_cells;
        let last = ground.last();
        let patches = last.map(|l| l.max(1).unsigned_abs().div_ceil(cells));
        let levels = cells.ilog2();
        let count = patches[0] as usize * patches[1] as usize;
        let mut errors = vec![0.0; count * levels as usize];
        let mut ranges = vec![[0.0; 2]; count];
        let made = errors.par_chunks_mut(levels as usize).zip(ranges.par_iter_mut()).enumerate();
        made.for_each(|(patch, (errors, range))| {
            let at = [patch as u32 % patches[0], patch as u32 / patches[0]];
            let (lo, hi) = extent(at, cells, last);
            *range = height_range(ground, lo, hi);
            for level in 1..levels as usize {
                let worst = level_error(ground, lo, cells, 1 << level);
                // A coarser level is never taken to be the better one.
                errors[level] = worst.max(errors[level - 1]);
            }
        });
        let blocks = patches.map(|p| p.div_ceil(BLOCK_PATCHES));
        let mut block_ranges =
            vec![[f32::INFINITY, f32::NEG_INFINITY]; blocks[0] as usize * blocks[1] as usize];
        for (patch, range) in (0_u32..).zip(&ranges) {
            let at = [patch % patches[0], patch / patches[0]].map(|v| v / BLOCK_PATCHES);
            let block = &mut block_ranges[(at[1] * blocks[0] + at[0]) as usize];
            *block = joined(*block, *range);
        }
        Self { cells, levels, patches, blocks, last, errors, ranges, block_ranges }
    }

    /// Number of a patch.
    pub fn number(&self, at: [u32; 2]) -> usize {
        at[1] as usize * self.patches[0] as usize + at[0] as usize
    }

    /// Patch of a number.
    pub fn place(&self, number: u32) -> [u32; 2] {
        [number % self.patches[0], number / self.patches[0]]
    }

    /// First sample of a patch.
    pub fn low(&self, at: [u32; 2]) -> [i32; 2] {
        at.map(|v| (v * self.cells).cast_signed())
    }

    /// Box of a patch.
    pub(super) fn bounds(&self, at: [u32; 2]) -> Bounds {
        let (lo, hi) = extent(at, self.cells, self.last);
        (lo, hi, self.ranges[self.number(at)])
    }

    /// Box of a map block.
    pub(super) fn block_bounds(&self, at: [u32; 2]) -> Bounds {
        let (lo, hi) = extent(at, self.cells * BLOCK_PATCHES, self.last);
        (lo, hi, self.block_ranges[(at[1] * self.blocks[0] + at[0]) as usize])
    }

    /// The coarsest level whose error is within the threshold from the nearest point of the patch's box.
    pub(super) fn level(&self, at: [u32; 2], stand: &Stand, pixel_error: f64) -> u32 {
        let (lo, hi, range) = self.bounds(at);
        let distance = stand.distance_m(lo, hi, range);
        let first = self.number(at) * self.levels as usize;
        let errors = &self.errors[first..first + self.levels as usize];
        errors.iter().rposition(|e| stand.error_px(*e, distance) <= pixel_error).unwrap_or(0) as u32
    }

    /// Bytes of all tables.
    pub fn bytes(&self) -> u64 {
        let ranges = size_of_val(&self.ranges[..]) + size_of_val(&self.block_ranges[..]);
        (size_of_val(&self.errors[..]) + ranges) as u64
    }
}

/// First and last sample of a square of `cells` cells a side.
fn extent(at: [u32; 2], cells: u32, last: [i32; 2]) -> ([i32; 2], [i32; 2]) {
    let lo = at.map(|v| (v * cells).cast_signed());
    (lo, [0, 1].map(|a| (lo[a] + cells.cast_signed()).min(last[a])))
}

/// Error of a patch whose cells are `step` samples wide.
fn level_error(ground: &Ground, lo: [i32; 2], cells: u32, step: i32) -> f32 {
    let last = ground.last();
    let inside = |a: usize| (lo[a]..(lo[a] + cells.cast_signed()).min(last[a])).step_by(step as usize);
    let errors = inside(1).flat_map(|y| inside(0).map(move |x| cell_error(ground, [x, y], step)));
    errors.fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::super::patterns::pattern;
    use super::*;
    use crate::rivals::geomipmap::check;

    #[test]
    fn errors_equal_those_of_the_triangles_drawn() {
        for (w, h) in [(21, 14), (2, 2), (2, 40), (9, 9), (17, 18)] {
            let ground = check::rough(w, h);
            let tables = Tables::of(&ground, 8);
            let (levels, last) = (tables.levels as usize, ground.last());
            assert_eq!(tables.errors.len(), levels * tables.ranges.len());
            for number in 0..tables.ranges.len() {
                let lo = tables.low(tables.place(number as u32));
                let mut worst = 0.0_f64;
                for level in 0..levels {
                    let numbers = pattern(8, level as u32, [0; 4]);
                    let triangles = check::triangles(&numbers, 8, lo, 1, last);
                    worst = worst.max(check::slow_error(&ground, &triangles));
                    let error = f64::from(tables.errors[number * levels + level]);
                    assert!(
                        (error - worst).abs() < 1e-4,
                        "{w} x {h}, {lo:?}, level {level}: {error}, {worst}"
                    );
                }
            }
        }
    }

    #[test]
    fn boxes_hold_all_their_samples() {
        let ground = check::rough(331, 262);
        let tables = Tables::of(&ground, 8);
        let holds = |(lo, hi, range): Bounds, p: [i32; 2]| {
            let height = ground.height(p);
            (0..2).all(|a| lo[a] <= p[a] && p[a] <= hi[a]) && range[0] <= height && height <= range[1]
        };
        for y in 0..=ground.last()[1] {
            for x in 0..=ground.last()[0] {
                let at = [0, 1].map(|a| ([x, y][a] as u32 / 8).min(tables.patches[a] - 1));
                assert!(holds(tables.bounds(at), [x, y]));
                assert!(holds(tables.block_bounds(at.map(|v| v / BLOCK_PATCHES)), [x, y]));
            }
        }
    }

    #[test]
    fn flat_data_takes_the_coarsest_level() {
        let tables = Tables::of(&check::ground(40, 40, |_, _| 7.0), 16);
        let stand = check::stand(glam::DVec3::new(20.0, 20.0, 7.0));
        assert_eq!(tables.level([1, 1], &stand, 0.0), 3);
    }
}
