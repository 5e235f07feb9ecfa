//! Measures the deviations of every block against the samples of a finer level: all full-resolution samples, or,
//! where those would be too many to hold, a level between, whose own deviation from them is added.
//!
//! Against a level between, what counts is the distance of two surfaces, not of a surface and samples. Both are
//! plane on each triangle of the finer one as long as its triangles lie within the coarser one's. Only the last
//! cells of a side may be narrower, so that their diagonals cross: there all finer nodes around are taken in.

use rayon::prelude::*;

use super::{BLOCK_CELLS, BlockDeviation, Deviations, Level, STEPS, blocks_at};
use crate::clipmap::Rect;
use crate::pyramid::{SampleSource, VOID};

const CELLS: usize = BLOCK_CELLS as usize;

/// All blocks of all levels.
pub(super) fn measure(source: &dyn SampleSource) -> Deviations {
    let lattice = source.lattice();
    let grids: Vec<Samples> = (0..=lattice.coarsest_level()).map(|l| Samples::read(source, l, l)).collect();
    let last = lattice.last.map(|v| v.unsigned_abs() as usize);
    let mut levels = Vec::with_capacity(grids.len());
    let mut finer = None;
    for own in &grids {
        let size = blocks_at(lattice, own.level);
        let [width, height] = size.map(|v| v.unsigned_abs() as usize);
        let surfaces = Surfaces { base: &grids[0], own, finer, last, parallel: true };
        let places = (0..width * height).into_par_iter().map(|i| [i % width, i / width]);
        let blocks = places.map(|place| surfaces.block(place, Below::SAMPLES)).collect();
        levels.push(Level { size, blocks });
        finer = Some(own);
    }
    Deviations { levels }
}

/// What is no finite number cannot be measured and counts as void.
fn is_valid(h: f32) -> bool {
    h.is_finite() && h != VOID
}

/// What lies between the level that is measured against and the full-resolution samples, under one block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Below {
    /// Worst deviation of that level at its finest step, metres.
    pub error_m: f32,
    /// No full-resolution sample is void.
    pub whole: bool,
}

impl Below {
    /// Nothing: they are measured against themselves.
    pub const SAMPLES: Self = Self { error_m: 0.0, whole: true };

    /// Takes in a block of that level.
    #[cfg(feature = "store")]
    pub fn take(&mut self, block: BlockDeviation) {
        self.error_m = self.error_m.max(block.metres(0));
        // Unknown beyond the finest step: a void somewhere in it, or heights beyond all bounds.
        self.whole &= block.metres(1) < BlockDeviation::UNKNOWN.metres(1);
    }
}

/// The samples of a rectangle of one level.
pub(crate) struct Samples {
    level: u32,
    /// Node of the first one.
    origin: [usize; 2],
    width: usize,
    heights: Vec<f32>,
}

impl Samples {
    /// Samples of `rect`, row by row from the south-west.
    pub fn new(level: u32, rect: Rect, heights: Vec<f32>) -> Self {
        let origin = rect.lo.map(|v| v.unsigned_abs() as usize);
        Self { level, origin, width: rect.hi[0].abs_diff(rect.lo[0]) as usize + 1, heights }
    }

    /// All of a level that its source calls by another number.
    pub fn read(source: &dyn SampleSource, level: u32, theirs: u32) -> Self {
        let rect = Rect { lo: [0, 0], hi: source.lattice().last_at(theirs) };
        let mut heights = Vec::new();
        source.read(theirs, rect, &mut heights);
        Self::new(level, rect, heights)
    }

    fn index(&self, [x, y]: [usize; 2]) -> usize {
        (y - self.origin[1]) * self.width + x - self.origin[0]
    }

    /// `None` when void.
    fn at(&self, node: [usize; 2]) -> Option<f64> {
        let h = self.heights[self.index(node)];
        is_valid(h).then(|| f64::from(h))
    }

    /// Samples `from..=to` of a row.
    fn row(&self, y: usize, [from, to]: [usize; 2]) -> &[f32] {
        let start = self.index([from, y]);
        &self.heights[start..=start + (to - from)]
    }

    fn all_valid(&self, lo: [usize; 2], hi: [usize; 2]) -> bool {
        (lo[1]..=hi[1]).all(|y| self.row(y, [lo[0], hi[0]]).iter().all(|h| is_valid(*h)))
    }

    /// This level's first node from a base index on.
    fn node(&self, base: usize) -> usize {
        base.div_ceil(1 << self.level)
    }
}

/// The three surfaces that meet in a block of a level.
pub(crate) struct Surfaces<'a> {
    /// The level that is measured against.
    pub base: &'a Samples,
    /// The level whose blocks are measured.
    pub own: &'a Samples,
    /// The next finer level, whose samples a side takes where that level begins.
    pub finer: Option<&'a Samples>,
    /// Last index of level 0 on each axis.
    pub last: [usize; 2],
    /// Whether one block may be measured by several threads.
    pub parallel: bool,
}

/// A block's closed rectangle, in nodes of its level and in indices of level 0.
struct Block {
    nodes: [[usize; 2]; 2],
    base: [[usize; 2]; 2],
    /// No sample in it is void.
    whole: bool,
}

impl Surfaces<'_> {
    fn base_of(&self, node: [usize; 2]) -> [usize; 2] {
        [0, 1].map(|a: usize| (node[a] << self.own.level).min(self.last[a]))
    }

    /// One block; all samples of its closed rectangle must be there.
    pub fn block(&self, place: [usize; 2], below: Below) -> BlockDeviation {
        let lo = place.map(|p| CELLS * p);
        let hi = [0, 1].map(|a: usize| (lo[a] + CELLS).min(self.own.node(self.last[a])));
        let base = [lo, hi].map(|p| self.base_of(p));
        let [from, to] = base.map(|p| p.map(|v| self.base.node(v)));
        let whole = below.whole && self.base.all_valid(from, to) && self.own.all_valid(lo, hi);
        let block = Block { nodes: [lo, hi], base, whole };

        let mut worst = [0.0; STEPS];
        if self.parallel {
            worst.par_iter_mut().enumerate().for_each(|(k, figure)| *figure = self.step(&block, k));
        } else {
            worst.iter_mut().enumerate().for_each(|(k, figure)| *figure = self.step(&block, k));
        }
        // Corners on the border may stand at the finer level's heights also for triangles without an edge there.
        let more = self.apart(&block) + f64::from(below.error_m);
        let mut so_far = 0.0_f64;
        BlockDeviation::of(worst.map(|figure| {
            so_far = so_far.max(figure);
            rounded_up(so_far + more)
        }))
    }

    /// Worst deviation at a step of `2^k` cells.
    fn step(&self, block: &Block, k: usize) -> f64 {
        if self.own.level == 0 && k == 0 {
            return 0.0; // every sample is a vertex
        }
        if !block.whole && k > 0 {
            return f64::INFINITY;
        }
        let [lo, hi] = block.nodes;
        if !self.parallel {
            let rows = (lo[1]..hi[1]).step_by(1 << k);
            return rows.map(|y| self.row_of_cells(block, k, y)).fold(0.0, f64::max);
        }
        // The cells of a coarse level are large: rows of them in parallel, so that few blocks keep all cores busy.
        let rows = (lo[1]..hi[1]).into_par_iter().step_by(1 << k);
        rows.map(|y| self.row_of_cells(block, k, y)).reduce(|| 0.0, f64::max)
    }

    fn row_of_cells(&self, block: &Block, k: usize, y: usize) -> f64 {
        // A triangle with a void is not drawn at the finest step; elsewhere it is more than is known.
        let void = if k == 0 { 0.0 } else { f64::INFINITY };
        let [lo, hi] = block.nodes;
        let mut worst = 0.0_f64;
        for x in (lo[0]..hi[0]).step_by(1 << k) {
            let far = [(x + (1 << k)).min(hi[0]), (y + (1 << k)).min(hi[1])];
            for north_east in [false, true] {
                let triangle = self.triangle([[x, y], far], north_east);
                worst = worst.max(triangle.and_then(|t| self.worst_on(block, &t)).unwrap_or(void));
            }
        }
        worst
    }

    /// One half of a cell between two nodes; `None` where a corner is void.
    fn triangle(&self, [lo, hi]: [[usize; 2]; 2], north_east: bool) -> Option<Triangle> {
        let south_east = self.own.at([hi[0], lo[1]])?;
        let north_west = self.own.at([lo[0], hi[1]])?;
        let height = self.own.at(if north_east { hi } else { lo })?;
        let (lo, hi) = (self.base_of(lo), self.base_of(hi));
        let size = [0, 1].map(|a: usize| real(hi[a] - lo[a]));
        let slope = if north_east {
            [(height - north_west) / size[0], (height - south_east) / size[1]]
        } else {
            [(south_east - height) / size[0], (north_west - height) / size[1]]
        };
        Some(Triangle { lo, hi, north_east, height, slope })
    }

    /// Bound of the deviation on one triangle, however its edges on the block's border are divided. `None` where
    /// it touches a void.
    fn worst_on(&self, block: &Block, triangle: &Triangle) -> Option<f64> {
        let mut inside = [0.0; 2];
        for y in self.base.node(triangle.lo[1])..=self.base.node(triangle.hi[1]) {
            let span = self.span(triangle, y);
            let row = self.base.row(y, span);
            if !block.whole && !row.iter().all(|h| is_valid(*h)) {
                return None;
            }
            self.widen_by_row(&mut inside, triangle, [span[0], y], row);
        }
        // Vertices added to an edge move the surface by a mean of their own deviations and of zero.
        let mut moved = [0.0; 2];
        let right_angle = triangle.right_angle();
        for along in 0..2 {
            let border = block.base[usize::from(triangle.north_east)];
            if right_angle[1 - along] == border[1 - along] {
                self.widen_by_edge(&mut moved, triangle, along)?;
            }
        }
        Some((inside[1] - moved[0]).max(moved[1] - inside[0]))
    }

    /// Base index of a node of the level that is measured against.
    fn index_of(&self, node: usize, axis: usize) -> usize {
        (node << self.base.level).min(self.last[axis])
    }

    /// First and last node, in a row of nodes measured against, that tell how far its surface lies off a triangle.
    fn span(&self, triangle: &Triangle, y: usize) -> [usize; 2] {
        if self.base.level == 0 {
            return triangle.span(y);
        }
        let cell = (1 << self.base.level) - 1;
        let size = [0, 1].map(|a: usize| triangle.hi[a] - triangle.lo[a]);
        let nested = size[0] == size[1] && size[0] & cell == 0;
        // The finer cells that a diagonal cuts have corners beyond it: the row where the triangle is one cell wider.
        let wider = match (nested, triangle.north_east) {
            (true, _) => y,
            (false, true) => (y + 1).min(self.base.node(triangle.hi[1])),
            (false, false) => y.saturating_sub(1).max(self.base.node(triangle.lo[1])),
        };
        let [from, to] = triangle.span(self.index_of(wider, 1));
        [from >> self.base.level, self.base.node(to)]
    }

    /// Takes in a row of samples from a node on.
    fn widen_by_row(&self, range: &mut [f64; 2], triangle: &Triangle, [x, y]: [usize; 2], row: &[f32]) {
        let y = self.index_of(y, 1);
        let end = x + row.len() - 1;
        let slope = triangle.slope[0] * real(1 << self.base.level);
        let start = triangle.at([self.index_of(x, 0), y]);
        if end << self.base.level <= self.last[0] {
            widen(range, row, start, slope);
            return;
        }
        // The data's last column stands closer than the others.
        let (row, last) = row.split_at(row.len() - 1);
        widen(range, row, start, slope);
        widen(range, last, triangle.at([self.last[0], y]), 0.0);
    }

    /// Takes in how far vertices that may be added to one edge lie off the triangle.
    fn widen_by_edge(&self, range: &mut [f64; 2], triangle: &Triangle, along: usize) -> Option<()> {
        for samples in std::iter::once(self.own).chain(self.finer) {
            let mut p = triangle.right_angle();
            let mut node = p.map(|v| samples.node(v));
            for n in samples.node(triangle.lo[along])..=samples.node(triangle.hi[along]) {
                node[along] = n;
                p[along] = (n << samples.level).min(self.last[along]);
                let off = samples.at(node)? - triangle.at(p);
                *range = [range[0].min(off), range[1].max(off)];
            }
        }
        Some(())
    }

    /// Worst difference of this level's and the finer level's samples at the nodes on a block's border.
    fn apart(&self, block: &Block) -> f64 {
        let Some(finer) = self.finer else {
            return 0.0;
        };
        let [lo, hi] = block.nodes;
        let mut worst = 0.0_f64;
        for y in lo[1]..=hi[1] {
            // Inner rows meet the border at their two ends only.
            let step = if y == lo[1] || y == hi[1] { 1 } else { (hi[0] - lo[0]).max(1) };
            for x in (lo[0]..=hi[0]).step_by(step) {
                let node = self.base_of([x, y]).map(|v| finer.node(v));
                if let (Some(own), Some(fine)) = (self.own.at([x, y]), finer.at(node)) {
                    worst = worst.max((own - fine).abs());
                }
            }
        }
        worst
    }
}

/// Half of a cell, cut from south-east to north-west, in indices of level 0.
struct Triangle {
    /// Low corner of the cell.
    lo: [usize; 2],
    /// High corner of the cell.
    hi: [usize; 2],
    /// Which half.
    north_east: bool,
    /// Height at the right angle.
    height: f64,
    /// Metres per base index east and north.
    slope: [f64; 2],
}

impl Triangle {
    fn right_angle(&self) -> [usize; 2] {
        if self.north_east { self.hi } else { self.lo }
    }

    /// Height of its plane.
    fn at(&self, p: [usize; 2]) -> f64 {
        let from = self.right_angle();
        let off = |a: usize| real(p[a]) - real(from[a]);
        self.height + self.slope[0] * off(0) + self.slope[1] * off(1)
    }

    /// First and last base index of the closed triangle in a row. A sample on the diagonal is in both halves.
    fn span(&self, y: usize) -> [usize; 2] {
        let (width, height, left) = (self.hi[0] - self.lo[0], self.hi[1] - self.lo[1], self.hi[1] - y);
        if width == height {
            // Nearly always; saves the division.
            let cut = self.lo[0] + left;
            return if self.north_east { [cut, self.hi[0]] } else { [self.lo[0], cut] };
        }
        if self.north_east {
            [self.lo[0] + (width * left).div_ceil(height), self.hi[0]]
        } else {
            [self.lo[0], self.lo[0] + width * left / height]
        }
    }
}

/// Takes in the differences of a row of samples from `start + slope * i`.
fn widen(range: &mut [f64; 2], row: &[f32], start: f64, slope: f64) {
    // Four lanes without an order among them, so that the compiler can use vectors.
    let (mut lo, mut hi) = ([range[0]; 4], [range[1]; 4]);
    let mut i = [0.0, 1.0, 2.0, 3.0];
    let mut take = |lane: usize, h: f32| {
        let off = f64::from(h) - (start + slope * i[lane]);
        lo[lane] = if off < lo[lane] { off } else { lo[lane] };
        hi[lane] = if off > hi[lane] { off } else { hi[lane] };
        i[lane] += 4.0;
    };
    let (fours, rest) = row.as_chunks::<4>();
    for four in fours {
        for (lane, h) in four.iter().enumerate() {
            take(lane, *h);
        }
    }
    for (lane, h) in rest.iter().enumerate() {
        take(lane, *h);
    }
    *range = [lo.into_iter().fold(range[0], f64::min), hi.into_iter().fold(range[1], f64::max)];
}

fn real(v: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "indices of samples are below 2^31")]
    let v = v as f64;
    v
}

fn rounded_up(v: f64) -> f32 {
    #[expect(clippy::cast_possible_truncation, reason = "too large becomes infinite: unknown")]
    let near = v as f32;
    if f64::from(near) < v { near.next_up() } else { near }
}
