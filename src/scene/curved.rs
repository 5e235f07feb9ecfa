//! Terrain on a curved base surface: its charts, their samples, and poses on it.

mod poses;

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use self::poses::Poses;
use crate::camera::Camera;
use crate::clipmap::{ChartGraph, Lattice, thirds};
use crate::heights::{HeightGrid, PositionGrid};
use crate::pyramid::{
    Globe, GlobeError, GlobeFace, Measured, MemoryPyramid, PointHeights, Prefilter, Ring, RingChart,
    SampleSource, VOID,
};
use crate::surface::{
    Base, Charted, CubeSphere, Ellipsoid, Face, Foot, GridCharts, Plane, PointChart, SampledSurface, Surface,
};

/// Why a terrain cannot stand on a base surface.
#[derive(Debug, thiserror::Error)]
pub enum BaseFitError {
    /// The grids do not make a globe.
    #[error(transparent)]
    Globe(#[from] GlobeError),
    /// The data would overlap itself.
    #[error(
        "the terrain is {size_m:.0} m long, more than fits on base {base}: take a greater radius or a DEM in degrees"
    )]
    TooLarge {
        /// Its longer side.
        size_m: f64,
        /// The base.
        base: Base,
    },
    /// Too few samples to close a ring.
    #[error("base {base} bends {samples} samples into a ring: it takes 96 or more")]
    RingTooSmall {
        /// Samples around.
        samples: usize,
        /// The base.
        base: Base,
    },
    /// A ring or globe reads samples where they are asked for.
    #[error("base {base} takes every second sample for coarser levels: leave --prefilter out")]
    Prefilter {
        /// The base.
        base: Base,
    },
    /// The ground would reach the middle of the surface, or beyond.
    #[error(
        "heights down to {lowest_m:.0} m and up to {highest_m:.0} m are more than base {base} can carry: it bends with a radius of {radius_m:.0} m"
    )]
    TooDeep {
        /// Lowest height.
        lowest_m: f32,
        /// Highest height.
        highest_m: f32,
        /// Smallest radius of curvature.
        radius_m: f64,
        /// The base.
        base: Base,
    },
    /// Data finer than a globe's charts.
    #[error(
        "a DEM with {step_deg:e} degrees between samples is finer than a globe's charts can be: draw it alone"
    )]
    TooFine {
        /// Its step.
        step_deg: f64,
    },
    /// Positions where heights are needed, or the other way round.
    #[error(
        "base sampled needs positions (a three-band float TIFF, or procedural:overhang or fold), not heights"
    )]
    NeedsPositions,
}

/// A curved base surface with samples on it.
#[derive(Clone)]
pub struct Curved {
    /// Which surface.
    pub base: Base,
    /// Its charts.
    pub graph: ChartGraph,
    /// Where their nodes stand.
    pub surface: Arc<dyn Charted>,
    /// Heights above it, by chart.
    pub sources: Vec<Arc<dyn SampleSource>>,
    /// The positions themselves, where they are the data.
    pub points: Option<Arc<PointHeights>>,
    /// All heights of a whole globe.
    pub globe: Option<Arc<Globe>>,
    /// The ellipsoid when it is drawn whole, so that it hides what lies behind.
    pub(crate) whole: Option<Ellipsoid>,
    /// Factor the heights of `globe` are drawn with.
    pub(crate) exaggeration: f32,
    poses: Poses,
}

/// Cells of its own over which a finer source gives way to a coarser one at its border.
pub const BLEND_CELLS: f64 = 16.0;

impl Curved {
    /// Geographic grids on a whole ellipsoid, the finest on top.
    ///
    /// # Errors
    /// When a grid is not geographic.
    pub fn globe(grids: Vec<HeightGrid>, ellipsoid: Ellipsoid) -> Result<Self, BaseFitError> {
        let finest =
            grids.iter().filter_map(|g| g.georeference.degrees).map(|d| d.step[1]).fold(90.0, f64::min);
        let globe = Arc::new(Globe::new(grids, BLEND_CELLS)?);
        let size = globe.size();
        if finest < 0.99 * 90.0 / f64::from(size) {
            return Err(BaseFitError::TooFine { step_deg: finest });
        }
        let cells = i32::try_from(size).unwrap_or(i32::MAX);
        let face = |face| -> Arc<dyn SampleSource> {
            let face = GlobeFace { globe: globe.clone(), face, size };
            Arc::new(Measured::new(Arc::new(face)))
        };
        Ok(Self {
            base: Base::Ellipsoid { a_m: ellipsoid.a, b_m: ellipsoid.b },
            graph: ChartGraph::cube(cells),
            surface: Arc::new(CubeSphere { ellipsoid, size: cells }),
            sources: Face::ALL.map(face).to_vec(),
            points: None,
            whole: (!globe.has_voids()).then_some(ellipsoid),
            globe: Some(globe),
            exaggeration: 1.0,
            poses: Poses::Geodetic(ellipsoid),
        })
    }

    /// A grid on the surface `base`, which must not be sampled: degrees are longitude and latitude on an
    /// ellipsoid, metres are wrapped once around a cylinder or torus, or lie around longitude and latitude 0.
    ///
    /// # Errors
    /// When the grid does not fit the surface.
    pub fn on(grid: &HeightGrid, base: Base, prefilter: Prefilter) -> Result<Self, BaseFitError> {
        let Some(surface) = base.surface() else { return Err(BaseFitError::NeedsPositions) };
        let surface: Arc<dyn Surface> = surface.into();
        let cells = [grid.width - 1, grid.height - 1].map(|v| i32::try_from(v).unwrap_or(i32::MAX));
        let bounds = grid.bounds();
        let native_step = [0, 1].map(|a| (bounds[2 + a] - bounds[a]) / f64::from(cells[a]));
        let native = [[bounds[0], bounds[1]], native_step];
        let (origin, step) = match base {
            Base::Plane | Base::Sampled => (grid.origin_m, grid.spacing_m),
            Base::Ellipsoid { a_m, b_m } => match grid.georeference.degrees {
                Some(d) => {
                    if covers_a_pole(grid) {
                        if prefilter != Prefilter::Subsample {
                            return Err(BaseFitError::Prefilter { base });
                        }
                        return Self::globe(vec![grid.clone()], Ellipsoid { a: a_m, b: b_m });
                    }
                    ([d.west.to_radians(), d.south.to_radians()], d.step.map(f64::to_radians))
                }
                None => {
                    let step = grid.spacing_m.map(|s| s / a_m);
                    let half = [0, 1].map(|a| step[a] * f64::from(cells[a]) * 0.5);
                    if half[0] > 3.0 || half[1] > 1.4 {
                        let size_m = (half[0].max(half[1])) * 2.0 * a_m;
                        return Err(BaseFitError::TooLarge { size_m, base });
                    }
                    (half.map(|v| -v), step)
                }
            },
            Base::Cylinder { radius_m, .. } => {
                let around = TAU / grid.width as f64;
                let along = around * radius_m * grid.spacing_m[1] / grid.spacing_m[0];
                ([0.0, -0.5 * along * f64::from(cells[1])], [around, along])
            }
            Base::Torus { .. } => ([0.0; 2], [TAU / grid.width as f64, TAU / grid.height as f64]),
        };
        let rings = match base {
            Base::Cylinder { .. } => [true, false],
            Base::Torus { .. } => [true, true],
            _ => [false, false],
        };
        if rings[0] && prefilter != Prefilter::Subsample {
            return Err(BaseFitError::Prefilter { base });
        }
        let size = [grid.width, grid.height];
        let mut cuts = [Vec::new(), Vec::new()];
        for a in 0..2 {
            if !rings[a] {
                cuts[a] = vec![0, cells[a]];
                continue;
            }
            if size[a] < 96 {
                return Err(BaseFitError::RingTooSmall { samples: size[a], base });
            }
            // The last sample's cell leads back to the first.
            let parts = thirds(cells[a] + 1);
            cuts[a] = vec![0, parts[0], parts[0] + parts[1], cells[a] + 1];
        }
        let lengths = cuts.clone().map(|c| c.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>());
        let graph = if rings[0] {
            ChartGraph::grid(&lengths[0], &lengths[1], rings)
        } else {
            ChartGraph::single(Lattice { last: cells })
        };
        let charted = GridCharts { surface: surface.clone(), origin, step, cuts };
        let sources: Vec<Arc<dyn SampleSource>> = if rings[0] {
            let ring = Arc::new(Ring::new(grid));
            let chart = |(k, c): (usize, &crate::clipmap::Chart)| -> Arc<dyn SampleSource> {
                let chart = RingChart { ring: ring.clone(), offset: charted.offset(k), lattice: c.lattice };
                Arc::new(Measured::new(Arc::new(chart)))
            };
            graph.charts.iter().enumerate().map(chart).collect()
        } else {
            vec![Arc::new(MemoryPyramid::new(grid, prefilter))]
        };
        Ok(Self {
            base,
            graph,
            surface: Arc::new(charted),
            sources,
            points: None,
            globe: None,
            whole: None,
            exaggeration: 1.0,
            poses: Poses::Chart {
                surface,
                native,
                uv: [origin, step],
                cells: cells.map(f64::from),
                degrees: grid.georeference.degrees.is_some(),
            },
        })
    }

    /// A grid of positions: overhangs, cliffs and any other shape.
    #[must_use]
    pub fn sampled(grid: PositionGrid) -> Self {
        let surface = Arc::new(SampledSurface::new(grid));
        let points = Arc::new(PointHeights::new(surface.clone()));
        Self {
            base: Base::Sampled,
            graph: ChartGraph::single(points.lattice()),
            surface: Arc::new(PointChart { surface }),
            sources: vec![points.clone()],
            points: Some(points),
            globe: None,
            whole: None,
            exaggeration: 1.0,
            poses: Poses::World,
        }
    }

    /// The point `height_m` above the foot whose outward normal is `up`, on a globe; elsewhere above the
    /// world's origin.
    #[must_use]
    pub fn over(&self, up: DVec3, height_m: f64) -> DVec3 {
        let foot = match &self.poses {
            Poses::Geodetic(e) => e.surface_point_of_normal(up),
            _ => DVec3::ZERO,
        };
        foot + up * height_m
    }

    /// A camera that sees all of it.
    #[must_use]
    pub fn overview(&self, fov_deg: f64) -> Camera {
        if let (Poses::Geodetic(e), Some(globe)) = (&self.poses, &self.globe) {
            if let Some((middle, reach)) = globe.middle() {
                // Only part of it has data: from the south over the middle of that.
                let lat = middle.z.atan2(middle.truncate().length()).to_degrees();
                let lon = middle.y.atan2(middle.x).to_degrees();
                let away = e.a.max(e.b) * (2.0 * reach).min(1.9);
                return self.camera([lon, lat, away, 0.0, -90.0], fov_deg);
            }
            return self.camera([10.0, 30.0, 1.9 * e.a.max(e.b), 0.0, -90.0], fov_deg);
        }
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for (k, chart) in self.graph.charts.iter().enumerate() {
            for i in 0..=64 {
                let at = [i % 9, i / 9 % 9];
                let at = [0, 1].map(|a| f64::from(at[a]) / 8.0 * f64::from(chart.lattice.last[a]));
                let (p, _) = self.surface.base(k, at);
                low = low.min(p);
                high = high.max(p);
            }
        }
        let middle = (low + high) * 0.5;
        if let Base::Cylinder { inside: true, radius_m } = self.base {
            let eye = DVec3::new(0.0, 0.0, low.z + 0.05 * radius_m);
            return facing(
                eye,
                middle + DVec3::new(radius_m, 0.0, 0.6 * (high.z - middle.z)),
                DVec3::Z,
                fov_deg,
            );
        }
        let up = match self.base {
            Base::Ellipsoid { .. } => middle.try_normalize().unwrap_or(DVec3::Z),
            _ => DVec3::Z,
        };
        let east = if up.z.abs() > 0.999 { DVec3::X } else { DVec3::Z.cross(up).normalize() };
        let north = up.cross(east);
        let reach = (high - low).length().max(1e-6);
        facing(middle - north * (0.8 * reach) + up * (0.5 * reach), middle, up, fov_deg)
    }

    /// The foot of a world position, and the ground's height there above the base surface in metres
    /// (nearest sample; `None` where it is void).
    #[must_use]
    pub fn ground(&self, p: DVec3) -> (Foot, Option<f32>) {
        let foot = self.surface.foot(p);
        if let Some(globe) = &self.globe {
            let (_, normal) = self.surface.base(foot.chart, foot.at);
            let height = Some(globe.height(normal)).filter(|h| *h != VOID);
            return (foot, height.map(|h| h * self.exaggeration));
        }
        if self.points.is_some() {
            return (foot, Some(0.0));
        }
        let last = self.graph.charts[foot.chart].lattice.last;
        #[expect(clippy::cast_possible_truncation, reason = "clamped to the lattice")]
        let node = [0, 1].map(|a| foot.at[a].round().clamp(0.0, f64::from(last[a])) as i32);
        let h = self.sources[foot.chart].sample(0, node);
        (foot, Some(h).filter(|h| *h != VOID))
    }

    /// World position and outward normal of a node of a chart at its own height; `None` over a void.
    #[must_use]
    pub fn position(&self, chart: usize, level: u32, node: [i32; 2]) -> Option<(DVec3, DVec3)> {
        let lattice = self.graph.charts[chart].lattice;
        let at = [0, 1].map(|a| lattice.base_beyond(level, a, node[a]) as f64);
        if let Some(points) = &self.points {
            let (_, up) = self.surface.base(chart, at);
            return points.position(level, node).map(|p| (DVec3::from_array(p), up));
        }
        let h = self.sources[chart].sample(level, node);
        let (p, up) = self.surface.base(chart, at);
        (h != VOID).then(|| (p + up * f64::from(h), up))
    }

    /// Refuses ground so deep or, where heights grow inwards, so high that it would cross itself.
    ///
    /// # Errors
    /// When heights exceed four fifths of the smallest radius of curvature towards its centre.
    pub fn check_relief(&self) -> Result<(), BaseFitError> {
        let Some([lowest_m, highest_m]) = self.height_range().filter(|_| self.points.is_none()) else {
            return Ok(());
        };
        let radius_m = self.surface.least_radius_m();
        let inwards = match self.base {
            Base::Cylinder { inside: true, .. } => f64::from(highest_m),
            _ => -f64::from(lowest_m),
        };
        if inwards > 0.8 * radius_m {
            return Err(BaseFitError::TooDeep { lowest_m, highest_m, radius_m, base: self.base });
        }
        Ok(())
    }

    /// Lowest and highest sample, metres above the base; `None` when all are void.
    #[must_use]
    pub fn height_range(&self) -> Option<[f32; 2]> {
        let ranges = self.sources.iter().filter_map(|s| s.height_range());
        ranges.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// The plane as if it were curved: for comparisons of both ways.
    #[doc(hidden)]
    #[must_use]
    pub fn flat(grid: &HeightGrid, offset_m: DVec3) -> Self {
        let mut flat = grid.clone();
        flat.origin_m = [grid.origin_m[0] + offset_m.x, grid.origin_m[1] + offset_m.y];
        let cells = [grid.width - 1, grid.height - 1].map(|v| i32::try_from(v).unwrap_or(i32::MAX));
        let surface: Arc<dyn Surface> = Arc::new(Plane);
        let charted = GridCharts {
            surface: surface.clone(),
            origin: flat.origin_m,
            step: flat.spacing_m,
            cuts: cells.map(|c| vec![0, c]),
        };
        Self {
            base: Base::Plane,
            graph: ChartGraph::single(Lattice { last: cells }),
            surface: Arc::new(charted),
            sources: vec![Arc::new(MemoryPyramid::new(&flat, Prefilter::Subsample))],
            points: None,
            globe: None,
            whole: None,
            exaggeration: 1.0,
            poses: Poses::World,
        }
    }
}

/// A camera at `eye` that looks at `target`, level with respect to `up`.
#[must_use]
pub fn facing(eye_m: DVec3, target: DVec3, up: DVec3, fov_deg: f64) -> Camera {
    let east = if up.z.abs() > 0.999 { DVec3::X } else { DVec3::Z.cross(up).normalize() };
    let axes = DMat3::from_cols(east, up.cross(east).normalize(), up);
    let d = axes.transpose() * (target - eye_m);
    let yaw_deg = d.x.atan2(d.y).to_degrees();
    let pitch_deg = d.z.atan2(d.truncate().length()).to_degrees();
    Camera { eye_m, yaw_deg, pitch_deg, fov_deg, axes }
}

/// Grids that reach so far that longitude and latitude serve them badly: they need a globe's charts.
fn covers_a_pole(grid: &HeightGrid) -> bool {
    let [west, south, east, north] = grid.bounds();
    south < -85.0 || north > 85.0 || east - west > 120.0
}
