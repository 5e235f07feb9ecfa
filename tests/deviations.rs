//! Deviations of blocks bound every mixture of steps that can be drawn, against an oracle of their own.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

mod common;
use tessclip::clipmap::{Lattice, Rect};
use tessclip::pyramid::{
    BlockDeviation, Deviations, MemoryPyramid, Prefilter, STEPS, SampleSource, VOID, blocks_at,
};

type Point = [i32; 2];
type Vertex = (Point, f64);
type Terrain = (Vec<f32>, [usize; 2]);

struct Random(u64);
impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        u32::try_from(self.0 >> 33).unwrap()
    }

    fn within(&mut self, from: u32, to: u32) -> u32 {
        from + self.next() % (to - from + 1)
    }
}

/// How one side of a block is drawn: exponent of each half, and whether its heights are the finer level's.
#[derive(Clone, Copy)]
struct Edge {
    exponents: [u32; 2],
    finer: bool,
}

impl Edge {
    fn random(level: u32, k: u32, random: &mut Random) -> Self {
        let finer = level > 0 && random.within(0, 1) == 1;
        let from = level - u32::from(finer);
        Self { exponents: [0; 2].map(|_| random.within(from, level + k)), finer }
    }
}

/// One block, drawn.
struct Drawing<'a> {
    levels: &'a [Vec<f32>],
    lattice: Lattice,
    level: u32,
    k: u32,
    rect: Rect,
    /// South, north, west, east.
    edges: [Edge; 4],
}

impl Drawing<'_> {
    fn lies_on(&self, p: Point) -> [bool; 4] {
        let Rect { lo, hi } = self.rect;
        [p[1] == lo[1], p[1] == hi[1], p[0] == lo[0], p[0] == hi[0]]
    }

    fn vertex(&self, p: Point) -> Vertex {
        let finer = self.lies_on(p).iter().zip(self.edges).any(|(on, edge)| *on && edge.finer);
        (p, sample(self.levels, self.lattice, self.level - u32::from(finer), p))
    }

    /// Vertices from `a` to `b`, the two ends of a cell's side, which lies on side `side` of the block or inside.
    fn chain(&self, a: Point, b: Point, side: usize) -> Vec<Vertex> {
        let along = usize::from(side >= 2);
        let mut points = vec![self.vertex(a)];
        if self.lies_on(a)[side] && self.lies_on(b)[side] {
            for at in a[along] + 1..b[along] {
                let half = usize::from(at >= self.rect.lo[along] + (8 << self.level));
                if at % (1 << self.edges[side].exponents[half]) == 0 {
                    points.push(self.vertex(if along == 0 { [at, a[1]] } else { [a[0], at] }));
                }
            }
        }
        points.push(self.vertex(b));
        points
    }

    fn triangles(&self) -> Vec<[Vertex; 3]> {
        let (Rect { lo, hi }, step) = (self.rect, 1_i32 << (self.level + self.k));
        let mut out = Vec::new();
        for y in (lo[1]..hi[1]).step_by(step.unsigned_abs() as usize) {
            for x in (lo[0]..hi[0]).step_by(step.unsigned_abs() as usize) {
                let end = |v: i32, a: usize| (v + step).min(hi[a]);
                let (sw, ne) = ([x, y], [end(x, 0), end(y, 1)]);
                let (se, nw) = ([ne[0], y], [x, ne[1]]);
                let sides = [(sw, se), (nw, ne), (sw, nw), (se, ne)];
                let [south, north, west, east] = [0, 1, 2, 3].map(|i| self.chain(sides[i].0, sides[i].1, i));
                out.extend(south[1..].windows(2).map(|s| [s[0], s[1], self.vertex(nw)]));
                out.extend(west.windows(2).map(|w| [w[0], south[1], w[1]]));
                out.extend(north[..north.len() - 1].windows(2).map(|n| [n[0], n[1], self.vertex(se)]));
                out.extend(east.windows(2).map(|e| [e[0], e[1], north[north.len() - 2]]));
            }
        }
        out
    }

    /// Worst distance of what is drawn from the base samples, each of which must be covered.
    fn worst(&self) -> f64 {
        let Rect { lo, hi } = self.rect;
        let mut covered = vec![false; usize::try_from(self.rect.count()).unwrap()];
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
                    worst = worst.max((sample(self.levels, self.lattice, 0, p) - drawn).abs());
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

/// A level's sample at a base index where it has one.
fn sample(levels: &[Vec<f32>], lattice: Lattice, level: u32, p: Point) -> f64 {
    let node = lattice.node(level, p);
    let at = usize::try_from(node[1] * (lattice.last_at(level)[0] + 1) + node[0]).unwrap();
    f64::from(levels[level as usize][at])
}

fn read_levels(source: &MemoryPyramid) -> Vec<Vec<f32>> {
    let lattice = source.lattice();
    let mut levels = vec![Vec::new(); lattice.coarsest_level() as usize + 1];
    for (out, l) in levels.iter_mut().zip(0..) {
        source.read(l, Rect { lo: [0, 0], hi: lattice.last_at(l) }, out);
    }
    levels
}

/// Every block with its level, base rectangle and figures.
fn blocks(source: &MemoryPyramid) -> Vec<(u32, Rect, BlockDeviation)> {
    let (lattice, deviations) = (source.lattice(), Deviations::of(source));
    let mut all = Vec::new();
    for level in 0..=lattice.coarsest_level() {
        let [width, height] = blocks_at(lattice, level);
        for y in 0..height {
            for x in 0..width {
                let mut figures = Vec::new();
                deviations.read(level, Rect { lo: [x, y], hi: [x, y] }, &mut figures);
                let lo = lattice.base(level, [16 * x, 16 * y]);
                let hi = lattice.base(level, [16 * x + 16, 16 * y + 16]);
                all.push((level, Rect { lo, hi }, figures[0]));
            }
        }
    }
    all
}

/// Drawings, random mixtures of steps, that lie farther off than `scale` times their block's figure.
fn violations(source: &MemoryPyramid, scale: f64, seed: u64) -> usize {
    let (lattice, levels, mut random) = (source.lattice(), read_levels(source), Random(seed));
    let highest = levels[0].iter().fold(0.0_f64, |m, h| m.max(f64::from(h.abs())));
    let mut found = 0;
    for (level, rect, figures) in blocks(source) {
        for k in 0..5 {
            let figure = f64::from(figures.metres(k as usize));
            assert!(k == 0 || figure >= f64::from(figures.metres(k as usize - 1)), "falls with the step");
            for _ in 0..2 {
                let edges = [0; 4].map(|_| Edge::random(level, k, &mut random));
                let drawing = Drawing { levels: &levels, lattice, level, k, rect, edges };
                let allowed = scale * figure * (1.0 + 1e-9) + 1e-12 * highest;
                found += usize::from(drawing.worst() > allowed);
            }
        }
    }
    found
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
fn figures_bound_every_mixture_of_steps() {
    for (i, (samples, size)) in terrains().into_iter().enumerate() {
        for prefilter in [Prefilter::Subsample, Prefilter::LowPass] {
            let source = MemoryPyramid::from_samples(samples.clone(), size, prefilter);
            assert_eq!(violations(&source, 1.0, i as u64), 0, "terrain {i}, {size:?}, {prefilter}");
        }
    }
}

#[test]
fn the_oracle_notices_figures_that_are_too_low() {
    for prefilter in [Prefilter::Subsample, Prefilter::LowPass] {
        let (samples, size) = mountains([97, 97]);
        let source = MemoryPyramid::from_samples(samples, size, prefilter);
        assert!(violations(&source, 0.5, 1) > 0, "{prefilter}");
    }
}

/// Where levels agree, the allowance for divided sides at most doubles the figure of the plain block.
#[test]
fn figures_are_tight() {
    for (samples, size) in terrains() {
        let source = MemoryPyramid::from_samples(samples, size, Prefilter::Subsample);
        let (lattice, levels) = (source.lattice(), read_levels(&source));
        let highest = levels[0].iter().fold(0.0_f64, |m, h| m.max(f64::from(h.abs())));
        for (level, rect, figures) in blocks(&source) {
            let mut plain = 0.0_f64;
            for k in 0..5 {
                let edges = [Edge { exponents: [level + k; 2], finer: false }; 4];
                plain = plain.max(Drawing { levels: &levels, lattice, level, k, rect, edges }.worst());
                let figure = f64::from(figures.metres(k as usize));
                assert!(figure <= 2.1 * plain + 1e-12 * highest, "{size:?} {level} {rect:?} {k}");
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
        let figures = BlockDeviation::of([m; STEPS]);
        for k in 0..STEPS {
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

#[test]
fn figures_take_little_room() {
    let source = MemoryPyramid::from_samples(vec![1.0; 513 * 513], [513; 2], Prefilter::Subsample);
    let samples: usize = read_levels(&source).iter().map(Vec::len).sum();
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
            for (level, rect, figures) in blocks(&source) {
                assert!(figures.metres(0) < unknown, "{level} {rect:?}");
                for k in 1..STEPS {
                    assert_eq!(figures.metres(k) == unknown, rect.contains(place), "{level} {rect:?} {k}");
                }
            }
        }
    }
}
