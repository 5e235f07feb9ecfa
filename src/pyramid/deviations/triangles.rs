//! The right triangles that a block's meshes are made of: two, bisected again and again at the middle of
//! their hypotenuse (Evans, Kirkpatrick and Townsend 2001). A triangle has the rank of the node that would
//! bisect it, 8 for the two whole ones; those that nothing bisects have rank 0.

use super::{BLOCK_CELLS, FIGURES};

const CELLS: usize = BLOCK_CELLS as usize;
const CELLS_LOG2: usize = CELLS.ilog2() as usize;

/// A right triangle, in nodes from its block's south-west corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corners {
    /// Where its right angle is.
    pub apex: [usize; 2],
    /// Ends of its hypotenuse: from west to east or from south to north where it runs so; else the first one
    /// lies east or west of the right angle, the other one north or south of it.
    pub ends: [[usize; 2]; 2],
}

impl Corners {
    /// Half of a square, cut from south-west to north-east (`rises`) or from south-east to north-west.
    fn half([x, y]: [usize; 2], side: usize, rises: bool, part: usize) -> Self {
        let (east, north) = (part ^ usize::from(rises), part);
        let at = |east: usize, north: usize| [x + east * side, y + north * side];
        Self { apex: at(east, north), ends: [at(1 - east, north), at(east, 1 - north)] }
    }

    /// Quarter of a square, its right angle in the middle: south, north, west, east.
    fn quarter(lo: [usize; 2], side: usize, part: usize) -> Self {
        let (along, high) = (part / 2, part % 2);
        let mut from = lo;
        from[1 - along] += high * side;
        let mut to = from;
        to[along] += side;
        Self { apex: lo.map(|v| v + side / 2), ends: [from, to] }
    }

    /// The node that would bisect it; none of rank 0.
    fn middle(&self) -> [usize; 2] {
        let [from, to] = self.ends;
        [0, 1].map(|a: usize| (from[a] + to[a]) / 2)
    }

    fn low(&self, a: usize) -> usize {
        self.apex[a].min(self.ends[0][a]).min(self.ends[1][a])
    }

    fn high(&self, a: usize) -> usize {
        self.apex[a].max(self.ends[0][a]).max(self.ends[1][a])
    }
}

/// log2 of the side, in cells, of the squares that triangles of a rank fill: by halves for even ranks, by
/// quarters for odd ones.
const fn side_log2(rank: usize) -> usize {
    rank.div_ceil(2)
}

/// Triangles of a rank in a whole block. Of rank 0 there are more than fit: last come those of the uniform
/// grid where its diagonal is the other one.
pub(super) fn count(rank: usize) -> usize {
    let squares = 1 << (2 * (CELLS_LOG2 - side_log2(rank)));
    let parts = if rank == 0 { 3 } else { 2 + 2 * (rank % 2) };
    squares * parts
}

/// One of them.
pub(super) fn nth(rank: usize, number: usize) -> Corners {
    let log2 = side_log2(rank);
    if rank == 0 && number >= 2 * CELLS * CELLS {
        // Every other cell, those that the network cuts from south-west to north-east.
        let square = (number - 2 * CELLS * CELLS) / 2;
        let y = 2 * square / CELLS;
        return Corners::half([2 * square % CELLS + y % 2, y], 1, false, number % 2);
    }
    let odd = rank % 2;
    let (square, part) = (number >> (1 + odd), number & (1 + 2 * odd));
    let place = [square & ((CELLS >> log2) - 1), square >> (CELLS_LOG2 - log2)];
    let lo = place.map(|v| v << log2);
    if odd == 1 {
        return Corners::quarter(lo, 1 << log2, part);
    }
    // The first cut goes from south-east to north-west, later ones through the middles of squares cut before.
    let rises = log2 < CELLS_LOG2 && (place[0] + place[1]).is_multiple_of(2);
    Corners::half(lo, 1 << log2, rises, part)
}

/// Where the data ends in a block that is not whole.
pub(super) struct End {
    /// Cells there are, east and north.
    cells: [usize; 2],
    /// Last node that stands at its nominal place.
    full: [usize; 2],
    /// Nodes that are vertices whatever is left out: bit x of row y.
    always: [u32; CELLS + 1],
}

impl End {
    /// `None` for a whole block.
    pub fn of(cells: [usize; 2], full: [usize; 2]) -> Option<Self> {
        if full == [CELLS; 2] {
            return None;
        }
        let mut end = Self { cells, full, always: [0; CELLS + 1] };
        for rank in 1..FIGURES {
            let all = || (0..count(rank)).map(move |number| nth(rank, number));
            for corners in all() {
                if end.straddled_by(&corners) {
                    end.keep(corners.middle());
                }
            }
            // Two triangles share a hypotenuse: the other one must be there as well, with its right angle.
            for corners in all() {
                if end.keeps(corners.middle()) {
                    end.keep(corners.apex);
                }
            }
        }
        Some(end)
    }

    /// Whether the mesh without any node up to a rank has this triangle of that rank.
    pub fn has(&self, rank: usize, corners: &Corners) -> bool {
        if self.excludes(corners) {
            return false;
        }
        rank == 0 || !(self.straddled_by(corners) || self.keeps(corners.middle()))
    }

    fn excludes(&self, corners: &Corners) -> bool {
        (0..2).any(|a| corners.low(a) >= self.cells[a])
    }

    /// Whether it is bisected because the data ends within it.
    fn straddled_by(&self, corners: &Corners) -> bool {
        !self.excludes(corners) && (0..2).any(|a| corners.high(a) > self.full[a])
    }

    fn keep(&mut self, [x, y]: [usize; 2]) {
        self.always[y] |= 1 << x;
    }

    fn keeps(&self, [x, y]: [usize; 2]) -> bool {
        (self.always[y] >> x) & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::{CELLS, Corners, End, FIGURES, count, nth};

    fn all(rank: usize) -> Vec<Corners> {
        (0..count(rank)).map(|number| nth(rank, number)).collect()
    }

    /// Twice the area; negative when the right angle is seen clockwise.
    fn area(c: &Corners) -> i64 {
        let off = |p: [usize; 2]| [0, 1].map(|a: usize| p[a] as i64 - c.apex[a] as i64);
        let [u, v] = c.ends.map(off);
        assert_eq!(u[0] * v[0] + u[1] * v[1], 0, "{c:?}");
        u[0] * v[1] - u[1] * v[0]
    }

    #[test]
    fn triangles_of_a_rank_fill_the_block_and_are_halves_of_those_above() {
        for rank in 0..FIGURES {
            let found = all(rank);
            let plain = if rank == 0 { &found[..2 * CELLS * CELLS] } else { &found[..] };
            assert_eq!(plain.iter().map(|c| area(c).abs()).sum::<i64>(), 2 * 256, "{rank}");
            for above in if rank + 1 < FIGURES { all(rank + 1) } else { Vec::new() } {
                for end in above.ends {
                    let halves = plain.iter().filter(|c| {
                        c.apex == above.middle() && c.ends.contains(&end) && c.ends.contains(&above.apex)
                    });
                    assert_eq!(halves.count(), 1, "{above:?} of rank {}", rank + 1);
                }
            }
        }
    }

    #[test]
    fn the_uniform_grid_comes_with_the_finest_triangles() {
        let found = all(0);
        for (x, y) in (0..CELLS).flat_map(|y| (0..CELLS).map(move |x| (x, y))) {
            for part in 0..2 {
                assert!(found.contains(&Corners::half([x, y], 1, false, part)), "{x} {y}");
            }
        }
    }

    #[test]
    fn only_blocks_in_which_the_data_ends_keep_nodes() {
        assert!(End::of([16, 16], [16, 16]).is_none());
        // The last column is narrower: both whole triangles straddle it, and their halves.
        let end = End::of([16, 16], [15, 16]).unwrap();
        assert!(all(8).iter().all(|c| !end.has(8, c)));
        assert!(end.keeps([8, 8]) && end.keeps([15, 15]) && !end.keeps([1, 1]));
        // Bisected for the sake of what lies north of it.
        let end = End::of([16, 10], [16, 10]).unwrap();
        assert!(end.keeps([4, 8]) && end.keeps([4, 4]));
    }
}
