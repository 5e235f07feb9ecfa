//! Deviations of blocks bound every mesh that can be drawn of them, against an oracle of their own.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

mod common;
use std::collections::BTreeSet;

use rayon::prelude::*;
use tessclip::clipmap::{Lattice, Rect};
use tessclip::pyramid::{
    BlockDeviation, Deviations, FIGURES, MemoryPyramid, Prefilter, SampleSource, VOID, blocks_at,
};

type Point = [i32; 2];
type Vertex = (Point, f64);
type Terrain = (Vec<f32>, [usize; 2]);
/// A right triangle: where its right angle is, then the ends of its hypotenuse.
type Right = [Point; 3];

struct Random(u64);
impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        u32::try_from(self.0 >> 33).unwrap()
    }

    fn within(&mut self, from: i32, to: i32) -> i32 {
        from + i32::try_from(self.next() % (to - from + 1).unsigned_abs()).unwrap()
    }
}

/// All levels of a source.
struct Ground {
    lattice: Lattice,
    levels: Vec<Vec<f32>>,
    highest: f64,
}

impl Ground {
    fn new(source: &MemoryPyramid) -> Self {
        let lattice = source.lattice();
        let mut levels = vec![Vec::new(); lattice.coarsest_level() as usize + 1];
        for (out, l) in levels.iter_mut().zip(0..) {
            source.read(l, Rect { lo: [0, 0], hi: lattice.last_at(l) }, out);
        }
        let highest = levels[0].iter().fold(0.0_f64, |m, h| m.max(f64::from(h.abs())));
        Self { lattice, levels, highest }
    }

    /// A level's sample at a base index where it has one.
    fn sample(&self, level: u32, p: Point) -> f64 {
        let node = self.lattice.node(level, p);
        let at = usize::try_from(node[1] * (self.lattice.last_at(level)[0] + 1) + node[0]).unwrap();
        f64::from(self.levels[level as usize][at])
    }
}

/// Where a block lies and where the data ends in it.
struct Block {
    level: u32,
    lo: Point,
    cells: Point,
    /// Last node, from its south-west corner, that is no nearer to the one before than the others are.
    full: Point,
    rect: Rect,
    figures: BlockDeviation,
}

impl Block {
    fn new(lattice: Lattice, level: u32, place: Point, figures: BlockDeviation) -> Self {
        let lo = place.map(|p| 16 * p);
        let cells = [0, 1].map(|a| (lattice.last_at(level)[a] - lo[a]).min(16));
        let full = [0, 1]
            .map(|a| (0..=cells[a]).rev().find(|n| (lo[a] + n) << level <= lattice.last[a]).expect("a node"));
        let hi = [0, 1].map(|a| lo[a] + cells[a]);
        let rect = Rect { lo: lattice.base(level, lo), hi: lattice.base(level, hi) };
        Self { level, lo, cells, full, rect, figures }
    }

    fn base(&self, lattice: Lattice, node: Point) -> Point {
        lattice.base(self.level, [self.lo[0] + node[0], self.lo[1] + node[1]])
    }

    /// Bisects a triangle wherever it must be: it is `depth` bisections from the whole block's halves, so the
    /// node that would bisect it has rank `8 - depth`.
    fn bisect(&self, rank: i32, own: &BTreeSet<Point>, corners: Right, depth: i32, out: &mut Vec<Right>) {
        let [apex, a, b] = corners;
        let range = |i: usize| (apex[i].min(a[i]).min(b[i]), apex[i].max(a[i]).max(b[i]));
        if (0..2).any(|i| range(i).0 >= self.cells[i]) {
            return;
        }
        let middle = middle(corners);
        let data_ends = (0..2).any(|i| range(i).1 > self.full[i]);
        if depth < 8 && (8 - depth > rank || data_ends || own.contains(&middle)) {
            self.bisect(rank, own, [middle, b, apex], depth + 1, out);
            self.bisect(rank, own, [middle, apex, a], depth + 1, out);
        } else {
            out.push(corners);
        }
    }

    /// The mesh without nodes up to a rank but for some: bisected until no vertex lies on another triangle's
    /// edge.
    fn network(&self, rank: usize, mut own: BTreeSet<Point>) -> Vec<Right> {
        let rank = i32::try_from(rank).unwrap();
        loop {
            let mut all = Vec::new();
            self.bisect(rank, &own, [[0, 0], [16, 0], [0, 16]], 0, &mut all);
            self.bisect(rank, &own, [[16, 16], [0, 16], [16, 0]], 0, &mut all);
            let vertices: BTreeSet<Point> = all.iter().flatten().copied().collect();
            let torn = |t: &&Right| {
                let edges = [[t[0], t[1]], [t[0], t[2]], [t[1], t[2]]];
                edges.into_iter().flat_map(within).any(|p| vertices.contains(&p))
            };
            let more: Vec<Point> = all.iter().filter(torn).map(|t| middle(*t)).collect();
            if more.is_empty() {
                return all;
            }
            own.extend(more);
        }
    }

    /// All cells cut from south-east to north-west.
    fn uniform(&self) -> Vec<Right> {
        let cells = (0..self.cells[1]).flat_map(|y| (0..self.cells[0]).map(move |x| [x, y]));
        let halves = cells.flat_map(|[x, y]| {
            let (sw, se, nw, ne) = ([x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]);
            [[sw, se, nw], [ne, nw, se]]
        });
        halves.collect()
    }
}

fn middle([_, a, b]: Right) -> Point {
    [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]
}

/// Nodes strictly between two that lie along an axis or a diagonal.
fn within([p, q]: [Point; 2]) -> impl Iterator<Item = Point> {
    let steps = (q[0] - p[0]).abs().max((q[1] - p[1]).abs());
    (1..steps).map(move |n| [0, 1].map(|i| p[i] + n * (q[i] - p[i]).signum()))
}

/// How one side of a block is drawn: base indices along it where a vertex is added, and whether its heights
/// are the finer level's.
#[derive(Clone, Default)]
struct Edge {
    extra: BTreeSet<i32>,
    finer: bool,
}

impl Edge {
    fn random(block: &Block, side: usize, random: &mut Random) -> Self {
        let along = usize::from(side >= 2);
        let finer = block.level > 0 && random.within(0, 1) == 1;
        let mut extra = BTreeSet::new();
        for half in [1..16, 16..32] {
            let share = random.within(0, 3);
            for j in half {
                let at = ((2 * block.lo[along] + j) << block.level) >> 1;
                let exists = (finer || j % 2 == 0) && at < block.rect.hi[along];
                if exists && random.within(1, 3) <= share {
                    extra.insert(at);
                }
            }
        }
        Self { extra, finer }
    }
}

/// One block, drawn.
struct Drawing<'a> {
    ground: &'a Ground,
    block: &'a Block,
    leaves: &'a [Right],
    /// South, north, west, east.
    edges: [Edge; 4],
}

impl Drawing<'_> {
    fn lies_on(&self, p: Point) -> [bool; 4] {
        let Rect { lo, hi } = self.block.rect;
        [p[1] == lo[1], p[1] == hi[1], p[0] == lo[0], p[0] == hi[0]]
    }

    fn vertex(&self, p: Point) -> Vertex {
        let finer = self.lies_on(p).iter().zip(&self.edges).any(|(on, edge)| *on && edge.finer);
        (p, self.ground.sample(self.block.level - u32::from(finer), p))
    }

    /// Vertices from `a` to `b`, the two ends of a triangle's edge, which lies on a side of the block or
    /// inside.
    fn chain(&self, a: Point, b: Point) -> Vec<Vertex> {
        let mut points = vec![a];
        for side in (0..4).filter(|side| self.lies_on(a)[*side] && self.lies_on(b)[*side]) {
            let along = usize::from(side >= 2);
            let (from, to) = (a[along].min(b[along]), a[along].max(b[along]));
            let between = self.edges[side].extra.iter().filter(|at| (from + 1..to).contains(*at));
            points.extend(between.map(|at| if along == 0 { [*at, a[1]] } else { [a[0], *at] }));
            if a[along] > b[along] {
                points[1..].reverse();
            }
        }
        points.push(b);
        points.into_iter().map(|p| self.vertex(p)).collect()
    }

    fn triangles(&self) -> Vec<[Vertex; 3]> {
        let mut out = Vec::new();
        for leaf in self.leaves {
            let [apex, a, b] = leaf.map(|node| self.block.base(self.ground.lattice, node));
            let long = self.chain(a, b);
            if long.len() > 2 {
                out.extend(long.windows(2).map(|s| [s[0], s[1], self.vertex(apex)]));
                continue;
            }
            // One leg from the end of the other, that one from the first vertex after the right angle.
            let (first, second) = (self.chain(apex, a), self.chain(apex, b));
            out.extend(first[1..].windows(2).map(|s| [s[0], s[1], self.vertex(b)]));
            out.extend(second.windows(2).map(|s| [s[0], s[1], first[1]]));
        }
        out
    }

    /// Worst distance of what is drawn from the base samples, each of which must be covered.
    fn worst(&self) -> f64 {
        let Rect { lo, hi } = self.block.rect;
        let mut covered = vec![false; usize::try_from(self.block.rect.count()).unwrap()];
        let mut worst = 0.0_f64;
        for [a, b, c] in self.triangles() {
            let range = |i: usize| a.0[i].min(b.0[i]).min(c.0[i])..=a.0[i].max(b.0[i]).max(c.0[i]);
            let area = cross(a.0, b.0, c.0);
            for y in range(1) {
                for x in range(0) {
                    let p = [x, y];
                    let shares = [cross(b.0, c.0, p), cross(c.0, a.0, p), cross(a.0, b.0, p)];
                    if shares.iter().any(|s| s * area.signum() < 0) {
                        continue;
                    }
                    #[expect(clippy::cast_precision_loss, reason = "small areas")]
                    let [u, v, w] = shares.map(|s| s as f64 / area as f64);
                    let drawn = u * a.1 + v * b.1 + w * c.1;
                    worst = worst.max((self.ground.sample(0, p) - drawn).abs());
                    covered[usize::try_from((y - lo[1]) * (hi[0] - lo[0] + 1) + x - lo[0]).unwrap()] = true;
                }
            }
        }
        assert!(covered.iter().all(|c| *c), "a hole in the oracle's own drawing");
        worst
    }
}

fn cross(a: Point, b: Point, c: Point) -> i64 {
    i64::from(b[0] - a[0]) * i64::from(c[1] - a[1]) - i64::from(b[1] - a[1]) * i64::from(c[0] - a[0])
}

/// Every block of the levels up to one.
fn blocks(source: &MemoryPyramid, most: u32) -> Vec<Block> {
    let (lattice, deviations) = (source.lattice(), Deviations::of(source));
    let mut all = Vec::new();
    for level in 0..=lattice.coarsest_level().min(most) {
        let [width, height] = blocks_at(lattice, level);
        for place in (0..height).flat_map(|y| (0..width).map(move |x| [x, y])) {
            let mut figures = Vec::new();
            deviations.read(level, Rect { lo: place, hi: place }, &mut figures);
            all.push(Block::new(lattice, level, place, figures[0]));
        }
    }
    all
}

/// By rank, the greatest share of its block's figure that any of some meshes drawn at random deviates by:
/// with all nodes up to the rank left out, with some of them there after all, and, of rank 0, of the uniform
/// grid.
fn shares(source: &MemoryPyramid, most: u32, mixed: usize, seed: u64) -> [f64; FIGURES] {
    let ground = Ground::new(source);
    let of_block = |(number, block): (usize, &Block)| {
        let mut random = Random(seed + 1000 * number as u64);
        let mut found = [0.0_f64; FIGURES];
        for (rank, share) in found.iter_mut().enumerate() {
            let figure = f64::from(block.figures.metres(rank));
            assert!(rank == 0 || figure >= f64::from(block.figures.metres(rank - 1)), "falls with the rank");
            let mut meshes = vec![block.network(rank, BTreeSet::new())];
            for _ in 0..mixed {
                let count = random.within(1, 6);
                let own = (0..count).map(|_| block.cells.map(|most| random.within(0, most)));
                meshes.push(block.network(rank, own.collect()));
            }
            if rank == 0 {
                meshes.push(block.uniform());
            }
            for leaves in &meshes {
                let edges = [0, 1, 2, 3].map(|side| Edge::random(block, side, &mut random));
                let worst = Drawing { ground: &ground, block, leaves, edges }.worst();
                let allowed = figure * (1.0 + 1e-9) + 1e-12 * ground.highest.max(1e-30);
                *share = share.max(worst / allowed);
            }
        }
        found
    };
    let most_of =
        |a: [f64; FIGURES], b: [f64; FIGURES]| -> [f64; FIGURES] { std::array::from_fn(|k| a[k].max(b[k])) };
    blocks(source, most).par_iter().enumerate().map(of_block).reduce(|| [0.0; FIGURES], most_of)
}

fn made(size: [usize; 2], height: impl Fn(usize, usize) -> f32) -> Terrain {
    ((0..size[0] * size[1]).map(|i| height(i % size[0], i / size[0])).collect(), size)
}

fn mountains(size: [usize; 2]) -> Terrain {
    let grid = common::terrain("procedural:mountains?size=97");
    made(size, |x, y| grid.heights_m[y * grid.width + x])
}

fn terrains() -> Vec<Terrain> {
    let sign = |v: usize| if v.is_multiple_of(2) { 1.0 } else { -1.0 };
    vec![
        mountains([97, 97]),
        mountains([75, 50]),
        mountains([65, 33]),
        made([50, 75], |x, y| if x + y / 5 < 27 { 0.0 } else { 1000.0 }),
        made([65, 65], |x, y| match (x, y) {
            (0, 17) | (33, 20) | (48, 48) => 500.0,
            (16, 5) | (31, 32) | (64, 63) => -300.0,
            _ => 0.0,
        }),
        made([40, 33], |x, y| 100.0 * sign(x + y)),
        made([33, 18], |x, y| 1e12 * sign(x / 3 + y)),
    ]
}

#[test]
fn figures_bound_every_mesh_of_a_block() {
    for (i, (samples, size)) in terrains().into_iter().enumerate() {
        for prefilter in [Prefilter::Subsample, Prefilter::LowPass] {
            let source = MemoryPyramid::from_samples(samples.clone(), size, prefilter);
            let found = shares(&source, u32::MAX, 2, i as u64);
            assert!(found.iter().all(|s| *s <= 1.0), "terrain {i}, {size:?}, {prefilter}: {found:?}");
        }
    }
}

/// Half of any rank's figures would be found to be too low.
#[test]
fn the_oracle_notices_figures_that_are_too_low() {
    for prefilter in [Prefilter::Subsample, Prefilter::LowPass] {
        let (samples, size) = mountains([97, 97]);
        let source = MemoryPyramid::from_samples(samples, size, prefilter);
        let found = shares(&source, u32::MAX, 2, 1);
        assert!(found.iter().all(|s| *s > 0.5), "{prefilter}: {found:?}");
    }
}

#[test]
fn figures_bound_measured_terrain_block_by_block() {
    for file in ["srtm/S33W071.tif", "puget-sound/ps_height_1k.png"] {
        // Says so where a file is absent.
        let Some(path) = common::data(file) else { continue };
        let source = MemoryPyramid::new(&common::terrain(&path), Prefilter::Subsample);
        let found = shares(&source, 3, 0, 7);
        eprintln!("{file}: worst shares of the figures {found:.3?}");
        assert!(found.iter().all(|s| (0.5..=1.0).contains(s)), "{file}: {found:?}");
    }
}

/// Where levels agree, the allowance for divided sides at most doubles the figure of the plain block.
#[test]
fn figures_are_tight() {
    for (samples, size) in terrains() {
        let source = MemoryPyramid::from_samples(samples, size, Prefilter::Subsample);
        let ground = Ground::new(&source);
        for block in blocks(&source, u32::MAX) {
            let drawn = |leaves: &[Right]| {
                Drawing { ground: &ground, block: &block, leaves, edges: Default::default() }.worst()
            };
            let mut plain = drawn(&block.uniform());
            for rank in 0..FIGURES {
                plain = plain.max(drawn(&block.network(rank, BTreeSet::new())));
                let figure = f64::from(block.figures.metres(rank));
                let at = format!("{size:?} level {} {:?} rank {rank}", block.level, block.rect);
                assert!(figure <= 2.1 * plain + 1e-12 * ground.highest, "{at}: {figure} {plain}");
            }
        }
    }
}

#[test]
fn figures_are_rounded_up_by_little() {
    let unknown = BlockDeviation::UNKNOWN.metres(0);
    let mut random = Random(5);
    let given = [0.0, 1e-45, f32::MIN_POSITIVE, 1.0, 1e12, unknown, f32::MAX, f32::INFINITY, f32::NAN];
    let drawn = (0..20_000).map(|_| f32::from_bits(random.next() & 0x7fff_ffff));
    for m in given.into_iter().chain(drawn) {
        let figures = BlockDeviation::of([m; FIGURES]);
        for k in 0..FIGURES {
            let stored = figures.metres(k);
            if m.is_nan() || m > unknown {
                assert_eq!(figures, BlockDeviation::UNKNOWN, "{m:e}");
            } else {
                // Below the normal numbers only the absolute error is small.
                let most = f64::from(m) * (1.0 + 1.0 / 128.0) + f64::from(f32::from_bits(1 << 16));
                assert!(stored >= m && f64::from(stored) <= most, "{m:e} {stored:e}");
            }
            for factor in [-2.5, 0.0, 0.3, 1.0, 1e6] {
                let scaled = figures.scaled(factor).metres(k);
                assert!(scaled == unknown || scaled >= m * factor.abs(), "{m:e} {factor}");
            }
        }
    }
    assert_eq!(BlockDeviation::UNKNOWN.scaled(0.1), BlockDeviation::UNKNOWN);
}

/// At most 5 % of the samples at two bytes each.
#[test]
fn figures_take_little_room() {
    let source = MemoryPyramid::from_samples(vec![1.0; 513 * 513], [513; 2], Prefilter::Subsample);
    let samples: usize = Ground::new(&source).levels.iter().map(Vec::len).sum();
    assert_eq!(size_of::<BlockDeviation>(), 2 * FIGURES);
    assert!(Deviations::of(&source).bytes() * 20 <= samples as u64 * 2);
}

#[test]
fn blocks_with_a_void_are_drawn_finely() {
    let unknown = BlockDeviation::UNKNOWN.metres(0);
    for void in [[20, 20], [32, 7], [74, 49]] {
        let (mut samples, size) = mountains([75, 50]);
        samples[void[1] * size[0] + void[0]] = VOID;
        let place = void.map(|v| i32::try_from(v).unwrap());
        for prefilter in [Prefilter::Subsample, Prefilter::LowPass] {
            let source = MemoryPyramid::from_samples(samples.clone(), size, prefilter);
            for Block { level, rect, figures, .. } in blocks(&source, u32::MAX) {
                assert!(figures.metres(0) < unknown, "{level} {rect:?}");
                for k in 1..FIGURES {
                    assert_eq!(figures.metres(k) == unknown, rect.contains(place), "{level} {rect:?} {k}");
                }
            }
        }
    }
}
