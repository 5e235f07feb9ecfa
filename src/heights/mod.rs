//! Elevation data: reading it and making it up.
//!
//! The layer turns one file, or one procedural recipe, into one [`HeightGrid`]: finite heights in
//! metres on a regular grid, row 0 in the south and column 0 in the west, with a mask for voids
//! and a plane coordinate frame in metres. Terrain that no height over a plane can describe comes as a
//! [`PositionGrid`] instead: one position in metres for each node.
//!
//! It knows no projection mathematics beyond a constant scale of degrees to metres at the centre
//! latitude of the data, it never resamples, and it knows nothing of meshes, levels of
//! detail or the GPU.
//!
//! What is larger than memory is read by rectangles from a [`RasterSource`] instead, with the very
//! same heights.
//!
//! Formats: GeoTIFF and BigTIFF, SRTM `.hgt`, 8 and 16 bit grey PNG, and `procedural:NAME`.

mod alloc;
mod blocks;
mod cache;
mod error;
mod fill;
mod gdal_tags;
mod geo;
mod geokeys;
mod geotiff;
mod grid;
mod hgt;
mod in_place;
mod landform;
mod made;
mod mosaic;
mod noise;
mod open;
mod planet;
mod png;
mod png_spool;
mod position_recipe;
mod position_tiff;
#[cfg(test)]
mod position_tiff_tests;
mod positioned;
mod positions;
mod procedural;
mod raster;
mod rasters;
mod samples;
mod space_noise;
mod tiff_check;
mod tiff_patch;
mod tiff_probe;
mod tiff_windows;

pub use error::HeightError;
pub use geo::{Degrees, Georeference};
pub use grid::{HeightGrid, NodataPolicy, ReadOptions};
pub use mosaic::{Mosaic, Opener};
pub use open::{open_file, open_raster, open_terrain};
pub use planet::Planet;
pub use position_recipe::PositionKind;
pub use position_tiff::is_position_file;
pub use positions::PositionGrid;
pub use procedural::{Procedural, ProceduralKind};
pub use rasters::{GridSource, RasterHeader, RasterSource};

pub(crate) use noise::smoothstep;
