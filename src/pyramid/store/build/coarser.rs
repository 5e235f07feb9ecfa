//! One coarser level from the finer one that was just written.

use super::Build;
use super::readback::ReadBack;
use crate::clipmap::Rect;
use crate::pyramid::prefilter::low_pass;
use crate::pyramid::store::error::StoreError;
use crate::pyramid::store::level::Level;
use crate::pyramid::store::{SHARD, SHARD_TILES, TILE};
use crate::pyramid::{Prefilter, VOID};

/// Reads the finer level back and makes shards of the coarser one.
pub(super) struct Coarser<'a> {
    back: ReadBack<'a>,
    finer: Level,
    level: Level,
    prefilter: Prefilter,
}

/// Samples of a rectangle of nodes of the finer level.
struct Fine {
    rect: Rect,
    width: usize,
    samples: Vec<f32>,
}

impl Fine {
    fn at(&self, x: i32, y: i32) -> f32 {
        let column = x.abs_diff(self.rect.lo[0]) as usize;
        self.samples[y.abs_diff(self.rect.lo[1]) as usize * self.width + column]
    }
}

impl<'a> Coarser<'a> {
    pub fn new(finer: Level, level: Level, build: &'a Build<'a>) -> Result<Self, StoreError> {
        Ok(Self { back: ReadBack::new(build)?, finer, level, prefilter: build.options.prefilter })
    }

    /// Fills the samples of a shard (rows from the north) and the errors of its tiles.
    pub fn fill(
        &self,
        first: [u64; 2],
        size: [usize; 2],
        heights: &mut [f32],
        errors: &mut [f32; SHARD_TILES * SHARD_TILES],
    ) -> Result<(), StoreError> {
        let fit = |v: u64| i32::try_from(v).unwrap_or(i32::MAX);
        let last = self.level.size.map(|s| fit(s - 1));
        let fine_last = self.finer.size.map(|s| fit(s - 1));
        let west = fit(first[0]);
        let north = last[1] - fit(first[1]);
        let nodes =
            Rect { lo: [west, north - fit(size[1] as u64) + 1], hi: [west + fit(size[0] as u64) - 1, north] };
        let under = |v: i32, axis: usize| (2 * v).min(fine_last[axis]);
        // One node beyond on the low side for the prefilter, the whole of the last cell on the high side.
        let rect = Rect {
            lo: [0, 1].map(|a| (under(nodes.lo[a], a) - 1).max(0)),
            hi: [0, 1].map(|a| (under((nodes.hi[a] + 1).min(last[a]), a) + 1).min(fine_last[a])),
        };
        let width = rect.hi[0].abs_diff(rect.lo[0]) as usize + 1;
        let fine = Fine { rect, width, samples: self.back.read(self.finer, rect)? };
        let value = |x: i32, y: i32| {
            let (fx, fy) = (under(x, 0), under(y, 1));
            let centre = fine.at(fx, fy);
            match self.prefilter {
                Prefilter::LowPass if centre != VOID => {
                    let at = [fx.abs_diff(rect.lo[0]) as usize, fy.abs_diff(rect.lo[1]) as usize];
                    let side = [fine.width, fine.samples.len() / fine.width];
                    low_pass(&fine.samples, side, at)
                }
                _ => centre,
            }
        };
        for row in 0..size[1] {
            let y = north - fit(row as u64);
            for (to, x) in heights[row * SHARD..][..size[0]].iter_mut().zip(west..) {
                *to = value(x, y);
            }
        }
        // Every finer node of the cells from each of our nodes on, against our own triangles (cut from
        // south-east to north-west): the figure of the tile of the cell's south-west node.
        let own = |x: i32, y: i32| {
            let inside = nodes.contains([x, y]);
            if inside {
                heights[north.abs_diff(y) as usize * SHARD + x.abs_diff(west) as usize]
            } else {
                value(x, y)
            }
        };
        for y in nodes.lo[1]..=nodes.hi[1] {
            for x in nodes.lo[0]..=nodes.hi[0] {
                let tile = north.abs_diff(y) as usize / TILE * SHARD_TILES + x.abs_diff(west) as usize / TILE;
                for step in [[0, 0], [1, 0], [0, 1], [1, 1]] {
                    let (fx, fy) = (2 * x + step[0], 2 * y + step[1]);
                    // The data's last node stands on a node of ours, and beyond it there is nothing.
                    let beyond = |f: i32, s: i32, a: usize| f > fine_last[a] || (s == 1 && f == fine_last[a]);
                    if beyond(fx, step[0], 0) || beyond(fy, step[1], 1) {
                        continue;
                    }
                    let (a, b) = (own(x + step[0], y), own(x, y + step[1]));
                    let h = fine.at(fx, fy);
                    if a != VOID && b != VOID && h != VOID {
                        errors[tile] = errors[tile].max(((a + b) * 0.5 - h).abs());
                    }
                }
            }
        }
        Ok(())
    }
}
