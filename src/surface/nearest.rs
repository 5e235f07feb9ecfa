//! The nearest point of a grid of bilinear patches.
//!
//! Exact search by bounding boxes: a patch lies within the box of its corners, so blocks of cells and
//! then cells are skipped when their box is farther than the best point so far. What remains is one
//! patch, on which an interior point is found by Newton's method and the border in closed form.

use glam::DVec3;

use super::sampled::Patch;

/// Cells along the side of a block.
const BLOCK: usize = 16;
/// Newton steps on one patch; it converges quadratically or not at all.
const STEPS: usize = 12;

/// Corners of an axis-parallel box, world metres.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    const NOTHING: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    fn with(self, p: DVec3) -> Self {
        Self { low: self.low.min(p), high: self.high.max(p) }
    }

    /// Squared distance to `p`, 0 inside.
    fn distance2(self, p: DVec3) -> f64 {
        (self.low - p).max(p - self.high).max(DVec3::ZERO).length_squared()
    }
}

/// The boxes of all blocks of a grid of `cells` columns and rows.
#[derive(Clone, Debug)]
pub(super) struct Index {
    cells: [usize; 2],
    blocks: Vec<Bounds>,
}

impl Index {
    /// Boxes around the patches that `patch` gives for (column, row).
    pub(super) fn new(cells: [usize; 2], patch: impl Fn(usize, usize) -> Patch) -> Self {
        let [across, down] = cells.map(|n| n.div_ceil(BLOCK));
        let mut blocks = vec![Bounds::NOTHING; across * down];
        for row in 0..cells[1] {
            for col in 0..cells[0] {
                let block = &mut blocks[(row / BLOCK) * across + col / BLOCK];
                *block = patch(col, row).corners.into_iter().fold(*block, Bounds::with);
            }
        }
        Self { cells, blocks }
    }

    /// Grid coordinates (fractional column, row) of the point nearest to `p`.
    pub(super) fn nearest(&self, p: DVec3, patch: impl Fn(usize, usize) -> Patch) -> [f64; 2] {
        let distances: Vec<f64> = self.blocks.iter().map(|b| b.distance2(p)).collect();
        // The nearest box first: it most likely holds the answer, and then few others are opened.
        let first = (0..distances.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b])).unwrap_or(0);
        let mut best = (f64::INFINITY, [0.0; 2]);
        for block in std::iter::once(first).chain(0..distances.len()) {
            if distances[block] < best.0 {
                self.search(block, p, &patch, &mut best);
            }
        }
        best.1
    }

    fn search(
        &self,
        block: usize,
        p: DVec3,
        patch: impl Fn(usize, usize) -> Patch,
        best: &mut (f64, [f64; 2]),
    ) {
        let across = self.cells[0].div_ceil(BLOCK);
        let (col, row) = (block % across * BLOCK, block / across * BLOCK);
        for r in row..(row + BLOCK).min(self.cells[1]) {
            for c in col..(col + BLOCK).min(self.cells[0]) {
                let patch = patch(c, r);
                let bounds = patch.corners.into_iter().fold(Bounds::NOTHING, Bounds::with);
                if bounds.distance2(p) < best.0 {
                    let (distance2, [s, t]) = nearest_on_patch(&patch, p);
                    if distance2 < best.0 {
                        *best = (distance2, [c as f64 + s, r as f64 + t]);
                    }
                }
            }
        }
    }
}

/// Squared distance and patch coordinates (0 to 1) of the nearest point of one patch.
fn nearest_on_patch(patch: &Patch, p: DVec3) -> (f64, [f64; 2]) {
    let [p00, p10, p01, p11] = patch.corners;
    let edges = [
        [along(p, p00, p10), 0.0],
        [along(p, p01, p11), 1.0],
        [0.0, along(p, p00, p01)],
        [1.0, along(p, p10, p11)],
    ];
    let inside = stationary(patch, p).into_iter();
    let mut best = (f64::INFINITY, [0.0; 2]);
    for st in edges.into_iter().chain(inside) {
        let distance2 = patch.point(st).distance_squared(p);
        if distance2 < best.0 {
            best = (distance2, st);
        }
    }
    best
}

/// Where along the segment from `a` (0) to `b` (1) it is nearest to `p`; 0 for one without length.
fn along(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let length2 = a.distance_squared(b);
    if length2 > 0.0 { ((p - a).dot(b - a) / length2).clamp(0.0, 1.0) } else { 0.0 }
}

/// The point where the line to `p` is perpendicular to the patch, by Newton's method from the middle,
/// held inside; `None` where the patch has no area to move on.
fn stationary(patch: &Patch, p: DVec3) -> Option<[f64; 2]> {
    let [p00, p10, p01, p11] = patch.corners;
    let twist = (p11 - p10) - (p01 - p00);
    let mut st = [0.5; 2];
    for _ in 0..STEPS {
        let [u, v] = patch.tangents(st);
        let off = patch.point(st) - p;
        let (fu, fv) = (off.dot(u), off.dot(v));
        let (uu, uv, vv) = (u.length_squared(), u.dot(v) + off.dot(twist), v.length_squared());
        let mut determinant = uu * vv - uv * uv;
        let mut mixed = uv;
        if determinant <= 0.0 {
            // Too far from the root for second derivatives to help: Gauss-Newton.
            mixed = u.dot(v);
            determinant = uu * vv - mixed * mixed;
        }
        let step = [(vv * fu - mixed * fv) / determinant, (uu * fv - mixed * fu) / determinant];
        if !step.iter().all(|d| d.is_finite()) {
            return None;
        }
        let next = [0, 1].map(|k: usize| (st[k] - step[k]).clamp(0.0, 1.0));
        let moved = (next[0] - st[0]).abs().max((next[1] - st[1]).abs());
        st = next;
        if moved < 1e-16 {
            break;
        }
    }
    Some(st)
}
