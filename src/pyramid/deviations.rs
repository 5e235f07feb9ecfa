//! How far coarser triangles lie from the full-resolution surface, block by block: what factors by error go
//! by.
//!
//! A block is one place of a patch: 16 x 16 cells of a level, aligned to multiples of 16 in its lattice. Its
//! mesh is a right-triangulated irregular network (Evans, Kirkpatrick and Townsend 2001): two right
//! triangles, bisected at the middle of their hypotenuse wherever that node is a vertex. A node's rank tells
//! how early: 8 for the middle of the block, 7 for those of its sides, and so on down to 1; the block's
//! corners are always there.

mod measure;
mod triangles;

#[cfg(feature = "store")]
pub(crate) use measure::{Below, Samples, Surfaces};

use bytemuck::{Pod, Zeroable};

use super::SampleSource;
use crate::clipmap::{Lattice, Rect};

/// Cells a side of a block, the same as of a patch.
pub const BLOCK_CELLS: u32 = 16;

/// Figures of a block, one a rank: 0, where nothing is left out, to 8, where nothing is left but two
/// triangles.
pub const FIGURES: usize = 9;

/// Stands for what is not known: the greatest finite figure.
const UNKNOWN_BITS: u16 = 0x7f7f;

/// Worst vertical deviation of one block without its nodes up to each rank, metres, each rounded up to the
/// high half of an f32 (7 bits after the leading one: at most 0.8 % too much).
///
/// Nodes that stay whatever is left out, because the data ends within a triangle, stay here. What neighbours
/// may add to the block's sides is allowed for. With nothing left out the figure holds for the uniform grid
/// as well, whose cells are all cut from south-east to north-west.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct BlockDeviation([u16; FIGURES]);

impl BlockDeviation {
    /// Nothing is known: where figure 0 is unknown nothing is left out, where another is, it sets no limit.
    pub const UNKNOWN: Self = Self([UNKNOWN_BITS; FIGURES]);

    /// Rounded up; what is no finite number counts as unknown.
    #[must_use]
    pub fn of(metres: [f32; FIGURES]) -> Self {
        Self(metres.map(|m| {
            let bits = m.max(0.0).to_bits();
            if !m.is_finite() || bits > u32::from(UNKNOWN_BITS) << 16 {
                return UNKNOWN_BITS;
            }
            u16::try_from(bits.div_ceil(1 << 16)).unwrap_or(UNKNOWN_BITS)
        }))
    }

    /// Deviation without any node of rank `k` or less, metres.
    #[must_use]
    pub fn metres(self, k: usize) -> f32 {
        f32::from_bits(u32::from(self.0[k]) << 16)
    }

    /// From the bits as they are stored; `None` where one is no distance.
    #[cfg(feature = "store")]
    pub(crate) fn from_bits(bits: [u16; FIGURES]) -> Option<Self> {
        bits.iter().all(|b| *b <= UNKNOWN_BITS).then_some(Self(bits))
    }

    /// The bits to be stored.
    #[cfg(feature = "store")]
    pub(crate) fn bits(self) -> [u16; FIGURES] {
        self.0
    }

    /// The same heights times a factor.
    #[must_use]
    pub fn scaled(self, factor: f32) -> Self {
        let mut metres = [0.0; FIGURES];
        for (k, m) in metres.iter_mut().enumerate() {
            *m = if self.0[k] == UNKNOWN_BITS { f32::INFINITY } else { self.metres(k) * factor.abs() };
        }
        Self::of(metres)
    }

    /// As the GPU reads it: two ranks a word, the lower one in the low half.
    #[must_use]
    pub(crate) fn words(self) -> [u32; FIGURES.div_ceil(2)] {
        let half = |k: usize| u32::from(self.0.get(k).copied().unwrap_or(0));
        [0, 1, 2, 3, 4].map(|word: usize| half(2 * word) | half(2 * word + 1) << 16)
    }
}

/// Blocks east and north that a level has.
#[must_use]
pub fn blocks_at(lattice: Lattice, level: u32) -> [i32; 2] {
    lattice.last_at(level).map(|last| last.div_euclid(16) + i32::from(last % 16 != 0)).map(|n| n.max(1))
}

/// Deviations of all blocks of all levels.
#[derive(Clone, Debug, PartialEq)]
pub struct Deviations {
    levels: Vec<Level>,
}

#[derive(Clone, Debug, PartialEq)]
struct Level {
    size: [i32; 2],
    blocks: Vec<BlockDeviation>,
}

impl Deviations {
    /// Measures every block of a source against all its full-resolution samples. Reads every level whole.
    #[must_use]
    pub fn of(source: &dyn SampleSource) -> Self {
        measure::measure(source)
    }

    /// From all blocks of each level, row by row from the south-west; a level without any is unknown.
    #[cfg(feature = "store")]
    pub(crate) fn from_levels(lattice: Lattice, levels: Vec<Vec<BlockDeviation>>) -> Self {
        let levels = levels.into_iter().zip(0..);
        Self { levels: levels.map(|(blocks, l)| Level { size: blocks_at(lattice, l), blocks }).collect() }
    }

    /// Of positions, from those of their three coordinates; `more_m` is added to each.
    pub(crate) fn of_positions(axes: &[Self; 3], more_m: f32) -> Self {
        let [x, y, z] = axes;
        let block = |l: usize, k: usize| {
            let mut metres = [0.0; FIGURES];
            for (rank, m) in metres.iter_mut().enumerate() {
                let squares = [x, y, z].map(|a| f64::from(a.levels[l].blocks[k].metres(rank)).powi(2));
                let unknown = [x, y, z].iter().any(|a| a.levels[l].blocks[k].0[rank] == UNKNOWN_BITS);
                let length = squares.iter().sum::<f64>().sqrt() as f32;
                *m = if unknown { f32::INFINITY } else { length.next_up() + more_m };
            }
            BlockDeviation::of(metres)
        };
        let level = |(l, own): (usize, &Level)| Level {
            size: own.size,
            blocks: (0..own.blocks.len()).map(|k| block(l, k)).collect(),
        };
        Self { levels: x.levels.iter().enumerate().map(level).collect() }
    }

    /// Appends those of `blocks` of a level, row by row from the south-west; unknown beyond the data.
    pub fn read(&self, level: u32, blocks: Rect, out: &mut Vec<BlockDeviation>) {
        for y in blocks.lo[1]..=blocks.hi[1] {
            for x in blocks.lo[0]..=blocks.hi[0] {
                out.push(self.at(level, [x, y]).unwrap_or(BlockDeviation::UNKNOWN));
            }
        }
    }

    fn at(&self, level: u32, [x, y]: [i32; 2]) -> Option<BlockDeviation> {
        let level = self.levels.get(level as usize)?;
        if !(0..level.size[0]).contains(&x) || !(0..level.size[1]).contains(&y) {
            return None;
        }
        level.blocks.get((y * level.size[0] + x).unsigned_abs() as usize).copied()
    }

    /// Bytes of all figures.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.levels.iter().map(|l| size_of_val(&l.blocks[..]) as u64).sum()
    }
}
