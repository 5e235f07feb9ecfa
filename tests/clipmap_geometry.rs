//! Windows, refill strips, control quads and patches against naive oracles.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

use std::collections::{HashMap, HashSet};

use proptest::prelude::*;
use tessclip::clipmap::{ClipmapShape, LPosition, Lattice, Rect, Windows, height_bound, refill_strips};
use tessclip::quads::{
    CONTROL_POINTS, OuterSpan, QUADS_PER_LEVEL, control_points, control_quads, l_quads, patches,
};

fn lattices() -> impl Strategy<Value = Lattice> {
    (1..700_i32, 1..700_i32).prop_map(|(x, y)| Lattice { last: [x, y] })
}

fn shapes() -> impl Strategy<Value = (Lattice, ClipmapShape)> {
    (lattices(), prop::sample::select(vec![15_u32, 31, 63]), 0..16_u32).prop_map(|(lattice, n, levels)| {
        let levels = levels % (lattice.coarsest_level() + 1) + 1;
        (lattice, ClipmapShape::new(n, levels, lattice).expect("within range"))
    })
}

fn cells(rect: Rect) -> impl Iterator<Item = [i32; 2]> {
    (rect.lo[1]..rect.hi[1]).flat_map(move |y| (rect.lo[0]..rect.hi[0]).map(move |x| [x, y]))
}

#[test]
fn table_1_of_song_2016_comes_out() {
    let lattice = Lattice { last: [1 << 24; 2] };
    for (levels, ours, classic) in
        [(7, 301, [27_783, 112_903, 455_175, 1_827_847]), (9, 387, [35_721, 145_161, 585_225, 2_350_089])]
    {
        for (n, classic) in [63, 127, 255, 511].into_iter().zip(classic) {
            let shape = ClipmapShape::new(n, levels, lattice).expect("in range");
            let rows = tessclip::rivals::footprints(shape);
            assert_eq!(rows[0].control_points, Some(ours));
            assert_eq!(rows[0].control_points_built, Some(44 * u64::from(levels)));
            assert_eq!(rows[1].vertices, classic);
            assert!(rows[0].bytes_per_frame <= 64 * u64::from(levels));
        }
    }
}

#[test]
fn the_layout_has_the_papers_numbers() {
    let lattice = Lattice { last: [1 << 20; 2] };
    for n in [15, 31, 63, 127, 255, 511, 1023] {
        let shape = ClipmapShape::new(n, 1, lattice).expect("in range");
        assert_eq!(n - 1, 4 * shape.m() + 2);
        assert_eq!(control_points(shape).len(), CONTROL_POINTS);
        let unique: HashSet<_> = control_points(shape).into_iter().collect();
        assert_eq!(unique.len(), CONTROL_POINTS);
        let l = LPosition { high_x: true, high_y: false };
        assert_eq!(control_quads(shape, l).len(), QUADS_PER_LEVEL);
        let corners: HashSet<u8> = l_quads(shape, l).iter().flat_map(|q| q.corners).collect();
        assert_eq!(corners.len(), 8, "the paper's 8 control points of an L");
    }
    assert!(ClipmapShape::new(16, 1, lattice).is_err());
    assert!(ClipmapShape::new(2047, 1, lattice).is_err());
    assert!(ClipmapShape::new(15, 0, lattice).is_err());
    assert!(ClipmapShape::new(15, 3, Lattice { last: [1, 2] }).is_err());
}

proptest! {
    #[test]
    fn windows_nest_and_are_even((lattice, shape) in shapes(), x in -50.0..800.0_f64, y in -50.0..800.0_f64) {
        let w = Windows::place(shape, lattice, [x, y], 0);
        let m = i32::try_from(shape.m()).expect("small");
        for l in 0..shape.levels() as usize {
            prop_assert!(w.origins[l].iter().all(|o| o % 2 == 0));
            if l > 0 {
                for a in 0..2 {
                    let offset = w.origins[l - 1][a] / 2 - w.origins[l][a];
                    prop_assert!(offset == m || offset == m + 1);
                }
            }
        }
    }

    #[test]
    fn a_covering_clipmap_covers_the_data(lattice in lattices(), u in 0.0..1.0_f64, v in 0.0..1.0_f64) {
        let shape = ClipmapShape::covering(15, lattice).expect("in range");
        let last = lattice.last.map(f64::from);
        let w = Windows::place(shape, lattice, [u * last[0], v * last[1]], 0);
        prop_assert_eq!(w.domain(), lattice.domain());
    }

    /// Every cell of the coarsest window is drawn by exactly one patch of exactly one level.
    #[test]
    fn patches_tile_the_domain((lattice, shape) in shapes(), u in 0.0..1.0_f64, v in 0.0..1.0_f64, finest in 0..3_u32) {
        let last = lattice.last.map(f64::from);
        let w = Windows::place(shape, lattice, [u * last[0], v * last[1]], finest);
        let mut drawn: HashMap<[i32; 2], u32> = HashMap::new();
        for (_, patch) in patches(&w) {
            let base = Rect { lo: lattice.base(patch.level, patch.rect.lo), hi: lattice.base(patch.level, patch.rect.hi) };
            for cell in cells(base) {
                *drawn.entry(cell).or_default() += 1;
            }
        }
        for cell in cells(w.domain()) {
            prop_assert_eq!(drawn.remove(&cell), Some(1));
        }
        prop_assert!(drawn.is_empty(), "something is drawn outside the data");
    }

    /// A cell's edge is divided exactly where the finer level's nodes cut it.
    #[test]
    fn outer_spans_follow_the_finer_lattice((lattice, shape) in shapes(), u in 0.0..1.0_f64, v in 0.0..1.0_f64) {
        let last = lattice.last.map(f64::from);
        let w = Windows::place(shape, lattice, [u * last[0], v * last[1]], 0);
        for (_, p) in patches(&w) {
            if p.level == 0 { continue; }
            let fine = w.covered(p.level - 1);
            for (side, span) in p.outer.iter().enumerate() {
                let along = side / 2;
                for c in 0..p.cells()[along] {
                    let mut a = p.rect.lo;
                    a[1 - along] = if side % 2 == 0 { p.rect.lo[1 - along] } else { p.rect.hi[1 - along] };
                    a[along] += i32::try_from(c).expect("small");
                    let mut b = a;
                    b[along] += 1;
                    let (a, b) = (lattice.base(p.level, a), lattice.base(p.level, b));
                    // A finer node strictly between both ends, with the edge on the finer border.
                    let mut middle = a;
                    middle[along] += 1 << (p.level - 1);
                    let cut = fine.on_perimeter(a) && fine.on_perimeter(b) && fine.on_perimeter(middle)
                        && middle[along] < b[along];
                    prop_assert_eq!(span.segments(c), if cut { 2 } else { 1 });
                }
            }
        }
    }

    #[test]
    fn refill_strips_are_what_is_missing((lattice, shape) in shapes(), a in prop::array::uniform2(0.0..700.0_f64), d in prop::array::uniform2(-60.0..60.0_f64)) {
        let old = Windows::place(shape, lattice, a, 0);
        let new = Windows::place(shape, lattice, [a[0] + d[0], a[1] + d[1]], 0);
        let refill = refill_strips(Some(&old), &new);
        let all = |r: Rect| -> HashSet<[i32; 2]> {
            (r.lo[1]..=r.hi[1]).flat_map(|y| (r.lo[0]..=r.hi[0]).map(move |x| [x, y])).collect()
        };
        for level in 0..shape.levels() {
            let had = all(old.loaded(level));
            let wanted: HashSet<_> = all(new.loaded(level)).difference(&had).copied().collect();
            let mut sent = HashSet::new();
            for s in refill.strips.iter().filter(|s| s.level == level) {
                for p in all(s.rect) {
                    prop_assert!(sent.insert(p), "sent twice");
                }
            }
            prop_assert_eq!(&sent, &wanted);
            let moved = [0, 1].map(|i| new.origins[level as usize][i] - old.origins[level as usize][i]);
            prop_assert!(sent.len() as u64 <= height_bound(shape.n(), moved[0], moved[1]));
        }
    }

    #[test]
    fn spans_count_what_they_add(from in 0..16_u32, len in 0..16_u32, log2 in 0..8_u32) {
        let span = OuterSpan { from, to: (from + len).min(16), log2 };
        let naive: u32 = (0..16).map(|c| span.segments(c) - 1).sum();
        prop_assert_eq!(span.extra(), naive);
        for cell in 0..16 {
            let before: u32 = (0..cell).map(|c| span.segments(c) - 1).sum();
            prop_assert_eq!(span.extra_before(cell), before);
        }
    }
}
