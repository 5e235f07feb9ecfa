//! A surface given by a grid of positions: any shape, overhangs included.

use std::collections::VecDeque;

use glam::DVec3;

use super::Surface;
use super::nearest::Index;
use crate::heights::PositionGrid;

/// One cell of the grid: a bilinear patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    /// World metres at (0, 0), (1, 0), (0, 1) and (1, 1).
    pub(super) corners: [DVec3; 4],
}

impl Patch {
    /// World position at patch coordinates, each from 0 to 1. Exact at the corners, and neighbours
    /// agree bit for bit on their common edge.
    pub(super) fn point(&self, [s, t]: [f64; 2]) -> DVec3 {
        let [p00, p10, p01, p11] = self.corners;
        let mix = |a: DVec3, b: DVec3, t: f64| a * (1.0 - t) + b * t;
        mix(mix(p00, p10, s), mix(p01, p11, s), t)
    }

    /// Derivatives along both coordinates, metres per cell.
    pub(super) fn tangents(&self, [s, t]: [f64; 2]) -> [DVec3; 2] {
        let [p00, p10, p01, p11] = self.corners;
        [(p10 - p00).lerp(p11 - p01, t), (p01 - p00).lerp(p11 - p10, s)]
    }

    fn normal(&self, st: [f64; 2]) -> DVec3 {
        let [u, v] = self.tangents(st);
        // Lengths taken away first: tiny and huge cells must not under- or overflow.
        let cross = u.normalize_or_zero().cross(v.normalize_or_zero());
        // Under rounding, the direction of a cross product means nothing.
        if cross.length_squared() > 1e-28 { cross.normalize() } else { DVec3::Z }
    }
}

/// Bilinear patches through a grid of positions; u = fractional column, v = fractional row.
///
/// Coordinates outside the grid are held at its border. The normal is that of the patch, so it jumps
/// at cell borders; it is +z where a patch has no area. Void nodes take the mean of the nodes around
/// them, from the rim inwards, so that every coordinate has a position. A grid that is folded over has
/// normals that point down, and [`Surface::invert`] finds the nearest of all its layers.
#[derive(Clone, Debug)]
pub struct SampledSurface {
    grid: PositionGrid,
    index: Index,
    least_radius_m: f64,
}

impl SampledSurface {
    /// The surface through the nodes of `grid`. Its `valid` is kept as it was.
    #[must_use]
    pub fn new(mut grid: PositionGrid) -> Self {
        close_voids(&mut grid);
        let cells = [grid.width - 1, grid.height - 1];
        let index = Index::new(cells, |c, r| patch(&grid, c, r));
        let least_radius_m = least_radius(&grid);
        Self { grid, index, least_radius_m }
    }

    /// The grid, with positions also at its void nodes.
    #[must_use]
    pub fn grid(&self) -> &PositionGrid {
        &self.grid
    }

    /// The patch at `uv` and the coordinates in it.
    fn locate(&self, uv: [f64; 2]) -> (Patch, [f64; 2]) {
        let place = |x: f64, nodes: usize| {
            // `max` last: NaN becomes the border as well.
            let x = x.min((nodes - 1) as f64).max(0.0);
            let cell = (x as usize).min(nodes - 2);
            (cell, x - cell as f64)
        };
        let (col, s) = place(uv[0], self.grid.width);
        let (row, t) = place(uv[1], self.grid.height);
        (patch(&self.grid, col, row), [s, t])
    }
}

/// The cell whose first corner is node (`col`, `row`).
fn patch(grid: &PositionGrid, col: usize, row: usize) -> Patch {
    let i = row * grid.width + col;
    let corners = [i, i + 1, i + grid.width, i + grid.width + 1];
    Patch { corners: corners.map(|i| DVec3::from_array(grid.xyz_m[i])) }
}

/// Up to four nodes next to node `i`.
fn neighbours(width: usize, height: usize, i: usize) -> impl Iterator<Item = usize> {
    let (col, row) = (i % width, i / width);
    let west = (col > 0).then(|| i - 1);
    let east = (col + 1 < width).then_some(i + 1);
    let south = (row > 0).then(|| i - width);
    let north = (row + 1 < height).then_some(i + width);
    [west, east, south, north].into_iter().flatten()
}

/// Gives the void nodes positions, the nearest to data first.
fn close_voids(grid: &mut PositionGrid) {
    let Some(mut known) = grid.valid.clone() else {
        return;
    };
    let (width, height) = (grid.width, grid.height);
    let near = |i| neighbours(width, height, i);
    let mut queued = known.clone();
    let mut queue: VecDeque<usize> =
        (0..known.len()).filter(|&i| !known[i] && near(i).any(|n| known[n])).collect();
    for &i in &queue {
        queued[i] = true;
    }
    while let Some(i) = queue.pop_front() {
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for n in near(i) {
            if known[n] {
                sum += DVec3::from_array(grid.xyz_m[n]);
                count += 1.0;
            } else if !queued[n] {
                queued[n] = true;
                queue.push_back(n);
            }
        }
        grid.xyz_m[i] = (sum / f64::max(count, 1.0)).to_array();
        known[i] = true;
    }
}

/// The sharpest bend between neighbouring cells: distance of their middles in metres over the angle
/// between their normals.
fn least_radius(grid: &PositionGrid) -> f64 {
    let middle = |c: usize, r: usize| {
        let patch = patch(grid, c, r);
        (patch.point([0.5; 2]), patch.normal([0.5; 2]))
    };
    let mut least = f64::INFINITY;
    let mut bend = |(p, n): (DVec3, DVec3), (q, m): (DVec3, DVec3)| {
        // The chord, not the angle: `acos` cannot tell small angles from none.
        let (distance, turn) = (p.distance(q), n.distance(m));
        if distance > 0.0 && turn > 1e-12 {
            least = least.min(distance / turn);
        }
    };
    for r in 0..grid.height - 1 {
        for c in 0..grid.width - 1 {
            let here = middle(c, r);
            if c > 0 {
                bend(middle(c - 1, r), here);
            }
            if r > 0 {
                bend(middle(c, r - 1), here);
            }
        }
    }
    least
}

impl Surface for SampledSurface {
    fn position(&self, uv: [f64; 2], h: f64) -> DVec3 {
        let (patch, st) = self.locate(uv);
        patch.point(st) + h * patch.normal(st)
    }

    fn normal(&self, uv: [f64; 2]) -> DVec3 {
        let (patch, st) = self.locate(uv);
        patch.normal(st)
    }

    fn tangents(&self, uv: [f64; 2]) -> [DVec3; 2] {
        let (patch, st) = self.locate(uv);
        patch.tangents(st)
    }

    /// Searches all patches by bounding boxes, so it costs far more than on the other surfaces. The
    /// height is the part of the offset along the normal; beyond the rim and over creases there is
    /// another part, which is lost.
    fn invert(&self, p: DVec3) -> ([f64; 2], f64) {
        let uv = self.index.nearest(p, |c, r| patch(&self.grid, c, r));
        let (patch, st) = self.locate(uv);
        (uv, (p - patch.point(st)).dot(patch.normal(st)))
    }

    fn periods(&self) -> [Option<f64>; 2] {
        [None; 2]
    }

    /// Estimated from the angles between neighbouring cells; bends inside one cell are not seen.
    fn least_radius_m(&self) -> f64 {
        self.least_radius_m
    }
}
