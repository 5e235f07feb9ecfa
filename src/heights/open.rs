//! Choosing a reader by content, and `.hgt`, which has no content to go by, by extension.

use std::fs::{self, File};
use std::io::{ErrorKind, Read};
use std::path::Path;

use super::{HeightError, HeightGrid, Planet, Procedural, ReadOptions, geotiff, hgt, png};

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

/// Reads one elevation file: GeoTIFF, BigTIFF, PNG (by content) or SRTM `.hgt` (by extension).
///
/// Errors: every variant of [`HeightError`] that carries a path, and `BadOption`.
pub fn open_file(path: &Path, options: &ReadOptions) -> Result<HeightGrid, HeightError> {
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
        return hgt::read(path, options);
    }
    let mut head = Vec::with_capacity(8);
    let file = File::open(path).map_err(io)?;
    file.take(8).read_to_end(&mut head).map_err(io)?;
    match head.as_slice() {
        [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => geotiff::read(path, options),
        [0x89, b'P', b'N', b'G', ..] => png::read(path, options),
        other => Err(HeightError::UnknownFormat {
            path: path.to_owned(),
            found: other.iter().map(|b| format!("{b:02x}")).collect(),
        }),
    }
}
