//! Measures the deviations of every block against the samples of a finer level: all full-resolution samples,
//! or, where those would be too many to hold, a level between, whose own deviation from them is added.
//!
//! Against a level between, what counts is the distance of two surfaces, not of a surface and samples. That
//! level's own figure holds with its finest triangles cut either way: alternating, as its network has them,
//! or all from south-east to north-west. Coarser triangles have even nodes of it as corners, so that every
//! diagonal of theirs runs along diagonals of the network: on each triangle of it both surfaces are plane,
//! and the nodes within tell all. Only the last cells of a side may be narrower, so that diagonals cross:
//! there all nodes around are taken in.

use std::cmp::Ordering;

use rayon::prelude::*;

use super::triangles::{self, Corners, End};
use super::{BLOCK_CELLS, BlockDeviation, Deviations, FIGURES, Level, blocks_at};
use crate::clipmap::Rect;
use crate::pyramid::{SampleSource, VOID};

const CELLS: usize = BLOCK_CELLS as usize;

/// First level whose blocks are large enough to be measured by several threads each.
const LARGE: u32 = 4;

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
    /// Worst deviation of that level with nothing left out, metres.
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
        // Unknown as soon as anything is left out: a void somewhere in it, or heights beyond all bounds.
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
    /// Whether large blocks may be measured by several threads.
    pub parallel: bool,
}

/// A block's closed rectangle, in nodes of its level and in indices of level 0.
struct Block {
    nodes: [[usize; 2]; 2],
    base: [[usize; 2]; 2],
    /// Where the data ends in it.
    end: Option<End>,
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
        let cells = [0, 1].map(|a: usize| hi[a].saturating_sub(lo[a]));
        let nominal = self.last.map(|v| v >> self.own.level);
        let full = [0, 1].map(|a: usize| cells[a].min(nominal[a].saturating_sub(lo[a])));
        let base = [lo, hi].map(|p| self.base_of(p));
        let [from, to] = base.map(|p| p.map(|v| self.base.node(v)));
        let whole = below.whole && self.base.all_valid(from, to) && self.own.all_valid(lo, hi);
        let block = Block { nodes: [lo, hi], base, end: End::of(cells, full), whole };

        let mut worst = [0.0; FIGURES];
        if self.splits_blocks() {
            worst.par_iter_mut().enumerate().for_each(|(rank, figure)| *figure = self.figure(&block, rank));
        } else {
            worst.iter_mut().enumerate().for_each(|(rank, figure)| *figure = self.figure(&block, rank));
        }
        // Corners on the border may stand at the finer level's heights also for triangles without an edge
        // there.
        let more = self.apart(&block) + f64::from(below.error_m);
        let mut so_far = 0.0_f64;
        BlockDeviation::of(worst.map(|figure| {
            so_far = so_far.max(figure);
            rounded_up(so_far + more)
        }))
    }

    fn splits_blocks(&self) -> bool {
        self.parallel && self.own.level >= LARGE
    }

    /// Worst deviation on the triangles of one rank.
    fn figure(&self, block: &Block, rank: usize) -> f64 {
        if self.own.level == 0 && rank == 0 {
            return 0.0; // every sample is a vertex
        }
        if !block.whole && rank > 0 {
            return f64::INFINITY;
        }
        // A triangle with a void corner is not drawn where nothing is left out; elsewhere it is more than is known.
        let void = if rank == 0 { 0.0 } else { f64::INFINITY };
        let worst = |number| {
            let corners = triangles::nth(rank, number);
            if block.end.as_ref().is_some_and(|end| !end.has(rank, &corners)) {
                return 0.0;
            }
            let triangle = self.triangle(block, &corners);
            triangle.and_then(|t| self.worst_on(block, &t, rank > 0)).unwrap_or(void)
        };
        let all = 0..triangles::count(rank);
        if self.splits_blocks() {
            all.into_par_iter().map(worst).reduce(|| 0.0, f64::max)
        } else {
            all.map(worst).fold(0.0, f64::max)
        }
    }

    /// A triangle of a block where it stands; `None` where a corner is void.
    fn triangle(&self, block: &Block, corners: &Corners) -> Option<Triangle> {
        let node = |p: [usize; 2]| [0, 1].map(|a: usize| block.nodes[0][a] + p[a]);
        let (apex, [first, second]) = (node(corners.apex), corners.ends.map(node));
        let heights = [self.own.at(apex)?, self.own.at(first)?, self.own.at(second)?];
        Some(Triangle::new(self.base_of(apex), [first, second].map(|p| self.base_of(p)), heights))
    }

    /// Bound of the deviation on one triangle, however its edges on the block's sides are divided. `None`
    /// where it touches a void and is to be whole.
    fn worst_on(&self, block: &Block, triangle: &Triangle, whole: bool) -> Option<f64> {
        let mut inside = [0.0; 2];
        for y in self.base.node(triangle.lo[1])..=self.base.node(triangle.hi[1]) {
            let span = self.span(triangle, y);
            let row = self.base.row(y, span);
            if block.whole {
                self.widen_by_row(&mut inside, triangle, [span[0], y], row);
                continue;
            }
            // What is valid between voids counts all the same: it is drawn over.
            let mut x = span[0];
            for part in row.chunk_by(|a, b| is_valid(*a) == is_valid(*b)) {
                if is_valid(part[0]) {
                    self.widen_by_row(&mut inside, triangle, [x, y], part);
                } else if whole {
                    return None;
                }
                x += part.len();
            }
        }
        // Vertices added to an edge move the surface by a mean of their own deviations and of zero.
        let mut moved = [0.0; 2];
        if self.widen_by_sides(&mut moved, block, triangle).is_none() && whole {
            return None;
        }
        Some((inside[1] - moved[0]).max(moved[1] - inside[0]))
    }

    /// Base index of a node of the level that is measured against.
    fn index_of(&self, node: usize, axis: usize) -> usize {
        (node << self.base.level).min(self.last[axis])
    }

    /// First and last node, in a row of nodes measured against, that tell how far its surface lies off a
    /// triangle.
    fn span(&self, triangle: &Triangle, y: usize) -> [usize; 2] {
        let level = self.base.level;
        if level == 0 {
            return triangle.span(y, false);
        }
        let nested = triangle.runs_along(1 << level);
        // The finer cells that a diagonal cuts have corners beyond it: the row where the triangle is one cell
        // wider.
        let wider = match y.cmp(&self.base.node(triangle.apex[1])) {
            Ordering::Less if !nested => y + 1,
            Ordering::Greater if !nested => y - 1,
            _ => y,
        };
        let [from, to] = triangle.span(self.index_of(wider, 1), !nested);
        [from >> level, self.base.node(to)]
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

    /// Takes in how far vertices that may be added to a triangle's edges on the block's sides lie off it.
    fn widen_by_sides(&self, range: &mut [f64; 2], block: &Block, triangle: &Triangle) -> Option<()> {
        let [lo, hi] = block.base;
        if (0..2).all(|a| triangle.lo[a] > lo[a] && triangle.hi[a] < hi[a]) {
            return Some(());
        }
        let (apex, [first, second]) = (triangle.apex, triangle.ends);
        for [p, q] in [[apex, first], [apex, second], [first, second]] {
            for across in 0..2 {
                if p[across] == q[across] && (p[across] == lo[across] || p[across] == hi[across]) {
                    self.widen_by_edge(range, triangle, [p, q], 1 - across)?;
                }
            }
        }
        Some(())
    }

    /// The same for one edge.
    fn widen_by_edge(
        &self,
        range: &mut [f64; 2],
        triangle: &Triangle,
        [mut p, q]: [[usize; 2]; 2],
        along: usize,
    ) -> Option<()> {
        let (from, to) = (p[along].min(q[along]), p[along].max(q[along]));
        for samples in std::iter::once(self.own).chain(self.finer) {
            let mut node = p.map(|v| samples.node(v));
            for n in samples.node(from)..=samples.node(to) {
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

/// A right triangle in indices of level 0. Its legs run along the axes, or its hypotenuse: see [`Corners`].
struct Triangle {
    /// Where its right angle is.
    apex: [usize; 2],
    /// Ends of its hypotenuse.
    ends: [[usize; 2]; 2],
    /// Low corner of what it reaches over.
    lo: [usize; 2],
    /// High corner of the same.
    hi: [usize; 2],
    /// Height at the right angle.
    height: f64,
    /// Metres per base index east and north.
    slope: [f64; 2],
}

impl Triangle {
    /// Heights are those of the right angle and of both ends.
    fn new(apex: [usize; 2], ends: [[usize; 2]; 2], [height, first, second]: [f64; 3]) -> Self {
        let [u, v] = ends.map(|p| [0, 1].map(|a: usize| offset(p[a], apex[a])));
        let (rise_u, rise_v) = (first - height, second - height);
        let share = 1.0 / (u[0] * v[1] - u[1] * v[0]);
        let slope = [(rise_u * v[1] - rise_v * u[1]) * share, (rise_v * u[0] - rise_u * v[0]) * share];
        let lo = [0, 1].map(|a: usize| apex[a].min(ends[0][a]).min(ends[1][a]));
        let hi = [0, 1].map(|a: usize| apex[a].max(ends[0][a]).max(ends[1][a]));
        Self { apex, ends, lo, hi, height, slope }
    }

    /// Height of its plane.
    fn at(&self, p: [usize; 2]) -> f64 {
        let off = |a: usize| offset(p[a], self.apex[a]);
        self.height + self.slope[0] * off(0) + self.slope[1] * off(1)
    }

    /// Whether all its edges run along sides and diagonals of cells of a size, a power of two.
    fn runs_along(&self, cell: usize) -> bool {
        let [first, second] = self.ends;
        let size = [0, 1].map(|a: usize| self.hi[a] - self.lo[a]);
        // No hypotenuse along an axis lies in the last cells of a side, which alone may be narrower.
        (0..2).any(|a| first[a] == second[a]) || (size[0] == size[1] && size[0] & (cell - 1) == 0)
    }

    /// First and last base index of the closed triangle in a row, where it ends between two rounded inward or
    /// outward. A sample on an edge is in both triangles.
    fn span(&self, y: usize, outward: bool) -> [usize; 2] {
        let [first, second] = self.ends;
        if first[1] == second[1] {
            let off = y.abs_diff(first[1]);
            return [first[0] + off, second[0] - off];
        }
        let (start, east, reach) = if first[0] == second[0] {
            (first[0], self.apex[0] > first[0], (y - first[1]).min(second[1] - y))
        } else {
            let [width, height] = [0, 1].map(|a: usize| self.hi[a] - self.lo[a]);
            let left = y.abs_diff(second[1]);
            let reach = match (width == height, outward) {
                (true, _) => left, // nearly always; saves the division
                (_, true) => (width * left).div_ceil(height),
                (_, false) => width * left / height,
            };
            (self.apex[0], first[0] > self.apex[0], reach)
        };
        if east { [start, start + reach] } else { [start - reach, start] }
    }
}

/// Takes in the differences of a row of samples from `start + slope * i`.
fn widen(range: &mut [f64; 2], row: &[f32], start: f64, slope: f64) {
    if row.len() < 8 {
        let mut at = start;
        for h in row {
            let off = f64::from(*h) - at;
            range[0] = if off < range[0] { off } else { range[0] };
            range[1] = if off > range[1] { off } else { range[1] };
            at += slope;
        }
        return;
    }
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

/// How far an index lies beyond another.
fn offset(to: usize, from: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "indices of samples are below 2^31")]
    let off = (to.cast_signed() - from.cast_signed()) as f64;
    off
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
