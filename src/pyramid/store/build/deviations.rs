//! Deviations of all blocks, measured from the levels just written.
//!
//! Level `l` is measured against level `l - 3`, whose own deviations are added: so no more than 2,049 x 2,049 samples
//! are held for 16 x 16 blocks, however coarse the level. Levels 0 to 3 are all measured against level 0, in one go.

use std::collections::HashMap;
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};

use zarrs::array::Array;

use super::Build;
use super::readback::ReadBack;
use crate::clipmap::Rect;
use crate::pyramid::deviations::{Below, Samples, Surfaces};
use crate::pyramid::store::codec::one_thread;
use crate::pyramid::store::deviations::Layout;
use crate::pyramid::store::error::StoreError;
use crate::pyramid::store::sink::Sink;
use crate::pyramid::{BLOCK_CELLS, BlockDeviation, FIGURES};

/// Levels between one and the one it is measured against.
const APART: usize = 3;
/// Blocks along a side of a group, at `APART` levels above the one measured against.
const GROUP: usize = 16;
/// Groups are taken square by square of so many a side: the chunks of a square are done before the next begins.
const SQUARE: usize = 16;

impl Build<'_> {
    /// Measures and writes all deviations; all levels must have been written.
    pub(super) fn measure(&self) -> Result<(), StoreError> {
        let work = Measuring::new(self)?;
        for base in 0..=(self.levels.len() - 1).saturating_sub(APART) {
            work.against(base)?;
        }
        Ok(())
    }
}

struct Measuring<'a> {
    build: &'a Build<'a>,
    back: ReadBack<'a>,
    last: [usize; 2],
    levels: Vec<Blocks>,
}

/// What becomes of one level's blocks.
struct Blocks {
    layout: Layout,
    array: Array<Sink>,
    /// What lies under each block, for levels measured against another than level 0.
    below: Mutex<Vec<Below>>,
    /// Chunks that are not complete yet.
    open: Mutex<HashMap<[usize; 2], Chunk>>,
}

struct Chunk {
    bits: Vec<u16>,
    missing: usize,
}

impl<'a> Measuring<'a> {
    fn new(build: &'a Build<'a>) -> Result<Self, StoreError> {
        let mut levels = Vec::with_capacity(build.levels.len());
        for level in &build.levels {
            let layout = Layout::of(*level);
            let builder = layout.array().map_err(|e| build.encode_error(e))?;
            let array = builder
                .build(build.sink.clone(), &format!("/{}/deviations", level.number))
                .map_err(|e| build.encode_error(e.to_string()))?;
            array.store_metadata().map_err(|e| build.write_error(e.into()))?;
            let count = if levels.len() > APART { layout.blocks[0] * layout.blocks[1] } else { 0 };
            let below = Mutex::new(vec![Below::SAMPLES; count]);
            levels.push(Blocks { layout, array, below, open: Mutex::default() });
        }
        let last = build.levels[0].size.map(|s| usize::try_from(s - 1).unwrap_or(usize::MAX));
        Ok(Self { build, back: ReadBack::new(build)?, last, levels })
    }

    /// Measures the levels that are measured against level `base`.
    fn against(&self, base: usize) -> Result<(), StoreError> {
        // All levels of a group have the same groups.
        let first = if base == 0 { 0 } else { base + APART };
        let groups = self.levels[first].layout.blocks.map(|n| n.div_ceil(side(base, first)));
        let squares = groups.map(|n| n.div_ceil(SQUARE));
        let count = squares[0] * squares[1] * SQUARE * SQUARE;
        self.build.by_all_workers(count as u64, &|number| {
            let number = usize::try_from(number).unwrap_or(usize::MAX);
            let (square, within) = (number / (SQUARE * SQUARE), number % (SQUARE * SQUARE));
            let within = every_other_bit(within);
            let square = [square % squares[0], square / squares[0]];
            let group = [0, 1].map(|a: usize| square[a] * SQUARE + within[a]);
            if group[0] < groups[0] && group[1] < groups[1] {
                self.group(base, group)?;
            }
            Ok(true)
        })?;
        Ok(())
    }

    fn group(&self, base: usize, group: [usize; 2]) -> Result<(), StoreError> {
        self.build.go_on()?;
        let samples = self.read(base, base, group)?;
        let mut finer = None;
        let mut first = base + APART;
        if base == 0 {
            self.level([0, 0], group, &samples, &samples, None)?;
            first = 1;
        } else {
            finer = Some(self.read(base, base + APART - 1, group)?);
        }
        for level in first..=(base + APART).min(self.levels.len() - 1) {
            let own = self.read(base, level, group)?;
            // Of level 1, the next finer one is what it is measured against.
            self.level([base, level], group, &samples, &own, Some(finer.as_ref().unwrap_or(&samples)))?;
            finer = Some(own);
        }
        Ok(())
    }

    /// A group's samples of a level, its border included.
    fn read(&self, base: usize, level: usize, group: [usize; 2]) -> Result<Samples, StoreError> {
        let geometry = self.build.levels[level];
        let cells = (side(base, level) * BLOCK_CELLS as usize) as u64;
        let fit = |v: u64| i32::try_from(v).unwrap_or(i32::MAX);
        let lo = group.map(|g| g as u64 * cells);
        let hi = [0, 1].map(|a: usize| fit((lo[a] + cells).min(geometry.size[a] - 1)));
        let rect = Rect { lo: lo.map(fit), hi };
        Ok(Samples::new(geometry.number, rect, self.back.read(geometry, rect)?))
    }

    /// A group's blocks of one level.
    fn level(
        &self,
        [base, level]: [usize; 2],
        group: [usize; 2],
        samples: &Samples,
        own: &Samples,
        finer: Option<&Samples>,
    ) -> Result<(), StoreError> {
        let surfaces = Surfaces { base: samples, own, finer, last: self.last, parallel: false };
        let blocks = &self.levels[level];
        let all = blocks.layout.blocks;
        let lo = group.map(|g| g * side(base, level));
        let hi = [0, 1].map(|a: usize| (lo[a] + side(base, level)).min(all[a]));
        let mut found = Vec::with_capacity((hi[0] - lo[0]) * (hi[1] - lo[1]));
        for y in lo[1]..hi[1] {
            for x in lo[0]..hi[0] {
                let below = if base == 0 { Below::SAMPLES } else { blocks.below(y * all[0] + x) };
                found.push(surfaces.block([x, y], below));
            }
        }
        // Level 0 is what it is measured against: nothing to hand on.
        if let Some(above) = self.levels.get(level + APART).filter(|_| level > 0) {
            let mut below = above.below.lock().unwrap_or_else(PoisonError::into_inner);
            let places = (lo[1]..hi[1]).flat_map(|y| (lo[0]..hi[0]).map(move |x| [x, y]));
            for ([x, y], block) in places.zip(&found) {
                below[(y >> APART) * above.layout.blocks[0] + (x >> APART)].take(*block);
            }
        }
        blocks.put(self.build, lo, hi, &found)?;
        let size = self.build.levels[level].size;
        let sides = [0, 1].map(|a: usize| {
            let to = if hi[a] == all[a] { size[a] } else { (hi[a] * BLOCK_CELLS as usize) as u64 };
            to - (lo[a] * BLOCK_CELLS as usize) as u64
        });
        self.build.progress.samples.fetch_add(sides[0] * sides[1], Ordering::Relaxed);
        Ok(())
    }
}

impl Blocks {
    fn below(&self, block: usize) -> Below {
        self.below.lock().unwrap_or_else(PoisonError::into_inner)[block]
    }

    /// Takes in a rectangle of blocks and writes the chunks that are complete with it.
    fn put(
        &self,
        build: &Build<'_>,
        lo: [usize; 2],
        hi: [usize; 2],
        found: &[BlockDeviation],
    ) -> Result<(), StoreError> {
        let [across, down] = self.layout.chunk;
        for cy in lo[1] / down..hi[1].div_ceil(down) {
            for cx in lo[0] / across..hi[0].div_ceil(across) {
                let [from, to] = self.layout.part([cx, cy]);
                let (lo_in, hi_in) =
                    ([0, 1].map(|a: usize| lo[a].max(from[a])), [0, 1].map(|a: usize| hi[a].min(to[a])));
                let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
                let chunk = open.entry([cx, cy]).or_insert_with(|| Chunk {
                    bits: vec![BlockDeviation::UNKNOWN.bits()[0]; across * down * FIGURES],
                    missing: (to[0] - from[0]) * (to[1] - from[1]),
                });
                for y in lo_in[1]..hi_in[1] {
                    for x in lo_in[0]..hi_in[0] {
                        let at = ((y - from[1]) * across + x - from[0]) * FIGURES;
                        let block = found[(y - lo[1]) * (hi[0] - lo[0]) + x - lo[0]];
                        chunk.bits[at..at + FIGURES].copy_from_slice(&block.bits());
                    }
                }
                chunk.missing -= (hi_in[0] - lo_in[0]) * (hi_in[1] - lo_in[1]);
                if chunk.missing > 0 {
                    continue;
                }
                let done = open.remove(&[cx, cy]);
                drop(open);
                let Some(done) = done else { continue };
                // Written even when all is unknown: what is missing is damage.
                let options = one_thread().with_store_empty_chunks(true);
                self.array
                    .store_chunk_opt(&[cy as u64, cx as u64, 0], done.bits, &options)
                    .map_err(|e| build.write_error(e))?;
            }
        }
        Ok(())
    }
}

/// Blocks of a level along a side of a group.
fn side(base: usize, level: usize) -> usize {
    GROUP << (base + APART - level)
}

/// A number's even bits and its odd bits: neighbours in both directions have numbers close to each other.
fn every_other_bit(number: usize) -> [usize; 2] {
    [0, 1].map(|a: usize| (0..4).map(|bit| ((number >> (2 * bit + a)) & 1) << bit).sum())
}
