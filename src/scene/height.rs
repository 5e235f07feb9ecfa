//! Heights of the full-resolution surface, and the triangles that lie under or over a world point.
//!
//! The surface is that of the mesh at level 0 with uniform factors: cells cut from south-east to north-west.
//! [`crate::renderer::DrawnSurface`] asks the same way for what a frame drew; it brings other cells.

mod cells;

use glam::DVec3;

pub(crate) use self::cells::{Cell, Stand, Triangle};
use self::cells::{Crossing, EXACT};
use super::Terrain;
use crate::clipmap::Lattice;
use crate::pyramid::VOID;

/// How far beyond the data a point may lie and still count as on its border, base samples: what
/// rounding leaves.
const BORDER: f64 = 1e-6;
/// Cells gone through after the first. Triangles on curved bases have straight edges, so their cells' outlines
/// lie beside the lattice's lines, by a tenth of a cell at most.
const WALK: usize = 4;

/// A place of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// World metres.
    pub point_m: DVec3,
    /// Outward normal of the base surface there, unit.
    pub up: DVec3,
    /// Metres above the base surface, along `up`; world z where positions are the data.
    pub height_m: f64,
    /// Metres that the point asked about lies above it: vertically on a plane, else along the base's normal.
    pub above_m: f64,
    /// Between the triangle and the base surface, 0 to 90 degrees; where positions are the data between its
    /// outward side and the horizontal, over 90 where it overhangs.
    pub slope_deg: f64,
    /// Level of the triangle.
    pub level: u32,
}

impl Terrain {
    /// Height of the full-resolution surface under or over a world point, metres above the base surface;
    /// `None` outside the data and where it has voids. Of a streamed terrain, of what has arrived: coarser
    /// samples stand in for finer ones.
    ///
    /// ```
    /// use glam::DVec3;
    /// use tessclip::heights::ReadOptions;
    /// use tessclip::{Prefilter, Terrain, open_terrain};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let grid = open_terrain("procedural:mountains?size=129", &ReadOptions::default())?;
    /// let terrain = Terrain::new(&grid, Prefilter::default());
    /// // Whatever the point's own height.
    /// let ground_m = terrain.height_at(DVec3::new(1_500.0, 2_015.0, 9_000.0));
    /// assert_eq!(ground_m, terrain.height_at(DVec3::new(1_500.0, 2_015.0, -9_000.0)));
    /// assert!(ground_m.is_some_and(|m| (0.0..4_000.0).contains(&m)));
    /// assert_eq!(terrain.height_at(DVec3::new(-1.0, 2_015.0, 0.0)), None);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn height_at(&self, p: DVec3) -> Option<f64> {
        self.surface_at(p).map(|spot| spot.height_m)
    }

    /// The full-resolution surface under or over a world point, with its slope; see [`Terrain::height_at`].
    /// Where positions are the data and sheets lie over each other, the one nearest to the point.
    #[must_use]
    pub fn surface_at(&self, p: DVec3) -> Option<Spot> {
        self.full_surface(&self.stand(p)?)
    }

    /// As [`Terrain::surface_at`], from where the point stands.
    pub(super) fn full_surface(&self, stand: &Stand) -> Option<Spot> {
        self.spot(stand, &|chart, at| Some(self.full_cell(chart, at)))
    }

    /// Where a world point stands; `None` beside a plane's data and for what is not finite.
    pub(crate) fn stand(&self, p: DVec3) -> Option<Stand> {
        if !p.is_finite() {
            return None;
        }
        let Some(curved) = &self.curved else {
            let (at, beyond) = held(self.samples_from_world(p), self.source.lattice());
            let foot = DVec3::new(p.x, p.y, 0.0);
            let up = DVec3::Z;
            return (beyond == 0.0).then_some(Stand {
                chart: 0,
                at,
                beyond,
                foot,
                up,
                along: up,
                height_m: p.z,
            });
        };
        let found = curved.surface.foot(p);
        let (foot, up) = curved.surface.base(found.chart, found.at);
        let (at, beyond) = held(found.at, curved.graph.charts[found.chart].lattice);
        let height_m = (p - foot).dot(up);
        let stand = Stand { chart: found.chart, at, beyond, foot, up, along: up, height_m };
        Some(if curved.points.is_some() { stand.leant(curved, p) } else { stand })
    }

    /// The triangle on the line of a stand, among those of the cell that holds its foot and those around; `cell`
    /// gives the cell at base coordinates of a chart.
    pub(crate) fn spot(&self, stand: &Stand, cell: &dyn Fn(usize, [f64; 2]) -> Option<Cell>) -> Option<Spot> {
        let own = cell(stand.chart, stand.at)?;
        // Straight edges may bulge over the data's border, but not by a cell.
        let wide = f64::from((own.hi[0] - own.lo[0]).max(own.hi[1] - own.lo[1]));
        if stand.beyond.is_nan() || stand.beyond > wide {
            return None;
        }
        let sheets = self.curved.as_ref().is_some_and(|c| c.points.is_some());
        let crossed_at = |(chart, at)| cell(chart, at).and_then(|c| c.crossed(stand, chart));
        let mut best = own.crossed(stand, stand.chart);
        let mut last = best;
        for _ in 0..WALK {
            let Some(beside) = last.filter(|c| c.outside > EXACT) else { break };
            // Geomorph moves vertices along, so a plane may lead too far: the last cell is then the one.
            let border = (beside.chart, held(beside.at, self.lattice_of(beside.chart)).0);
            last = crossed_at(self.place(beside.chart, beside.at).unwrap_or(border));
            best = stand.better(best, last);
        }
        if sheets || best.is_none_or(|c| c.outside > EXACT) {
            // Sheets may lie over each other: the nearest of all around. Else a border belongs to the cells on both
            // sides, of which one may be void.
            for k in 0..9 {
                let around = [0, 1].map(|a: usize| match [k % 3, k / 3][a] {
                    0 if sheets => f64::from(own.lo[a]) - 0.25,
                    0 => stand.at[a] - BORDER,
                    1 => stand.at[a],
                    _ if sheets => f64::from(own.hi[a]) + 0.25,
                    _ => stand.at[a] + BORDER,
                });
                best = stand.better(best, self.place(stand.chart, around).and_then(crossed_at));
            }
        }
        // From beyond the rim of positions, their own border is nearest; only what bulges there is meant.
        let near = |c: &Crossing| {
            !sheets || stand.beyond == 0.0 || (c.height_m - stand.height_m).abs() < 0.5 * stand.height_m.abs()
        };
        let found = match best.filter(|c| c.outside <= EXACT && near(c)) {
            Some(crossing) => crossing,
            None if stand.beyond == 0.0 => own.under(stand)?,
            None => return None,
        };
        let point_m = stand.foot + stand.along * found.height_m;
        let (upright, height_m) = if sheets { (DVec3::Z, point_m.z) } else { (stand.up, found.height_m) };
        let cosine = found.normal.dot(upright);
        let facing = if sheets { cosine } else { cosine.abs() };
        Some(Spot {
            point_m,
            up: stand.up,
            height_m,
            above_m: stand.height_m - found.height_m,
            slope_deg: found.normal.cross(upright).length().atan2(facing).to_degrees(),
            level: found.level,
        })
    }

    /// Base coordinates that may lie beyond a chart's border, where the chart beyond has them; `None` where the
    /// surface ends.
    fn place(&self, chart: usize, at: [f64; 2]) -> Option<(usize, [f64; 2])> {
        let (inside, beyond) = held(at, self.lattice_of(chart));
        if beyond == 0.0 {
            return Some((chart, inside));
        }
        let curved = self.curved.as_ref().filter(|c| c.graph.is_glued())?;
        let foot = curved.surface.foot(curved.surface.base(chart, at).0);
        let (inside, _) = held(foot.at, self.lattice_of(foot.chart));
        (foot.chart != chart).then_some((foot.chart, inside))
    }

    fn lattice_of(&self, chart: usize) -> Lattice {
        self.curved.as_ref().map_or_else(|| self.source.lattice(), |c| c.graph.charts[chart].lattice)
    }

    /// The cell of level 0 at base coordinates in the data.
    fn full_cell(&self, chart: usize, at: [f64; 2]) -> Cell {
        let last = self.lattice_of(chart).last;
        let lo = [0, 1].map(|a: usize| (at[a] as i32).clamp(0, last[a] - 1));
        let hi = lo.map(|v| v + 1);
        let [sw, se, nw, ne] = [lo, [hi[0], lo[1]], [lo[0], hi[1]], hi];
        let triangles = [[sw, se, nw], [se, ne, nw]].map(|nodes| {
            let [a, b, c] = nodes.map(|node| self.sample_m(chart, node));
            Triangle { nodes, corners: a.zip(b).zip(c).map(|((a, b), c)| [a, b, c]) }
        });
        Cell { level: 0, lo, hi, triangles: triangles.into() }
    }

    /// World position of a base sample, metres; `None` where it is void.
    fn sample_m(&self, chart: usize, node: [i32; 2]) -> Option<DVec3> {
        if let Some(curved) = &self.curved {
            return curved.position(chart, 0, node).map(|(p, _)| p);
        }
        let h = self.source.sample(0, node);
        let ground = |a: usize| self.origin_m[a] + f64::from(node[a]) * self.spacing_m[a];
        (h != VOID).then(|| DVec3::new(ground(0), ground(1), f64::from(h)))
    }
}

/// Base coordinates held to the data, and how far they lie beyond it, samples; 0 where that is rounding alone.
fn held(at: [f64; 2], lattice: Lattice) -> ([f64; 2], f64) {
    let inside = [0, 1].map(|a: usize| at[a].clamp(0.0, f64::from(lattice.last[a])));
    let beyond = (inside[0] - at[0]).abs().max((inside[1] - at[1]).abs());
    (inside, if beyond <= BORDER { 0.0 } else { beyond })
}

#[cfg(test)]
mod tests;
