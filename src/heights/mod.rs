//! Elevation data: reading it and making it up.
//!
//! The layer turns one file, or one procedural recipe, into one [`HeightGrid`]: finite heights in
//! metres on a regular grid, row 0 in the south and column 0 in the west, with a mask for voids
//! and a plane coordinate frame in metres.
//!
//! It knows no projection mathematics beyond a constant scale of degrees to metres at the centre
//! latitude of the data, it never resamples or mosaics, and it knows nothing of meshes, levels of
//! detail or the GPU.
//!
//! Formats: GeoTIFF and BigTIFF, SRTM `.hgt`, 8 and 16 bit grey PNG, and `procedural:NAME`.

mod alloc;
mod error;
mod fill;
mod gdal_tags;
mod geo;
mod geokeys;
mod geotiff;
mod grid;
mod hgt;
mod landform;
mod noise;
mod open;
mod png;
mod procedural;
mod raster;
mod samples;
mod tiff_patch;
mod tiff_probe;

pub use error::HeightError;
pub use geo::{Degrees, Georeference};
pub use grid::{HeightGrid, NodataPolicy, ReadOptions};
pub use open::{open_file, open_terrain};
pub use procedural::{Procedural, ProceduralKind};
