//! What the tests of geomipmaps and chunks measure triangles, errors and selections with.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::heights::HeightGrid;
use crate::reference::Frustum;
use crate::renderer::PlaneStand;
use crate::rivals::Ground;
use crate::rivals::stage::Stand;
use crate::{Prefilter, Terrain};

type Point = [i64; 2];

/// Triangles of an index set over a grid of `cells` cells a side, in base samples clamped to the data.
pub(crate) fn triangles(
    numbers: &[u16],
    cells: u32,
    lo: [i32; 2],
    step: u32,
    last: [i32; 2],
) -> Vec<[Point; 3]> {
    let row = i64::from(cells) + 1;
    let place = |v: u16| {
        let node = [i64::from(v) % row, i64::from(v) / row];
        [0, 1].map(|a| (i64::from(lo[a]) + node[a] * i64::from(step)).min(last[a].into()))
    };
    numbers.chunks_exact(3).map(|t| [place(t[0]), place(t[1]), place(t[2])]).collect()
}

/// Twice the area, positive counter-clockwise.
fn twice_area([a, b, c]: &[Point; 3]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Fails unless the triangles tile the rectangle from 0 to `last`, those without area left out; returns the
/// edges that belong to one triangle only, all on the rectangle's border.
pub(crate) fn assert_conforming(triangles: &[[Point; 3]], last: [i32; 2]) -> Vec<[Point; 2]> {
    let last = last.map(i64::from);
    let mut edges = BTreeSet::new();
    let mut area = 0;
    for t in triangles {
        let twice = twice_area(t);
        assert!(twice >= 0, "{t:?} is clockwise");
        area += twice;
        if twice > 0 {
            for k in 0..3 {
                assert!(
                    edges.insert([t[k], t[(k + 1) % 3]]),
                    "{t:?} shares an edge with one of the same side"
                );
            }
        }
    }
    assert_eq!(area, 2 * last[0] * last[1]);
    let open: Vec<[Point; 2]> = edges.iter().filter(|e| !edges.contains(&[e[1], e[0]])).copied().collect();
    for [p, q] in &open {
        let on_border = (0..2).any(|a| p[a] == q[a] && (p[a] == 0 || p[a] == last[a]));
        assert!(on_border, "{p:?} to {q:?} is open");
    }
    open
}

/// Fails unless an index set tiles its grid and lists on each side (south, north, west, east) every
/// `steps[side]`-th vertex, no other.
pub(crate) fn assert_tiles(numbers: &[u16], cells: u32, steps: [u32; 4]) {
    let last = [cells.cast_signed(); 2];
    let all = triangles(numbers, cells, [0, 0], 1, last);
    assert!(all.iter().all(|t| twice_area(t) > 0), "a triangle has no area");
    let open = assert_conforming(&all, last);
    for (side, step) in steps.into_iter().enumerate() {
        let (along, across) = if side < 2 { (0, 1) } else { (1, 0) };
        let line = if side % 2 == 0 { 0 } else { i64::from(cells) };
        let on_side = open.iter().filter(|[p, q]| p[across] == line && q[across] == line);
        let found: BTreeSet<i64> = on_side.flatten().map(|p| p[along]).collect();
        let expected: BTreeSet<i64> = (0..=i64::from(cells)).step_by(step as usize).collect();
        assert_eq!(found, expected, "side {side}");
    }
}

/// Fails unless the set still tiles what the data leaves of its grid.
pub(crate) fn assert_tiles_clamped(numbers: &[u16], cells: u32, last: [i32; 2]) {
    assert_conforming(&triangles(numbers, cells, [0, 0], 1, last), last);
}

/// Largest vertical distance of samples from triangles, the slow way: every sample in every triangle.
pub(crate) fn slow_error(ground: &Ground, triangles: &[[Point; 3]]) -> f64 {
    let height = |p: Point| f64::from(ground.height(p.map(|v| v as i32)));
    let mut worst = 0.0_f64;
    for t in triangles.iter().filter(|t| twice_area(t) > 0) {
        let low = [0, 1].map(|a| t[0][a].min(t[1][a]).min(t[2][a]));
        let high = [0, 1].map(|a| t[0][a].max(t[1][a]).max(t[2][a]));
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                let p = [x, y];
                let shares = [[p, t[1], t[2]], [t[0], p, t[2]], [t[0], t[1], p]].map(|s| twice_area(&s));
                if shares.iter().all(|s| *s >= 0) {
                    let sum: f64 = (0..3).map(|k| shares[k] as f64 * height(t[k])).sum();
                    worst = worst.max((sum / twice_area(t) as f64 - height(p)).abs());
                }
            }
        }
    }
    worst
}

/// Ground from a function of the sample.
pub(crate) fn ground(width: usize, height: usize, of: impl Fn(usize, usize) -> f32) -> Ground {
    let heights = (0..width * height).map(|k| of(k % width, k / width)).collect();
    let grid = HeightGrid::new(width, height, heights).unwrap();
    Ground::of(&Terrain::new(&grid, Prefilter::default())).unwrap()
}

/// Ground without pattern, heights from 0 to 100.
pub(crate) fn rough(width: usize, height: usize) -> Ground {
    ground(width, height, |x, y| {
        let mixed = (x as u32 ^ (y as u32).wrapping_mul(0x9e37_79b9)).wrapping_mul(0x85eb_ca6b);
        ((mixed ^ mixed >> 15) % 1_001) as f32 * 0.1
    })
}

/// A camera that sees everything.
pub(crate) fn stand(eye: DVec3) -> Stand {
    Stand {
        plane: PlaneStand {
            anchor: [0, 0],
            anchor_height_m: 0.0,
            anchor_m: DVec3::ZERO,
            eye_samples: [0.0; 2],
        },
        eye,
        frustum: Frustum { planes: [[0.0, 0.0, 0.0, 1.0]; 5] },
        pixels: 500.0,
        spacing_m: [1.0; 2],
    }
}

/// The same that sees only what lies east of a line, in samples.
pub(crate) fn stand_seeing_east_of(eye: DVec3, line: f32) -> Stand {
    let mut stand = stand(eye);
    stand.frustum.planes[0] = [1.0, 0.0, 0.0, -line];
    stand
}
