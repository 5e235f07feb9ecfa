//! Base surfaces by charts of sample lattices: where each base node stands.

use std::sync::Arc;

use glam::DVec3;

use super::{Ellipsoid, Face, SampledSurface, Surface};

/// The foot of a world position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Chart it lies in.
    pub chart: usize,
    /// Base-lattice coordinates there, fractional; on open charts possibly outside the data.
    pub at: [f64; 2],
    /// Metres above the base surface.
    pub height_m: f64,
}

/// A base surface addressed by chart number and base-lattice coordinates.
pub trait Charted: Send + Sync + std::fmt::Debug {
    /// World position (metres) and outward unit normal of the base surface at a place of a chart, also
    /// beyond the chart's borders as its lattice continues there.
    fn base(&self, chart: usize, at: [f64; 2]) -> (DVec3, DVec3);

    /// The foot of a world position on the base surface.
    fn foot(&self, p: DVec3) -> Foot;

    /// Upper bound of a base cell's sides and of the surface's change between its nodes, metres.
    fn cell_m(&self) -> f64;

    /// Smallest radius of curvature in metres.
    fn least_radius_m(&self) -> f64;

    /// How fast the surface bends along the lattice: a radius in metres, and the angle of a base cell in
    /// radians on it. What polynomials over blocks leave out grows with the fifth power of that angle.
    fn bend(&self) -> (f64, f64) {
        (self.least_radius_m(), self.cell_m() / self.least_radius_m())
    }

    /// Greatest magnitude of any world coordinate on the base surface, metres.
    fn reach_m(&self) -> f64;
}

/// An ellipsoid by the six faces of a cube; a node's direction is its geodetic normal.
#[derive(Clone, Copy, Debug)]
pub struct CubeSphere {
    /// The ellipsoid.
    pub ellipsoid: Ellipsoid,
    /// Cells a side of every face.
    pub size: i32,
}

impl Charted for CubeSphere {
    fn base(&self, chart: usize, at: [f64; 2]) -> (DVec3, DVec3) {
        let s = at.map(|v| 2.0 * v / f64::from(self.size) - 1.0);
        let normal = Face::ALL[chart].direction(s);
        (self.ellipsoid.surface_point_of_normal(normal), normal)
    }

    fn foot(&self, p: DVec3) -> Foot {
        let (uv, height_m) = self.ellipsoid.invert(p);
        let normal = self.ellipsoid.normal(uv);
        let face = Face::of(normal);
        let s = face.coordinates(normal).unwrap_or_default();
        let at = s.map(|v| ((v + 1.0) * 0.5 * f64::from(self.size)).clamp(0.0, f64::from(self.size)));
        Foot { chart: face.number(), at, height_m }
    }

    fn cell_m(&self) -> f64 {
        // Equal angles along the middle of a face; nowhere longer. A flat ellipsoid bends more at its rim.
        let [a, b] = [self.ellipsoid.a, self.ellipsoid.b];
        (a * a / b).max(b * b / a) * std::f64::consts::FRAC_PI_2 / f64::from(self.size) * 1.05
    }

    fn least_radius_m(&self) -> f64 {
        self.ellipsoid.least_radius_m()
    }

    fn bend(&self) -> (f64, f64) {
        // Cells are equal angles of the normal; positions change faster with it the flatter the body is.
        let [a, b] = [self.ellipsoid.a, self.ellipsoid.b];
        let ratio = (a / b).max(b / a);
        (a.max(b) * ratio, std::f64::consts::FRAC_PI_2 / f64::from(self.size) * ratio)
    }

    fn reach_m(&self) -> f64 {
        self.ellipsoid.a.max(self.ellipsoid.b)
    }
}

/// A surface whose chart coordinates grow evenly with the lattice's, cut into a grid of charts.
#[derive(Debug)]
pub struct GridCharts {
    /// The surface.
    pub surface: Arc<dyn Surface>,
    /// u, v of the first base node.
    pub origin: [f64; 2],
    /// u, v from one base node to the next.
    pub step: [f64; 2],
    /// First base index of each column and row of charts, and one past the last cell of all.
    pub cuts: [Vec<i32>; 2],
}

impl GridCharts {
    /// Chart coordinates of the whole grid's base coordinates.
    #[must_use]
    pub fn uv(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|a| self.origin[a] + at[a] * self.step[a])
    }

    /// First base index of a chart in the whole grid.
    #[must_use]
    pub fn offset(&self, chart: usize) -> [i32; 2] {
        let columns = self.cuts[0].len() - 1;
        [self.cuts[0][chart % columns], self.cuts[1][chart / columns]]
    }
}

impl Charted for GridCharts {
    fn base(&self, chart: usize, at: [f64; 2]) -> (DVec3, DVec3) {
        let offset = self.offset(chart);
        let uv = self.uv([0, 1].map(|a| f64::from(offset[a]) + at[a]));
        (self.surface.position(uv, 0.0), self.surface.normal(uv))
    }

    fn foot(&self, p: DVec3) -> Foot {
        let (mut uv, height_m) = self.surface.invert(p);
        let mut cell = [0; 2];
        let mut at = [0.0; 2];
        for a in 0..2 {
            let cuts = &self.cuts[a];
            let (first, last) = (f64::from(cuts[0]), f64::from(cuts[cuts.len() - 1]));
            if let Some(period) = self.surface.periods()[a] {
                // The turn that lies nearest to the middle of the data.
                let middle = self.origin[a] + self.step[a] * last * 0.5;
                uv[a] -= ((uv[a] - middle) / period).round() * period;
            }
            let g = (uv[a] - self.origin[a]) / self.step[a];
            let inside = g.clamp(first, last);
            cell[a] = cuts[1..].iter().position(|c| inside <= f64::from(*c)).unwrap_or(0);
            at[a] = g - f64::from(cuts[cell[a]]);
        }
        Foot { chart: cell[1] * (self.cuts[0].len() - 1) + cell[0], at, height_m }
    }

    fn cell_m(&self) -> f64 {
        let last = [0, 1].map(|a| f64::from(self.cuts[a][self.cuts[a].len() - 1]));
        let mut most = 0.0_f64;
        // Metrics of these surfaces are smooth and have their extremes at ends or middles of the axes.
        for y in 0..=8 {
            for x in 0..=8 {
                let uv = self.uv([last[0] * f64::from(x) / 8.0, last[1] * f64::from(y) / 8.0]);
                let [e, _, g] = self.surface.metric(uv);
                most = most.max(e.sqrt() * self.step[0]).max(g.sqrt() * self.step[1]);
            }
        }
        most * 1.1
    }

    fn least_radius_m(&self) -> f64 {
        self.surface.least_radius_m()
    }

    fn reach_m(&self) -> f64 {
        let last = [0, 1].map(|a| f64::from(self.cuts[a][self.cuts[a].len() - 1]));
        let mut most = 0.0_f64;
        for y in 0..=8 {
            for x in 0..=8 {
                let uv = self.uv([last[0] * f64::from(x) / 8.0, last[1] * f64::from(y) / 8.0]);
                most = most.max(self.surface.position(uv, 0.0).abs().max_element());
            }
        }
        most * 1.2
    }
}

/// A grid of positions as one chart: its nodes are the data themselves.
#[derive(Debug)]
pub struct PointChart {
    /// The positions.
    pub surface: Arc<SampledSurface>,
}

impl Charted for PointChart {
    fn base(&self, _chart: usize, at: [f64; 2]) -> (DVec3, DVec3) {
        (self.surface.position(at, 0.0), self.surface.normal(at))
    }

    fn foot(&self, p: DVec3) -> Foot {
        let (at, height_m) = self.surface.invert(p);
        Foot { chart: 0, at, height_m }
    }

    fn cell_m(&self) -> f64 {
        let grid = self.surface.grid();
        let ok = |i: usize| grid.valid.as_ref().is_none_or(|v| v[i]);
        let mut most = 0.0_f64;
        for i in 0..grid.xyz_m.len() {
            let p = DVec3::from_array(grid.xyz_m[i]);
            let mut to = |j: usize| {
                if ok(i) && ok(j) {
                    most = most.max(p.distance(DVec3::from_array(grid.xyz_m[j])));
                }
            };
            if i % grid.width + 1 < grid.width {
                to(i + 1);
            }
            if i + grid.width < grid.xyz_m.len() {
                to(i + grid.width);
            }
        }
        most.max(1e-9)
    }

    fn least_radius_m(&self) -> f64 {
        self.surface.least_radius_m()
    }

    fn reach_m(&self) -> f64 {
        self.surface.grid().xyz_m.iter().flatten().fold(1e-3, |m, v| m.max(v.abs()))
    }
}
