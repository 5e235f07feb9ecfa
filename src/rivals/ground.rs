//! The full-resolution samples, as the rivals that keep them all need them: made once, shared by all.

use std::sync::OnceLock;

use rayon::prelude::*;

use crate::clipmap::Rect;
use crate::scene::Terrain;

/// Why a method cannot draw a terrain; one line.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
#[error("{0}")]
pub struct Unfit(pub String);

/// All samples of a terrain on a plane, row by row from the south-west.
#[derive(Debug)]
pub struct Ground {
    /// Samples east and north.
    pub size: [u32; 2],
    /// Heights, metres.
    pub heights: Vec<f32>,
    /// Metres between samples, east and north.
    pub spacing_m: [f64; 2],
    /// Lowest and highest height, metres.
    pub range_m: [f32; 2],
    normals: OnceLock<Vec<u32>>,
    ranges: OnceLock<Ranges>,
}

impl Ground {
    /// Most samples taken into memory: those of a square of 8,193 and a few more.
    pub const MOST_SAMPLES: u64 = (1 << 26) + (1 << 15);

    /// Reads all samples.
    ///
    /// # Errors
    /// When the base is no plane, samples are void, or there are too many.
    pub fn of(terrain: &Terrain) -> Result<Self, Unfit> {
        let unfit = |why: String| Err(Unfit(why));
        if terrain.curved.is_some() {
            return unfit(format!(
                "as built here draws planes only, not base {}: give --base plane",
                terrain.base()
            ));
        }
        if terrain.source.has_voids() {
            return unfit("as built here has no rule for voids: fill them (--nodata fill)".into());
        }
        let last = terrain.source.lattice().last;
        let size = last.map(|v| v.unsigned_abs() + 1);
        let count = u64::from(size[0]) * u64::from(size[1]);
        if count > Self::MOST_SAMPLES {
            let most = Self::MOST_SAMPLES;
            return unfit(format!("as built here keeps all samples in memory: {count} are more than {most}"));
        }
        let mut heights = Vec::with_capacity(usize::try_from(count).unwrap_or(0));
        terrain.source.read_now(0, Rect { lo: [0, 0], hi: last }, &mut heights);
        let range_m = terrain.source.height_range().unwrap_or([0.0; 2]);
        Ok(Self {
            size,
            heights,
            spacing_m: terrain.spacing_m,
            range_m,
            normals: OnceLock::new(),
            ranges: OnceLock::new(),
        })
    }

    /// Index of the last sample, east and north.
    #[must_use]
    pub fn last(&self) -> [i32; 2] {
        self.size.map(|s| s.cast_signed() - 1)
    }

    /// Index into the samples of base sample `at`, clamped to the data.
    #[must_use]
    pub fn index(&self, at: [i32; 2]) -> usize {
        let last = self.last();
        let [x, y] = [0, 1].map(|a| at[a].clamp(0, last[a]) as usize);
        y * self.size[0] as usize + x
    }

    /// Height at base sample `at`, clamped to the data, metres.
    #[must_use]
    pub fn height(&self, at: [i32; 2]) -> f32 {
        self.heights[self.index(at)]
    }

    /// Normals of all samples from central differences, packed as in [`crate::reference::Vertex`], without
    /// a level; made at the first call.
    #[must_use]
    pub fn normals(&self) -> &[u32] {
        self.normals.get_or_init(|| {
            let width = self.size[0] as usize;
            let mut out = vec![0; self.heights.len()];
            out.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
                for (x, packed) in row.iter_mut().enumerate() {
                    *packed = self.normal([x as i32, y as i32], 1);
                }
            });
            out
        })
    }

    /// Packed normal at base sample `at` from differences over `step` samples to both sides.
    #[must_use]
    pub fn normal(&self, at: [i32; 2], step: i32) -> u32 {
        let last = self.last();
        let slope = [0, 1].map(|a| {
            let (mut low, mut high) = (at, at);
            low[a] = (at[a] - step).max(0);
            high[a] = (at[a] + step).min(last[a]);
            let run = f64::from(high[a] - low[a]) * self.spacing_m[a];
            (self.height(high) - self.height(low)) / run as f32
        });
        pack_normal(slope)
    }
}

/// Octahedral normal of a slope (rise per metre east and north), 12 bits a component, as
/// shaders/plane/positions.wgsl packs it.
#[must_use]
pub(crate) fn pack_normal(slope: [f32; 2]) -> u32 {
    let scale = slope[0].abs() + slope[1].abs() + 1.0;
    let [u, v] = slope.map(|s| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to 4095")]
        let q = ((-s / scale * 0.5 + 0.5) * 4095.0).round() as u32;
        q
    });
    u | v << 12
}

/// Samples a side of the finest blocks that ranges are kept for.
const BLOCK: i32 = 32;

/// Lowest and highest height of square blocks, and of blocks of blocks.
#[derive(Debug)]
struct Ranges {
    levels: Vec<([i32; 2], Vec<[f32; 2]>)>,
}

impl Ranges {
    fn of(ground: &Ground) -> Self {
        let join = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let none = [f32::INFINITY, f32::NEG_INFINITY];
        let last = ground.last();
        let mut size = last.map(|v| v / BLOCK + 1);
        let of_block = |k: i32| {
            let lo = [k % size[0] * BLOCK, k / size[0] * BLOCK];
            // Blocks are closed: each knows the first samples of its neighbours.
            let hi = [0, 1].map(|a| (lo[a] + BLOCK).min(last[a]));
            let rows = (lo[1]..=hi[1]).flat_map(|y| {
                let first = ground.index([lo[0], y]);
                ground.heights[first..=first + hi[0].abs_diff(lo[0]) as usize].iter()
            });
            rows.fold(none, |r, h| join(r, [*h, *h]))
        };
        let finest: Vec<[f32; 2]> = (0..size[0] * size[1]).into_par_iter().map(of_block).collect();
        let mut levels = vec![(size, finest)];
        while size[0] > 1 || size[1] > 1 {
            let fine = size;
            size = size.map(|v| (v + 1) / 2);
            let mut coarse = vec![none; (size[0] * size[1]) as usize];
            if let Some((_, below)) = levels.last() {
                for (k, range) in below.iter().enumerate() {
                    let (x, y) = (k as i32 % fine[0], k as i32 / fine[0]);
                    let at = &mut coarse[(y / 2 * size[0] + x / 2) as usize];
                    *at = join(*at, *range);
                }
            }
            levels.push((size, coarse));
        }
        Self { levels }
    }
}

impl Ground {
    /// Lowest and highest height over base samples `lo..=hi` (clamped to the data), or a little more around:
    /// a bound, from blocks whose size is in proportion.
    #[must_use]
    pub fn range_over(&self, lo: [i32; 2], hi: [i32; 2]) -> [f32; 2] {
        let ranges = self.ranges.get_or_init(|| Ranges::of(self));
        let last = self.last();
        let side = (hi[0] - lo[0]).max(hi[1] - lo[1]).max(1);
        let mut level = 0;
        while level + 1 < ranges.levels.len() && BLOCK << level < side / 2 {
            level += 1;
        }
        let (size, blocks) = &ranges.levels[level];
        let block =
            |p: [i32; 2]| [0, 1].map(|a| (p[a].clamp(0, last[a]) / (BLOCK << level)).min(size[a] - 1));
        let (from, to) = (block(lo), block(hi));
        let mut range = [f32::INFINITY, f32::NEG_INFINITY];
        for y in from[1]..=to[1] {
            for x in from[0]..=to[0] {
                let r = blocks[(y * size[0] + x) as usize];
                range = [range[0].min(r[0]), range[1].max(r[1])];
            }
        }
        range
    }

    /// Bytes of the table of ranges.
    #[must_use]
    pub fn range_bytes(&self) -> u64 {
        let levels = self.ranges.get().map_or(&[][..], |r| &r.levels[..]);
        levels.iter().map(|(_, blocks)| size_of_val(&blocks[..]) as u64).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Prefilter;
    use crate::heights::HeightGrid;

    #[test]
    fn ranges_bound_what_lies_under_them() {
        let (w, h) = (131_usize, 70_usize);
        let heights: Vec<f32> = (0..w * h).map(|k| ((k * 7_919) % 1_013) as f32).collect();
        let grid = HeightGrid::new(w, h, heights).unwrap();
        let ground = Ground::of(&Terrain::new(&grid, Prefilter::default())).unwrap();
        for (lo, hi) in [([0, 0], [5, 5]), ([30, 31], [33, 60]), ([0, 0], [130, 69]), ([100, 50], [400, 90])]
        {
            let [low, high] = ground.range_over(lo, hi);
            for y in lo[1]..=hi[1].min(69) {
                for x in lo[0]..=hi[0].min(130) {
                    let height = ground.height([x, y]);
                    assert!(low <= height && height <= high);
                }
            }
        }
    }

    #[test]
    fn what_rivals_cannot_draw_is_said() {
        let mut heights = vec![1.0; 9];
        heights[4] = f32::NAN;
        let grid = HeightGrid::new(3, 3, heights).unwrap();
        let why = Ground::of(&Terrain::new(&grid, Prefilter::default())).unwrap_err();
        assert!(why.to_string().contains("--nodata fill"), "{why}");
    }
}
