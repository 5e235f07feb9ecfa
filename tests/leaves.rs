//! Factors by error: any field of own nodes gives one conforming mesh, nodes need each other as the bisection says,
//! and grades bound what leaving nodes out does.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};

use proptest::prelude::*;
use tessclip::clipmap::{ClipmapShape, Lattice, Rect, Side, Windows};
use tessclip::pyramid::{BlockDeviation, FIGURES};
use tessclip::quads::{
    BLOCK_NODES, BlockKind, ByError, PATCH_CELLS, Patch, beyond, block_nodes, by_error, children, closed,
    full_cells, is_forced, parents, patches, rank,
};
use tessclip::reference::{Grade, grades, leaf_triangles};

type Point = [i32; 2];
type Node = [u32; 2];
type Rows = [u32; BLOCK_NODES];

struct Random(u64);

impl Random {
    fn of(seed: u64, level: u32, block: Point) -> Self {
        let mut hasher = DefaultHasher::new();
        (seed, level, block).hash(&mut hasher);
        Self(hasher.finish() | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// One of so many.
    fn pick(&mut self, count: usize) -> usize {
        usize::try_from(self.next() >> 20).unwrap() % count
    }

    /// From 0 to 1.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn block_of(patch: &Patch) -> Point {
    patch.rect.lo.map(|v| v.div_euclid(PATCH_CELLS.cast_signed()))
}

fn has(rows: &Rows, [x, y]: Node) -> bool {
    (rows[y as usize] >> x) & 1 == 1
}

fn toggled(mut rows: Rows, [x, y]: Node) -> Rows {
    rows[y as usize] ^= 1 << x;
    rows
}

fn rows_of(mut is_own: impl FnMut(Node) -> bool) -> Rows {
    let mut rows = [0; BLOCK_NODES];
    for [x, y] in block_nodes() {
        rows[y as usize] |= u32::from(is_own([x, y])) << x;
    }
    rows
}

fn inside(cells: Node, node: Node) -> bool {
    node[0] <= cells[0] && node[1] <= cells[1]
}

/// What a block covers, and its last nodes at their nominal places.
fn place_of(lattice: Lattice, level: u32, block: Point) -> (Rect, Node) {
    let lo = block.map(|v| v * PATCH_CELLS.cast_signed());
    let last = lattice.last_at(level);
    let hi = [0, 1].map(|a: usize| (lo[a] + PATCH_CELLS.cast_signed()).min(last[a]));
    let rect = Rect { lo, hi };
    (rect, full_cells(lattice, level, rect))
}

fn patch_of(level: u32, rect: Rect, by_error: ByError) -> Patch {
    let outer = Default::default();
    Patch { chart: 0, level, kind: BlockKind::M, rect, outer, by_error: Some(by_error) }
}

/// Own nodes of a block: from nothing to everything, anywhere.
fn random_rows(lattice: Lattice, seed: u64, level: u32, block: Point) -> Rows {
    let mut random = Random::of(seed, level, block);
    let chance = [0.0, 0.003, 0.02, 0.1, 0.5, 1.0][random.pick(6)];
    let wishes = rows_of(|_| random.share() < chance);
    let (rect, full) = place_of(lattice, level, block);
    closed([0, 1].map(|a: usize| rect.hi[a].abs_diff(rect.lo[a])), full, wishes)
}

/// All patches of windows with random own nodes.
fn random_patches(windows: &Windows, seed: u64) -> Vec<Patch> {
    let known: RefCell<HashMap<(u32, Point), Rows>> = RefCell::default();
    let own = |level: u32, block: Point| {
        let make = || random_rows(windows.lattice, seed, level, block);
        *known.borrow_mut().entry((level, block)).or_insert_with(make)
    };
    patches(windows).iter().map(|(_, patch)| by_error(windows, patch, &own)).collect()
}

/// Open edges, triangles that are flat or turn the wrong way, twice the area that is missing, and patches whose
/// counts are wrong or which have a vertex that no triangle uses.
fn faults(lattice: Lattice, patches: &[Patch]) -> [i64; 4] {
    let (domain, mut flat, mut miscounted) = (lattice.domain(), 0, 0);
    let mut area_left = [0, 1].map(|a| i64::from(domain.hi[a] - domain.lo[a])).iter().product::<i64>() * 2;
    let mut edges: HashMap<[Point; 2], [u32; 2]> = HashMap::new();
    for patch in patches {
        let bases = patch.bases(lattice);
        let triangles = leaf_triangles(patch);
        let used: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
        let counts = [patch.vertex_count(), patch.triangle_count()].map(|c| c as usize);
        let is_right = bases.len() == used.len() && [bases.len(), triangles.len()] == counts;
        miscounted += i64::from(!is_right);
        for t in triangles {
            let [a, b, c] = t.map(|ix| bases[ix as usize]);
            let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            flat += i64::from(cross <= 0);
            area_left -= i64::from(cross);
            for (p, q) in [(a, b), (b, c), (c, a)] {
                edges.entry([p.min(q), p.max(q)]).or_default()[usize::from(p < q)] += 1;
            }
        }
    }
    let border = |p: Point, q: Point, a: usize| p[a] == q[a] && [domain.lo[a], domain.hi[a]].contains(&p[a]);
    let whole = |[p, q]: [Point; 2], count: [u32; 2]| {
        if border(p, q, 0) || border(p, q, 1) { count[0] + count[1] == 1 } else { count == [1, 1] }
    };
    let open = edges.iter().filter(|(edge, count)| !whole(**edge, **count)).count();
    [open as i64, flat, area_left, miscounted]
}

fn windows_over(last: Point, at: [f64; 2], finest: u32) -> Windows {
    let lattice = Lattice { last };
    let shape = ClipmapShape::covering_by_blocks(127, lattice).unwrap();
    let centre = [0, 1].map(|a| at[a] * f64::from(last[a]));
    Windows::place(shape, lattice, centre, finest)
}

/// Most data ends inside a cell of the coarser levels, some inside a block, some with the last block.
fn sizes() -> impl Strategy<Value = i32> {
    prop_oneof![130..=700_i32, prop::sample::select(vec![144, 145, 146, 257, 513, 529])]
}

fn places() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), Just(1.0), -0.1..1.1_f64, 0.0..1.0_f64]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn any_field_of_own_nodes_conforms(
        size in [sizes(), sizes()], at in [places(), places()], finest in 0..2_u32, seed in any::<u64>()
    ) {
        let windows = windows_over(size.map(|s| s - 1), at, finest);
        prop_assert_eq!(windows.domain(), windows.lattice.domain());
        prop_assert_eq!(faults(windows.lattice, &random_patches(&windows, seed)), [0; 4]);
    }
}

/// The node of a patch at half cell `j` of a side, where there is one.
fn side_node(cells: Node, side: Side, j: u32) -> Option<Node> {
    let line = if side.is_high() { cells[1 - side.along()] } else { 0 };
    j.is_multiple_of(2).then(|| if side.along() == 0 { [j / 2, line] } else { [line, j / 2] })
}

/// Extra vertices at random places of a patch's sides, whatever lies beyond: nodes that it does not own, and middles
/// of cells up to so many half cells from its low corner.
fn random_extras(cells: Node, rows: &Rows, middles: Node, random: &mut Random) -> [u32; 4] {
    let chance = [0.0, 0.1, 0.5, 1.0][random.pick(4)];
    Side::ALL.map(|side| {
        let lacks = |j: &u32| match side_node(cells, side, *j) {
            Some(node) => !has(rows, node),
            None => *j < middles[side.along()],
        };
        let lacking = (1..2 * cells[side.along()]).filter(lacks);
        lacking.filter(|_| random.share() < chance).map(|j| 1_u32 << j).sum()
    })
}

proptest! {
    /// Also where the data ends at another chart: then a corner's legs may both be divided.
    #[test]
    fn any_extras_of_one_patch_conform(
        cells in [1..=16_u32, 1..=16_u32], whole in any::<bool>(), narrow in [0..2_u32, 0..2_u32],
        seed in any::<u64>()
    ) {
        let cells = if whole { [16; 2] } else { cells };
        // A level-1 cell whose last sample is missing has no middle.
        let last = [0, 1].map(|a: usize| 2 * cells[a] - narrow[a]);
        let lattice = Lattice { last: last.map(u32::cast_signed) };
        let rows = random_rows(lattice, seed, 1, [0; 2]);
        let extras = random_extras(cells, &rows, last, &mut Random::of(seed, 2, [0; 2]));
        let patch = patch_of(1, place_of(lattice, 1, [0; 2]).0, ByError { rows, extras });
        prop_assert_eq!(patch.cells(), cells);
        prop_assert_eq!(faults(lattice, &[patch]), [0; 4], "{:?}", patch);
    }
}

/// The patch with one vertex more or less on a side beyond which another one lies, or inside with own nodes that are
/// no longer closed: each must be noticed.
fn broken(windows: &Windows, patch: &Patch) -> Vec<Patch> {
    let (good, cells) = (patch.by_error.unwrap(), patch.cells());
    let mut out = Vec::new();
    let mut put = |bad: ByError| out.push(Patch { by_error: Some(bad), ..*patch });
    let is_corner = |node: Node| (0..2).all(|a| node[a] == 0 || node[a] == cells[a]);
    for side in Side::ALL {
        let s = side as usize;
        for j in 1..2 * cells[side.along()] {
            let half = i32::from(j > 16);
            let Some(there) = beyond(windows, patch.level, block_of(patch), side, half) else { continue };
            let mut more = good;
            more.extras[s] ^= 1 << j;
            match side_node(cells, side, j) {
                // Halves of cells are the finer level's; the data may end before that of the last one.
                None => {
                    let is_finer = there.level < patch.level && j + 1 < 2 * cells[side.along()];
                    if is_finer || good.has_extra(s, j) {
                        put(more);
                    }
                }
                Some(node) if good.has(node) => put(ByError { rows: toggled(good.rows, node), ..good }),
                Some(node) => {
                    put(more);
                    if !good.has_extra(s, j) {
                        put(ByError { rows: toggled(good.rows, node), ..good });
                    }
                }
            }
        }
    }
    for node in block_nodes().filter(|node| inside(cells, *node) && !is_corner(*node)) {
        let is_needed = children(node).into_iter().any(|c| good.has(c));
        let lacks = parents(node).into_iter().any(|p| inside(cells, p) && !good.has(p));
        let is_open = if good.has(node) { is_needed } else { lacks };
        if is_open {
            put(ByError { rows: toggled(good.rows, node), ..good });
        }
    }
    out
}

#[test]
fn a_wrong_mesh_is_noticed() {
    let mut tried = 0;
    for (last, at) in [([299, 216], [0.5, 0.4]), ([256, 143], [1.0, 0.0]), ([400, 333], [0.2, 0.7])] {
        let windows = windows_over(last, at, 0);
        let good = random_patches(&windows, 7);
        assert_eq!(faults(windows.lattice, &good), [0; 4]);
        for k in 0..good.len() {
            let all = broken(&windows, &good[k]);
            // One of each patch, another each time.
            let Some(bad) = all.get(k * 37 % all.len().max(1)) else { continue };
            let patches = [&good[..k], &[*bad], &good[k + 1..]].concat();
            assert_ne!(faults(windows.lattice, &patches), [0; 4], "{:?} {bad:?}", good[k]);
            tried += 1;
        }
    }
    assert!(tried > 100, "{tried}");
}

/// What bisection by itself tells of a node.
#[derive(Default)]
struct Found {
    ranks: BTreeSet<u32>,
    parents: BTreeSet<Point>,
    children: BTreeSet<Point>,
    halved: Vec<[Point; 3]>,
}

/// Halves a triangle, its right angle first, and what comes of it.
fn bisect([right, p, q]: [Point; 3], rank: u32, parent: Option<Point>, found: &mut BTreeMap<Point, Found>) {
    if (p[0] + q[0]) % 2 != 0 || (p[1] + q[1]) % 2 != 0 {
        assert_eq!(rank, 0);
        return;
    }
    let middle = [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2];
    let node = found.entry(middle).or_default();
    node.ranks.insert(rank);
    node.halved.push([right, p, q]);
    node.parents.extend(parent);
    if let Some(parent) = parent {
        found.get_mut(&parent).unwrap().children.insert(middle);
    }
    bisect([middle, right, p], rank - 1, Some(middle), found);
    bisect([middle, right, q], rank - 1, Some(middle), found);
}

fn bisected() -> BTreeMap<Point, Found> {
    let mut found = BTreeMap::new();
    for right in [[0, 0], [16, 16]] {
        bisect([right, [16, 0], [0, 16]], 8, None, &mut found);
    }
    found
}

fn signed(nodes: Vec<Node>) -> BTreeSet<Point> {
    let count = nodes.len();
    let set: BTreeSet<_> = nodes.into_iter().map(|n| n.map(u32::cast_signed)).collect();
    assert_eq!(set.len(), count, "twice the same");
    set
}

#[test]
fn nodes_need_each_other_as_the_bisection_says() {
    let found = bisected();
    for node in block_nodes() {
        let Some(own) = found.get(&node.map(u32::cast_signed)) else {
            assert!(node.iter().all(|v| v.is_multiple_of(16)), "{node:?} is never halved");
            assert_eq!((rank(node), parents(node).len(), children(node).len()), (9, 0, 0));
            continue;
        };
        assert_eq!(own.ranks, BTreeSet::from([rank(node)]), "{node:?}");
        assert_eq!(own.parents, signed(parents(node)), "{node:?}");
        assert_eq!(own.children, signed(children(node)), "{node:?}");
    }
}

#[test]
fn forced_nodes_are_what_the_datas_end_needs() {
    let found = bisected();
    let mut forced = 0;
    for k in 0..16_u32 * 16 * 4 {
        let cells = [1 + k % 16, 1 + k / 16 % 16];
        let full = [cells[0] - (k / 256) % 2, cells[1] - k / 512];
        let straddles = |t: &[Point; 3]| {
            let touches = |a: usize| t.iter().any(|p| p[a] < cells[a].cast_signed());
            let reaches = |a: usize| t.iter().any(|p| p[a] > full[a].cast_signed());
            touches(0) && touches(1) && (reaches(0) || reaches(1))
        };
        for (middle, own) in &found {
            let node = middle.map(i32::cast_unsigned);
            let wanted = inside(cells, node) && own.halved.iter().any(straddles);
            assert_eq!(is_forced(cells, full, node), wanted, "{cells:?} {full:?} {node:?}");
            forced += usize::from(wanted);
        }
        // Nothing is added that neither the data's end nor a child asks for.
        let least = closed(cells, full, [0; BLOCK_NODES]);
        for node in block_nodes().filter(|node| has(&least, *node)) {
            let is_corner = (0..2).all(|a| node[a] == 0 || node[a] == cells[a]);
            let is_needed = children(node).into_iter().any(|c| has(&least, c));
            assert!(inside(cells, node), "{cells:?} {node:?}");
            assert!(is_corner || is_needed || is_forced(cells, full, node), "{cells:?} {full:?} {node:?}");
        }
        assert_eq!(closed(cells, full, least), least);
    }
    assert!(forced > 10_000, "{forced}");
}

/// Heights of a block's nodes, of one of several kinds.
fn random_heights(random: &mut Random) -> [[f64; BLOCK_NODES]; BLOCK_NODES] {
    let slopes: Vec<f64> = (0..4).map(|_| 6.0 * random.share() - 3.0).collect();
    let (kind, rough) = (random.pick(3), random.share());
    let mut out = [[0.0; BLOCK_NODES]; BLOCK_NODES];
    for [x, y] in block_nodes() {
        let (u, v) = (f64::from(x), f64::from(y));
        let smooth = slopes[0] * u + slopes[1] * v + slopes[2] * u * v / 10.0 + slopes[3] * u * u / 16.0;
        let noise = (2.0 * random.share() - 1.0) * rough * [0.01, 1.0, 5.0][random.pick(3)];
        let peak = if random.pick(6) == 0 { 100.0 * random.share() } else { 0.0 };
        out[y as usize][x as usize] = [peak, smooth + noise, smooth][kind];
    }
    out
}

fn grade_at(of: &[[Grade; BLOCK_NODES]; BLOCK_NODES], [x, y]: Node) -> Grade {
    of[y as usize][x as usize]
}

/// Figures of a block whose finest triangles deviate by so much, and by nothing known without any nodes.
fn finest_alone(metres: f32) -> BlockDeviation {
    let mut figures = [f32::INFINITY; FIGURES];
    figures[0] = metres;
    BlockDeviation::of(figures)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn nodes_above_any_threshold_are_closed(
        cells in [1..=16_u32, 1..=16_u32], whole in any::<bool>(), narrow in [0..2_u32, 0..2_u32],
        seed in any::<u64>(), voids in prop_oneof![Just(0.0), Just(0.01), Just(0.5), Just(1.0)]
    ) {
        let mut random = Random::of(seed, 0, [0; 2]);
        let cells = if whole { [16; 2] } else { cells };
        let full = [0, 1].map(|a: usize| cells[a] - narrow[a]);
        let heights = random_heights(&mut random);
        let valid = heights.map(|row| row.map(|_| random.share() >= voids));
        let mut metres = [0.0; FIGURES];
        let mut most = 0.0;
        for m in &mut metres {
            most += [0.0, 0.1, 3.0][random.pick(3)] * random.share() as f32;
            *m = if random.pick(12) == 0 { f32::INFINITY } else { most };
        }
        // Figures never fall from rank to rank.
        for k in 1..FIGURES {
            metres[k] = metres[k].max(metres[k - 1]);
        }
        let figures = BlockDeviation::of(metres);
        let height = |[x, y]: Node| {
            assert!(inside(cells, [x, y]), "no such sample");
            valid[y as usize][x as usize].then_some(heights[y as usize][x as usize])
        };
        let all = grades(&height, cells, full, figures);
        for node in block_nodes() {
            if let Grade::Metres(m) = grade_at(&all, node) {
                let [finest, most] = [0, rank(node)].map(|k| f64::from(figures.metres(k as usize)));
                prop_assert!(m >= finest && m <= most, "{:?}: {}", node, m);
            }
            prop_assert!(inside(cells, node) || grade_at(&all, node) == Grade::Never);
        }
        for _ in 0..8 {
            let threshold = [0.0, 0.1, 3.0, 100.0][random.pick(4)] * random.share();
            let own = rows_of(|node| grade_at(&all, node) > Grade::Metres(threshold));
            prop_assert_eq!(closed(cells, full, own), own);
        }
    }
}

/// Worst distance of a whole block's triangles from its samples, each of which must be covered.
fn worst_of(by_error: ByError, heights: &[[f64; BLOCK_NODES]; BLOCK_NODES]) -> f64 {
    let patch = patch_of(0, Rect { lo: [0; 2], hi: [16; 2] }, by_error);
    let bases = patch.bases(Lattice { last: [16; 2] });
    let at = |p: Point| heights[usize::try_from(p[1]).unwrap()][usize::try_from(p[0]).unwrap()];
    let cross = |a: Point, b: Point, c: Point| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let (mut worst, mut covered) = (0.0_f64, BTreeSet::new());
    for t in leaf_triangles(&patch) {
        let [a, b, c] = t.map(|ix| bases[ix as usize]);
        let area = f64::from(cross(a, b, c));
        for p in block_nodes().map(|node| node.map(u32::cast_signed)) {
            let shares = [cross(b, c, p), cross(c, a, p), cross(a, b, p)];
            if shares.iter().all(|s| *s >= 0) {
                let [u, v, w] = shares.map(|s| f64::from(s) / area);
                worst = worst.max((u * at(a) + v * at(b) + w * at(c) - at(p)).abs());
                covered.insert(p);
            }
        }
    }
    assert_eq!(covered.len(), BLOCK_NODES * BLOCK_NODES, "a hole");
    worst
}

/// Blocks drawn at thresholds that their own grades suggest, all but the grades of one node and of those that need
/// it cut to the given share; how many were drawn, how many of them farther off than their threshold, and how many
/// at least nine tenths as far.
fn drawn_at_thresholds(trials: u64, share: f64) -> [usize; 3] {
    let (mut drawn, mut too_far, mut tight) = (0, 0, 0);
    for seed in 0..trials {
        let mut random = Random::of(seed, 1, [0; 2]);
        let heights = random_heights(&mut random);
        let height = |[x, y]: Node| Some(heights[y as usize][x as usize]);
        let mut all = grades(&height, [16; 2], [16; 2], finest_alone(0.0));
        let metres = |grade: Grade| if let Grade::Metres(m) = grade { Some(m) } else { None };
        let some: Vec<_> = block_nodes().filter_map(|n| Some((n, metres(grade_at(&all, n))?))).collect();
        if some.is_empty() {
            continue;
        }
        for _ in 0..6 {
            let (node, grade) = some[random.pick(some.len())];
            let mut threshold = grade * [1.0, 0.98, 1.02][random.pick(3)];
            let good = all;
            if share < 1.0 {
                threshold = grade * (1.0 + share) / 2.0;
                let mut needing = vec![node];
                while let Some([x, y]) = needing.pop() {
                    let own = &mut all[y as usize][x as usize];
                    *own = metres(*own).map_or(*own, |m| Grade::Metres(m.min(share * grade)));
                    needing.extend(children([x, y]));
                }
            }
            let rows = rows_of(|node| grade_at(&all, node) > Grade::Metres(threshold));
            assert_eq!(closed([16; 2], [16; 2], rows), rows);
            let extras = random_extras([16; 2], &rows, [0; 2], &mut random);
            let worst = worst_of(ByError { rows, extras }, &heights);
            drawn += 1;
            too_far += usize::from(worst > threshold * (1.0 + 1e-9) + 1e-9);
            tight += usize::from(worst >= 0.9 * threshold);
            all = good;
        }
    }
    [drawn, too_far, tight]
}

#[test]
fn nothing_deviates_by_more_than_the_threshold() {
    let [drawn, too_far, tight] = drawn_at_thresholds(200, 1.0);
    assert_eq!(too_far, 0, "of {drawn}");
    assert!(drawn > 1_000 && 3 * tight > drawn, "{tight} of {drawn} are near their threshold");
}

#[test]
fn a_grade_that_is_too_low_is_noticed() {
    let [drawn, too_far, _] = drawn_at_thresholds(50, 0.9);
    assert!(5 * too_far > drawn, "{too_far} of {drawn}");
}
