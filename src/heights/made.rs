//! Procedural terrain by rectangles: samples are made where they are asked for, and never held.

use super::geo::Georeference;
use super::raster::{Located, ZMap};
use super::rasters::{RasterHeader, RasterSource};
use super::{HeightError, Planet, Procedural, ReadOptions, alloc, planet};

enum Recipe {
    Plane(Procedural),
    Planet(Planet),
}

/// A recipe as a raster.
struct Made {
    header: RasterHeader,
    recipe: Recipe,
    z: ZMap,
}

/// Opens the terrain of a recipe (without `procedural:`), of any size.
///
/// Errors: those of [`Procedural::parse`] and [`Planet::parse`] but `TooLarge`; `SideTooLong`.
pub(crate) fn open(recipe: &str, options: &ReadOptions) -> Result<Box<dyn RasterSource>, HeightError> {
    let z = ZMap::IDENTITY.then_options(options);
    let raw = z == ZMap::IDENTITY;
    let size = |name: &str, width: usize, height: usize| {
        let size = [width as u64, height as u64];
        alloc::sides(&format!("procedural:{name}"), size[0], size[1]).map(|()| size)
    };
    let (header, recipe) = if Planet::is_named(recipe) {
        let planet = Planet::parse_any_size(recipe, options)?;
        let size = size(planet::NAME, planet.width(), planet.size)?;
        let header = RasterHeader::new(size, planet.located(), planet::DTYPE, "procedural", raw);
        (header, Recipe::Planet(planet))
    } else {
        let plane = Procedural::parse_any_size(recipe, options)?;
        let size = size(plane.kind.name(), plane.width, plane.height)?;
        let spacing_m = [plane.spacing_m; 2];
        let located = Located { georeference: Georeference::none(), origin_m: [0.0; 2], spacing_m };
        (RasterHeader::new(size, located, "float32", "procedural", raw), Recipe::Plane(plane))
    };
    Ok(Box::new(Made { header, recipe, z }))
}

impl RasterSource for Made {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, at: [u64; 2], size: [usize; 2], out: &mut [f32]) -> Result<(), HeightError> {
        self.header.check(at, size, out.len())?;
        for (j, row) in (at[1]..).zip(out.chunks_exact_mut(size[0].max(1))) {
            match &self.recipe {
                Recipe::Plane(plane) => plane.fill_row([at[0], j], self.z, row),
                Recipe::Planet(planet) => planet.fill_row([at[0], j], self.z, row),
            }
        }
        Ok(())
    }
}
