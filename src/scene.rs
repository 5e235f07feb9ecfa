//! What is to be drawn: the terrain and how. `plan` turns it into passes and memory.

use std::sync::Arc;

use glam::DVec3;

use crate::clipmap::{ClipmapError, ClipmapShape};
use crate::heights::{Degrees, HeightGrid};
use crate::pyramid::{MemoryPyramid, Prefilter, SampleSource};

/// A terrain on a plane: samples and where they lie in the world.
#[derive(Clone)]
pub struct Terrain {
    /// Heights by level.
    pub source: Arc<dyn SampleSource>,
    /// Metres between base samples, east and north.
    pub spacing_m: [f64; 2],
    /// World position of the south-west sample in metres.
    pub origin_m: [f64; 2],
    /// Degrees, when the data came in them; poses are then given in longitude and latitude.
    pub degrees: Option<Degrees>,
}

impl Terrain {
    /// Builds the pyramid of a grid in memory.
    #[must_use]
    pub fn new(grid: &HeightGrid, prefilter: Prefilter) -> Self {
        Self {
            source: Arc::new(MemoryPyramid::new(grid, prefilter)),
            spacing_m: grid.spacing_m,
            origin_m: grid.origin_m,
            degrees: grid.georeference.degrees,
        }
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
    /// the nearest sample of the next coarser level that has one; `None` only where all are void.
    #[must_use]
    pub fn ground_height_m(&self, x_m: f64, y_m: f64) -> Option<f32> {
        let lattice = self.source.lattice();
        let last = lattice.last;
        let at = self.samples_from_world(DVec3::new(x_m, y_m, 0.0));
        #[expect(clippy::cast_possible_truncation, reason = "clamped to the lattice")]
        let index = [0, 1].map(|a| at[a].round().clamp(0.0, f64::from(last[a])) as i32);
        (0..=lattice.coarsest_level())
            .map(|level| {
                let end = lattice.last_at(level);
                let node = [0, 1].map(|a| ((index[a] + (1 << level >> 1)) >> level).min(end[a]));
                self.source.sample(level, node)
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
    /// Move vertices near a level's perimeter towards the coarser level.
    pub morph: bool,
    /// Distance fog (shaded colouring only).
    pub fog: bool,
    /// Draw only patches in view; off for complete meshes.
    pub cull: bool,
    /// Drop the finest levels when the camera is far above them.
    pub drop_fine_levels: bool,
    /// Direction of the sun: azimuth clockwise from north and altitude above the horizon, degrees.
    pub sun_deg: [f64; 2],
    /// Clear and fog colour, linear RGB from 0 to 1.
    pub background: [f32; 3],
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            n: 255,
            levels: None,
            color: ColorMode::Shaded,
            wireframe: false,
            morph: false,
            fog: true,
            cull: true,
            drop_fine_levels: true,
            sun_deg: [315.0, 35.0],
            background: [0.53, 0.68, 0.85],
        }
    }
}

impl Scene {
    /// The clipmap's shape over a terrain.
    ///
    /// # Errors
    /// When `n` or `levels` does not suit the data.
    pub fn shape(&self, terrain: &Terrain) -> Result<ClipmapShape, ClipmapError> {
        let lattice = terrain.source.lattice();
        match self.levels {
            Some(levels) => ClipmapShape::new(self.n, levels, lattice),
            None => ClipmapShape::covering(self.n, lattice),
        }
    }
}
