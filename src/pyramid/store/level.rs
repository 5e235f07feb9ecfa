//! Geometry of one level of a store: nodes count from the south-west, array rows and tiles from the north.

use super::{SHARD, SHARD_TILES, TILE};
use crate::clipmap::Rect;

/// One tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TileKey {
    /// Level, 0 is the finest.
    pub level: u32,
    /// Column of tiles from the west.
    pub column: u32,
    /// Row of tiles from the north.
    pub row: u32,
}

impl std::fmt::Display for TileKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "level {}, tile column {} row {}", self.level, self.column, self.row)
    }
}

/// Figures of one tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileStats {
    /// Lowest height, metres; NaN when all is void.
    pub min_m: f32,
    /// Highest height, metres; NaN when all is void.
    pub max_m: f32,
    /// Mean height, metres; NaN when all is void.
    pub mean_m: f32,
    /// Greatest vertical distance between this level's surface and the samples of the next finer level
    /// under the tile, metres; 0 on level 0.
    pub error_m: f32,
    /// Void samples inside the data.
    pub voids: u32,
}

/// Figures a tile as stored.
pub(crate) const FIGURES: usize = 5;

impl TileStats {
    pub(crate) fn to_figures(self) -> [f32; FIGURES] {
        // Up to 65,536 voids: exact in f32.
        [self.min_m, self.max_m, self.mean_m, self.error_m, self.voids as f32]
    }

    pub(crate) fn from_figures(f: &[f32]) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "written from u32")]
        Self { min_m: f[0], max_m: f[1], mean_m: f[2], error_m: f[3], voids: f[4] as u32 }
    }

    /// Same extremes and voids, bit for bit (NaN is like NaN).
    pub(crate) fn agrees(&self, other: &Self) -> bool {
        let same = |a: f32, b: f32| a == b || (a.is_nan() && b.is_nan());
        same(self.min_m, other.min_m) && same(self.max_m, other.max_m) && self.voids == other.voids
    }
}

/// Size of a level in samples and what follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Level {
    /// Number, 0 is the finest.
    pub number: u32,
    /// Columns and rows.
    pub size: [u64; 2],
}

impl Level {
    /// Tile columns and rows.
    pub fn tiles(self) -> [u32; 2] {
        // Sides fit an i32, so their number of tiles does.
        self.size.map(|s| u32::try_from(s.div_ceil(TILE as u64)).unwrap_or(u32::MAX))
    }

    /// Shard columns and rows.
    pub fn shards(self) -> [u64; 2] {
        self.size.map(|s| s.div_ceil(SHARD as u64))
    }

    /// Place of a tile in lists of all tiles of the level.
    pub fn tile_index(self, column: u32, row: u32) -> usize {
        row as usize * self.tiles()[0] as usize + column as usize
    }

    /// Name of the shard that holds a tile.
    pub fn shard_file(self, column: u32, row: u32) -> String {
        let (x, y) = (column as usize / SHARD_TILES, row as usize / SHARD_TILES);
        format!("{}/elevation/c/{y}/{x}", self.number)
    }

    /// Array row of a node.
    pub fn row_of(self, node_y: i32) -> u64 {
        self.size[1].saturating_sub(1).saturating_sub(u64::try_from(node_y).unwrap_or(0))
    }

    /// Tiles that hold the nodes of a rectangle inside the level: first and last column, first and last row.
    pub fn tiles_of(self, rect: Rect) -> ([u32; 2], [u32; 2]) {
        let tile = |sample: u64| u32::try_from(sample / TILE as u64).unwrap_or(u32::MAX);
        let column = |x: i32| tile(u64::try_from(x).unwrap_or(0));
        (
            [column(rect.lo[0]), column(rect.hi[0])],
            [tile(self.row_of(rect.hi[1])), tile(self.row_of(rect.lo[1]))],
        )
    }

    /// Nodes that a tile holds.
    pub fn rect_of(self, column: u32, row: u32) -> Rect {
        let last = self.size.map(|s| s as i64 - 1);
        let west = i64::from(column) * TILE as i64;
        let north = last[1] - i64::from(row) * TILE as i64;
        let fit = |v: i64| i32::try_from(v).unwrap_or(i32::MAX);
        Rect {
            lo: [fit(west), fit((north - TILE as i64 + 1).max(0))],
            hi: [fit((west + TILE as i64 - 1).min(last[0])), fit(north)],
        }
    }
}

/// Sizes of all levels of a store over `size` samples: down to the first that fits one tile.
pub(crate) fn levels_of(size: [u64; 2]) -> Vec<Level> {
    let mut out = vec![Level { number: 0, size }];
    while let Some(last) = out.last().copied() {
        if last.size.iter().all(|s| *s <= TILE as u64) {
            break;
        }
        let size = last.size.map(|s| s.saturating_sub(1).div_ceil(2) + 1);
        out.push(Level { number: last.number + 1, size });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clipmap::Lattice;

    #[test]
    fn levels_have_the_nodes_of_the_lattice() {
        for size in [[2, 2], [256, 256], [257, 2], [1201, 1000], [65_537, 16_385]] {
            let lattice = Lattice { last: size.map(|s: u64| i32::try_from(s - 1).unwrap()) };
            let levels = levels_of(size);
            for level in &levels {
                let last = lattice.last_at(level.number);
                assert_eq!(level.size, last.map(|l| u64::try_from(l).unwrap() + 1));
            }
            let fits = |l: &Level| l.size.iter().all(|s| *s <= 256);
            assert_eq!(levels.iter().filter(|l| fits(l)).count(), 1, "only the last fits one tile");
        }
    }

    #[test]
    fn tiles_and_rectangles_agree() {
        let level = Level { number: 0, size: [1201, 700] };
        assert_eq!(level.tiles(), [5, 3]);
        let mut covered = 0;
        for row in 0..3 {
            for column in 0..5 {
                let rect = level.rect_of(column, row);
                covered += rect.count();
                assert_eq!(level.tiles_of(rect), ([column, column], [row, row]));
            }
        }
        assert_eq!(covered, 1201 * 700);
    }
}
