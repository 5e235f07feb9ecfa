//! Where the line through a world point and its foot crosses the triangles of a cell.

use std::cmp::Ordering;

use glam::DVec3;

use crate::scene::Curved;

/// How far beside a triangle a line may pass and still meet it, in shares of the triangle: what rounding leaves.
pub(super) const EXACT: f64 = 1e-7;
/// How far beyond the rim of positions a point may lie and still count as over them, in cells: they are rounded to
/// f32 when they are drawn.
const RIM: f64 = 1e-3;

/// A world point, its foot, and the line through both, along which the surface is looked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stand {
    pub chart: usize,
    /// Base coordinates of the foot, held to the data.
    pub at: [f64; 2],
    /// How far the foot lies beyond the data, base samples.
    pub beyond: f64,
    /// World metres.
    pub foot: DVec3,
    /// Outward normal of the base surface at the foot, unit.
    pub up: DVec3,
    /// Unit direction of the line: that normal, but where positions are creased.
    pub along: DVec3,
    /// Of the point above the foot, metres along the line.
    pub height_m: f64,
}

/// A triangle over a cell.
pub(crate) struct Triangle {
    /// Base nodes of its corners.
    pub nodes: [[i32; 2]; 3],
    /// World metres; `None` where one of them is void, so that it is not drawn.
    pub corners: Option<[DVec3; 3]>,
}

/// A cell of a mesh.
pub(crate) struct Cell {
    /// Its level.
    pub level: u32,
    /// Base nodes of its low and high corner.
    pub lo: [i32; 2],
    /// The other one.
    pub hi: [i32; 2],
    /// What is drawn over it.
    pub triangles: Vec<Triangle>,
}

/// Where a line crosses the plane of a triangle.
#[derive(Clone, Copy)]
pub(super) struct Crossing {
    /// How far beside the triangle, in shares of it; not above 0 inside.
    pub outside: f64,
    /// Along the line from the foot, metres.
    pub height_m: f64,
    /// Of the triangle, of any length.
    pub normal: DVec3,
    pub level: u32,
    pub chart: usize,
    /// Base coordinates on the triangle's plane.
    pub at: [f64; 2],
}

/// How far base coordinates or a point lie outside of a triangle, by the shares of its second and third corner.
fn outside([u, v]: [f64; 2]) -> f64 {
    (-u).max(-v).max(u + v - 1.0)
}

impl Stand {
    /// Over positions: the nearest point may lie on a crease, with the point asked about on none of the
    /// normals there, or on the rim, with it beyond.
    pub(super) fn leant(self, curved: &Curved, p: DVec3) -> Self {
        let off = p - self.foot;
        let last = curved.graph.charts[0].lattice.last;
        let on_rim = (0..2).any(|a| self.at[a] <= 0.0 || self.at[a] >= f64::from(last[a]));
        let mut beyond = 0.0;
        if on_rim {
            let lo = [0, 1].map(|a: usize| self.at[a].floor().min(f64::from(last[a] - 1)));
            let corner = |x: f64, y: f64| curved.surface.base(0, [lo[0] + x, lo[1] + y]).0;
            let side = |x: f64, y: f64| corner(x, y).distance(corner(0.0, 0.0));
            let aside = (off - self.up * self.height_m).length();
            if aside <= RIM * side(1.0, 0.0).max(side(0.0, 1.0)) {
                return self;
            }
            beyond = 0.5;
        }
        // What is left of positions of that size by rounding has no direction.
        let along =
            if off.length() > 1e-9 * (1.0 + p.abs().max_element()) { off.normalize() } else { self.up };
        let along = if along.dot(self.up) < 0.0 { -along } else { along };
        Self { beyond, along, height_m: off.dot(along), ..self }
    }

    /// What is met goes before what is missed, then what is nearer to the point.
    fn compare(&self, a: &Crossing, b: &Crossing) -> Ordering {
        let missed = |c: &Crossing| c.outside.max(EXACT);
        let away = |c: &Crossing| (c.height_m - self.height_m).abs();
        missed(a).total_cmp(&missed(b)).then(away(a).total_cmp(&away(b)))
    }

    /// Of two crossings, where there are any.
    pub(super) fn better(&self, a: Option<Crossing>, b: Option<Crossing>) -> Option<Crossing> {
        a.into_iter().chain(b).min_by(|a, b| self.compare(a, b))
    }
}

impl Cell {
    /// Where a line crosses the plane of the triangle that suits it best; `None` over voids, and where all are
    /// seen from the side.
    pub(super) fn crossed(&self, stand: &Stand, chart: usize) -> Option<Crossing> {
        let all = self.triangles.iter().filter_map(|t| self.crossing(stand, chart, t));
        all.min_by(|a, b| stand.compare(a, b))
    }

    fn crossing(&self, stand: &Stand, chart: usize, triangle: &Triangle) -> Option<Crossing> {
        let [a, b, c] = triangle.corners?.map(|p| p - stand.foot);
        let (e, f) = (b - a, c - a);
        let normal = e.cross(f);
        let slant = normal.dot(stand.along);
        if slant.abs() <= 1e-9 * normal.length() {
            return None;
        }
        let height_m = normal.dot(a) / slant;
        let q = stand.along * height_m - a;
        let area2 = normal.length_squared();
        let shares = [q.cross(f).dot(normal) / area2, e.cross(q).dot(normal) / area2];
        let [n, m, o] = triangle.nodes.map(|node| node.map(f64::from));
        let at = [0, 1].map(|k: usize| {
            let at = n[k] + shares[0] * (m[k] - n[k]) + shares[1] * (o[k] - n[k]);
            let (lo, hi) = (f64::from(self.lo[k]), f64::from(self.hi[k]));
            at.clamp(lo - 0.5 * (hi - lo), hi + 0.5 * (hi - lo))
        });
        Some(Crossing { outside: outside(shares), height_m, normal, level: self.level, chart, at })
    }

    /// The triangle at the foot's own coordinates, where the line meets none: where cells have no area, and where
    /// rounding leads it between two.
    pub(super) fn under(&self, stand: &Stand) -> Option<Crossing> {
        let outside_of = |t: &&Triangle| outside(t.shares(stand.at));
        let triangle = self.triangles.iter().min_by(|a, b| outside_of(a).total_cmp(&outside_of(b)))?;
        let [a, b, c] = triangle.corners?.map(|p| p - stand.foot);
        let [u, v] = triangle.shares(stand.at);
        let height_m = (a + (b - a) * u + (c - a) * v).dot(stand.along);
        let normal = (b - a).cross(c - a);
        let (chart, at) = (stand.chart, stand.at);
        Some(Crossing { outside: 0.0, height_m, normal, level: self.level, chart, at })
    }
}

impl Triangle {
    /// Shares of the second and third corner at base coordinates.
    fn shares(&self, at: [f64; 2]) -> [f64; 2] {
        let [n, m, o] = self.nodes.map(|node| node.map(f64::from));
        let from = |p: [f64; 2]| [p[0] - n[0], p[1] - n[1]];
        let (e, f, q) = (from(m), from(o), from(at));
        let turn = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        [turn(q, f) / turn(e, f), turn(e, q) / turn(e, f)]
    }
}
