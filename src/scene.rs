//! What is to be drawn: the terrain and how. `plan` turns it into passes and memory.

mod curved;
mod height;
mod pick;
mod pose;

use std::sync::Arc;

use glam::DVec3;

pub use self::curved::{BLEND_CELLS, BaseFitError, Curved, facing};
pub use self::height::Spot;
pub(crate) use self::height::{Cell, Triangle};
use crate::camera::Camera;
use crate::clipmap::{ChartGraph, ClipmapError, ClipmapShape};
use crate::heights::{Degrees, HeightGrid, PositionGrid};
use crate::pyramid::{MemoryPyramid, Prefilter, SampleSource, Scaled};
use crate::surface::{Base, Ellipsoid};

/// A terrain: samples and where they lie in the world.
#[derive(Clone)]
pub struct Terrain {
    /// Heights by level; of the first chart where there are several.
    pub source: Arc<dyn SampleSource>,
    /// Metres between base samples, east and north.
    pub spacing_m: [f64; 2],
    /// World position of the south-west sample in metres.
    pub origin_m: [f64; 2],
    /// Degrees, when the data came in them; poses are then given in longitude and latitude.
    pub degrees: Option<Degrees>,
    /// The base surface when it is not a plane; spacing and origin above then only describe the data.
    pub curved: Option<Arc<Curved>>,
}

impl Terrain {
    /// A grid on a plane, its pyramid in memory. Degrees become metres at the data's middle latitude.
    #[must_use]
    pub fn new(grid: &HeightGrid, prefilter: Prefilter) -> Self {
        Self {
            source: Arc::new(MemoryPyramid::new(grid, prefilter)),
            spacing_m: grid.spacing_m,
            origin_m: grid.origin_m,
            degrees: grid.georeference.degrees,
            curved: None,
        }
    }

    /// A store on a plane, streamed: of any size, only what windows need is ever in memory.
    #[cfg(feature = "store")]
    #[must_use]
    pub fn streamed(source: crate::stream::TileSource) -> Self {
        let place = source.store().manifest().place.clone();
        Self {
            source: Arc::new(source),
            spacing_m: place.spacing_m,
            origin_m: place.origin_m,
            degrees: place.georeference().degrees,
            curved: None,
        }
    }

    /// A grid on any base surface but a sampled one.
    ///
    /// # Errors
    /// When the grid does not fit the surface.
    pub fn on(grid: &HeightGrid, base: Base, prefilter: Prefilter) -> Result<Self, BaseFitError> {
        if base == Base::Plane {
            return Ok(Self::new(grid, prefilter));
        }
        Ok(Self::from_curved(Curved::on(grid, base, prefilter)?, grid.spacing_m))
    }

    /// Geographic grids on a whole ellipsoid, the finest on top, blended into what lies below over
    /// [`BLEND_CELLS`] of its own cells.
    ///
    /// # Errors
    /// When a grid is not geographic.
    pub fn globe(grids: Vec<HeightGrid>, ellipsoid: Ellipsoid) -> Result<Self, BaseFitError> {
        Ok(Self::from_curved(Curved::globe(grids, ellipsoid)?, [0.0; 2]))
    }

    /// Positions as they are.
    #[must_use]
    pub fn sampled(grid: PositionGrid) -> Self {
        Self::from_curved(Curved::sampled(grid), [0.0; 2])
    }

    /// Any curved surface; `spacing_m` between base samples, 0 to take the surface's cells.
    #[must_use]
    pub fn from_curved(curved: Curved, spacing_m: [f64; 2]) -> Self {
        let cell = curved.surface.cell_m();
        Self {
            source: curved.sources[0].clone(),
            spacing_m: spacing_m.map(|s| if s > 0.0 { s } else { cell }),
            origin_m: [0.0; 2],
            degrees: None,
            curved: Some(Arc::new(curved)),
        }
    }

    /// The same terrain with its heights times `factor`; positions that are the data themselves stay.
    #[must_use]
    pub fn exaggerated(mut self, factor: f32) -> Self {
        if factor == 1.0 {
            return self;
        }
        let scaled = |source: &Arc<dyn SampleSource>| -> Arc<dyn SampleSource> {
            Arc::new(Scaled { source: source.clone(), factor })
        };
        if let Some(curved) = &self.curved {
            if curved.points.is_some() {
                return self;
            }
            let mut curved = Curved::clone(curved);
            curved.sources = curved.sources.iter().map(scaled).collect();
            curved.exaggeration = factor;
            self.source = curved.sources[0].clone();
            self.curved = Some(Arc::new(curved));
        } else {
            self.source = scaled(&self.source);
        }
        self
    }

    /// Which surface it stands on.
    #[must_use]
    pub fn base(&self) -> Base {
        self.curved.as_ref().map_or(Base::Plane, |c| c.base)
    }

    /// Its charts; one on a plane.
    #[must_use]
    pub fn graph(&self) -> ChartGraph {
        match &self.curved {
            Some(c) => c.graph.clone(),
            None => ChartGraph::single(self.source.lattice()),
        }
    }

    /// Camera of a pose `x, y, z, yaw, pitch` in the terrain's own units; see [`Curved::camera`].
    #[must_use]
    pub fn camera(&self, pose: [f64; 5], fov_deg: f64) -> Camera {
        if let Some(curved) = &self.curved {
            return curved.camera(pose, fov_deg);
        }
        let [x, y] = self.world_from_native([pose[0], pose[1]]);
        Camera {
            eye_m: DVec3::new(x, y, pose[2]),
            yaw_deg: pose[3],
            pitch_deg: pose[4],
            fov_deg,
            ..Camera::default()
        }
    }

    /// A camera that sees all of it.
    #[must_use]
    pub fn overview(&self, fov_deg: f64) -> Camera {
        if let Some(curved) = &self.curved {
            return curved.overview(fov_deg);
        }
        let [low, high] = self.extent_m();
        let range = self.source.height_range().unwrap_or([0.0, 0.0]).map(f64::from);
        let middle = DVec3::new(
            f64::midpoint(low[0], high[0]),
            f64::midpoint(low[1], high[1]),
            f64::midpoint(range[0], range[1]),
        );
        let reach = (high[0] - low[0]).max(high[1] - low[1]);
        let eye = middle + DVec3::new(0.0, -0.72 * reach, 0.5 * reach);
        Camera::looking_at(eye, middle, fov_deg)
    }

    /// World metres of a ground point given in the terrain's own units (degrees or metres).
    #[must_use]
    pub fn world_from_native(&self, p: [f64; 2]) -> [f64; 2] {
        match self.degrees {
            Some(d) => [p[0] * d.metres_per_degree[0], p[1] * d.metres_per_degree[1]],
            None => p,
        }
    }

    /// Base-lattice coordinates (fractional sample indices) of a world point.
    #[must_use]
    pub fn samples_from_world(&self, eye_m: DVec3) -> [f64; 2] {
        [(eye_m.x - self.origin_m[0]) / self.spacing_m[0], (eye_m.y - self.origin_m[1]) / self.spacing_m[1]]
    }

    /// Extent of the data in world metres: low and high corner.
    #[must_use]
    pub fn extent_m(&self) -> [[f64; 2]; 2] {
        let last = self.source.lattice().last;
        let high = [0, 1].map(|a| self.origin_m[a] + f64::from(last[a]) * self.spacing_m[a]);
        [self.origin_m, high]
    }

    /// Height of the nearest base sample under a world point, clamped to the data; metres. Over a void
    /// the nearest sample of the next coarser level that has one; `None` only where all are void. Of a
    /// streamed terrain, what has arrived.
    #[must_use]
    pub fn ground_height_m(&self, x_m: f64, y_m: f64) -> Option<f32> {
        self.ground_by(x_m, y_m, |level, node| self.source.sample(level, node))
    }

    /// A height that the ground near a world point does not pass; that of the nearest sample where all are in
    /// memory. Never depends on what has arrived.
    pub(crate) fn ground_bound_m(&self, x_m: f64, y_m: f64) -> Option<f32> {
        match self.source.relief_near(self.nearest_sample(x_m, y_m)) {
            Some([_, high]) => Some(high),
            None if self.source.streaming().is_some() => self.source.height_range().map(|r| r[1]),
            None => self.ground_height_m(x_m, y_m),
        }
    }

    fn nearest_sample(&self, x_m: f64, y_m: f64) -> [i32; 2] {
        let last = self.source.lattice().last;
        let at = self.samples_from_world(DVec3::new(x_m, y_m, 0.0));
        #[expect(clippy::cast_possible_truncation, reason = "clamped to the lattice")]
        let index = [0, 1].map(|a| at[a].round().clamp(0.0, f64::from(last[a])) as i32);
        index
    }

    fn ground_by(&self, x_m: f64, y_m: f64, sample: impl Fn(u32, [i32; 2]) -> f32) -> Option<f32> {
        let lattice = self.source.lattice();
        let index = self.nearest_sample(x_m, y_m);
        (0..=lattice.coarsest_level())
            .map(|level| {
                let end = lattice.last_at(level);
                let node = [0, 1].map(|a| ((index[a] + (1 << level >> 1)) >> level).min(end[a]));
                sample(level, node)
            })
            .find(|h| *h != crate::pyramid::VOID)
            .or_else(|| self.source.height_range().map(|r| r[1]))
    }
}

/// How the surface is coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ColorMode {
    /// Sun, sky, hypsometric tint and fog.
    #[default]
    Shaded,
    /// A colour a level.
    Levels,
    /// A colour a block kind (M, R, L, fill), darker on every second level.
    Blocks,
    /// Height ramp.
    Elevation,
    /// Slope ramp, 0 to 90 degrees.
    Slope,
    /// Bound on the screen-space error of every patch, pixels, on a logarithmic ramp.
    Error,
    /// What this frame refilled.
    Refill,
}

/// Which vertices patches have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Factors {
    /// All cells of every level, as Song et al. draw them.
    #[default]
    Uniform,
    /// Of each patch the vertices that its measured deviation asks for. Both limits may be given: the coarser mesh
    /// wins. What is no limit (0, less, no number) counts as the least there is.
    ByError {
        /// Most that a vertex-to-surface deviation may show on screen, pixels.
        pixel_error: Option<f32>,
        /// Most triangles a frame.
        budget: Option<u32>,
    },
}

impl Factors {
    /// True when patches go by their error.
    #[must_use]
    pub fn by_error(self) -> bool {
        self != Self::Uniform
    }
}

/// Everything a scene asks for. What is off is not compiled, bound, allocated or run.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Samples per side of a window: 15, 31, ... 1023.
    pub n: u32,
    /// Level count; `None` takes the fewest that cover the data from everywhere.
    pub levels: Option<u32>,
    /// Colouring.
    pub color: ColorMode,
    /// Draw triangle edges.
    pub wireframe: bool,
    /// Draw the bounds of the patches that are drawn, as culling sees them.
    pub bounds: bool,
    /// Move vertices near a level's perimeter towards the coarser level.
    pub morph: bool,
    /// Distance fog (shaded colouring only).
    pub fog: bool,
    /// Which vertices patches have.
    pub factors: Factors,
    /// Draw only patches in view; off for complete meshes.
    pub cull: bool,
    /// Drop the finest levels when the camera is far above them.
    pub drop_fine_levels: bool,
    /// Direction of the sun: azimuth clockwise from north and altitude above the horizon, degrees.
    pub sun_deg: [f64; 2],
    /// Clear and fog colour, linear RGB from 0 to 1. The default sky turns black with height over a globe.
    pub background: [f32; 3],
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            n: 255,
            levels: None,
            color: ColorMode::Shaded,
            wireframe: false,
            bounds: false,
            morph: false,
            fog: true,
            factors: Factors::Uniform,
            cull: true,
            drop_fine_levels: true,
            sun_deg: [315.0, 35.0],
            background: [0.53, 0.68, 0.85],
        }
    }
}

impl Scene {
    /// True when blocks' deviations are looked at: by the factors or by the colouring. Windows are whole blocks
    /// then.
    pub(crate) fn needs_deviations(&self) -> bool {
        self.factors.by_error() || self.color == ColorMode::Error
    }

    /// The clipmap's shape over a terrain.
    ///
    /// # Errors
    /// When `n` or `levels` does not suit the data.
    pub fn shape(&self, terrain: &Terrain) -> Result<ClipmapShape, ClipmapError> {
        // A block of the base surface needs two cells.
        if terrain.curved.is_some() && self.n < 31 {
            return Err(ClipmapError::GluedWindowSize { n: self.n, least: 31 });
        }
        if !self.needs_deviations() {
            return terrain.graph().shape(self.n, self.levels);
        }
        let refused = |why| Err(ClipmapError::NoDeviations { why });
        if !terrain.source.has_deviations() {
            return refused(if terrain.source.streaming().is_some() {
                "the store was built without deviations of these meshes: build it again"
            } else {
                "the globe's finest level has too many samples to measure: leave finer regions out"
            });
        }
        terrain.graph().shape_by_blocks(self.n, self.levels)
    }
}
