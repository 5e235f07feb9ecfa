//! Choosing a reader by content, and `.hgt`, which has no content to go by, by extension.

use std::fs::{self, File};
use std::io::{ErrorKind, Read};
use std::path::Path;

use super::rasters::RasterSource;
use super::{HeightError, HeightGrid, Planet, Procedural, ReadOptions};
use super::{geotiff, hgt, made, png, png_spool, tiff_windows};

/// Opens `procedural:NAME?key=value&...` or, for anything else, the file at that path.
///
/// Errors: those of [`open_file`], of [`Procedural::parse`] and of [`Planet::parse`].
pub fn open_terrain(spec: &str, options: &ReadOptions) -> Result<HeightGrid, HeightError> {
    match spec.strip_prefix("procedural:") {
        Some(recipe) if Planet::is_named(recipe) => Planet::parse(recipe, options)?.to_grid_with(options),
        Some(recipe) => Procedural::parse(recipe, options)?.to_grid_with(options),
        None => open_file(Path::new(spec), options),
    }
}

/// Opens `procedural:NAME?key=value&...` or, for anything else, the file at that path, for reading
/// by rectangles: samples are read or made when they are asked for.
///
/// `max_samples` does not limit the raster; it limits what must be held in memory whole, which is
/// only ever a small PNG. Other PNG files are unpacked into a temporary file here.
///
/// Errors: those of [`open_terrain`], `SideTooLong`, `Temporary`; errors in the samples themselves
/// are found only when these are read.
pub fn open_raster(spec: &str, options: &ReadOptions) -> Result<Box<dyn RasterSource>, HeightError> {
    if let Some(recipe) = spec.strip_prefix("procedural:") {
        return made::open(recipe, options);
    }
    let path = Path::new(spec);
    match Format::of(path, options)? {
        Format::Hgt => hgt::open(path, options),
        Format::Tiff => tiff_windows::open(path, options),
        Format::Png => png_spool::open(path, options),
    }
}

/// Reads one elevation file: GeoTIFF, BigTIFF, PNG (by content) or SRTM `.hgt` (by extension).
///
/// Errors: every variant of [`HeightError`] that carries a path, and `BadOption`.
pub fn open_file(path: &Path, options: &ReadOptions) -> Result<HeightGrid, HeightError> {
    match Format::of(path, options)? {
        Format::Hgt => hgt::read(path, options),
        Format::Tiff => geotiff::read(path, options),
        Format::Png => png::read(path, options),
    }
}

enum Format {
    Hgt,
    Tiff,
    Png,
}

impl Format {
    /// The format of a file, after a look at the options.
    fn of(path: &Path, options: &ReadOptions) -> Result<Self, HeightError> {
        options.check()?;
        let io = |e: std::io::Error| match e.kind() {
            ErrorKind::NotFound => HeightError::NotFound { path: path.to_owned() },
            _ => HeightError::io(path, e),
        };
        let metadata = fs::metadata(path).map_err(io)?;
        if !metadata.is_file() {
            return Err(HeightError::NotAFile { path: path.to_owned() });
        }
        if metadata.len() == 0 {
            return Err(HeightError::Empty { path: path.to_owned() });
        }
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        if extension.eq_ignore_ascii_case("hgt") {
            return Ok(Self::Hgt);
        }
        let mut head = Vec::with_capacity(8);
        let file = File::open(path).map_err(io)?;
        file.take(8).read_to_end(&mut head).map_err(io)?;
        match head.as_slice() {
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Ok(Self::Tiff),
            [0x89, b'P', b'N', b'G', ..] => Ok(Self::Png),
            other => Err(HeightError::UnknownFormat {
                path: path.to_owned(),
                found: other.iter().map(|b| format!("{b:02x}")).collect(),
            }),
        }
    }
}
