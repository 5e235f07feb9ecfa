//! The nested sample lattices of a finite height grid.

/// Closed rectangle of lattice indices, `lo..=hi` on both axes; empty when `hi < lo`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// Low corner (west, south).
    pub lo: [i32; 2],
    /// High corner (east, north), included.
    pub hi: [i32; 2],
}

impl Rect {
    /// The part common to both rectangles.
    #[must_use]
    pub fn intersect(self, other: Self) -> Self {
        let axis = |a: usize| (self.lo[a].max(other.lo[a]), self.hi[a].min(other.hi[a]));
        let (x, y) = (axis(0), axis(1));
        Self { lo: [x.0, y.0], hi: [x.1, y.1] }
    }

    /// True when the rectangle holds no index at all.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.hi[0] < self.lo[0] || self.hi[1] < self.lo[1]
    }

    /// True when the rectangle encloses at least one whole cell, so that triangles can lie in it.
    #[must_use]
    pub fn has_area(self) -> bool {
        self.hi[0] > self.lo[0] && self.hi[1] > self.lo[1]
    }

    /// True when `p` lies in the closed rectangle.
    #[must_use]
    pub fn contains(self, p: [i32; 2]) -> bool {
        (0..2).all(|a| self.lo[a] <= p[a] && p[a] <= self.hi[a])
    }

    /// True when `p` lies on the rectangle's border.
    #[must_use]
    pub fn on_perimeter(self, p: [i32; 2]) -> bool {
        self.contains(p) && (0..2).any(|a| p[a] == self.lo[a] || p[a] == self.hi[a])
    }

    /// Number of indices inside, 0 when empty.
    #[must_use]
    pub fn count(self) -> u64 {
        if self.is_empty() {
            return 0;
        }
        let side = |a: usize| u64::from(self.hi[a].abs_diff(self.lo[a])) + 1;
        side(0) * side(1)
    }
}

/// The base lattice (level 0) of a finite grid and the coarser lattices nested in it.
///
/// Node `i` of level `l` stands at base index `min(i * 2^l, last)`. The clamp lets every level
/// reach the data's far border although its size is rarely a multiple of `2^l` (Brettell 2005,
/// Eq. 3.4 cuts the remainder off instead): the last column of cells is narrower, nothing is lost,
/// and node `i` of level `l + 1` is still node `2 i` of level `l`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lattice {
    /// Base index of the last sample on each axis (samples - 1).
    pub last: [i32; 2],
}

impl Lattice {
    /// All base indices.
    #[must_use]
    pub fn domain(self) -> Rect {
        Rect { lo: [0, 0], hi: self.last }
    }

    /// Index of the last node of `level` on each axis.
    #[must_use]
    pub fn last_at(self, level: u32) -> [i32; 2] {
        self.last.map(|v| ceil_shift(v, level))
    }

    /// Base index of node `index` of `level`.
    #[must_use]
    pub fn base(self, level: u32, index: [i32; 2]) -> [i32; 2] {
        [(index[0] << level).min(self.last[0]), (index[1] << level).min(self.last[1])]
    }

    /// Base index along `axis` of a node that may lie beyond the data, where the lattice continues evenly.
    #[must_use]
    pub fn base_beyond(self, level: u32, axis: usize, node: i32) -> i64 {
        let (last, end) = (self.last[axis], self.last_at(level)[axis]);
        if node > end {
            i64::from(last) + (i64::from(node - end) << level)
        } else if node == end {
            i64::from(last)
        } else {
            i64::from(node) << level
        }
    }

    /// Node of `level` at base index `base`, which must be a node of that level.
    #[must_use]
    pub fn node(self, level: u32, base: [i32; 2]) -> [i32; 2] {
        base.map(|v| ceil_shift(v, level))
    }

    /// Coarsest level that still has a cell on both axes and more than one on either.
    #[must_use]
    pub fn coarsest_level(self) -> u32 {
        let longest = self.last[0].max(self.last[1]).max(1);
        (32 - (longest - 1).leading_zeros()).min(super::MAX_LEVELS - 1)
    }
}

fn ceil_shift(v: i32, level: u32) -> i32 {
    (v + (1 << level) - 1) >> level
}
