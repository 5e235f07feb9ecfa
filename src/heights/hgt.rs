//! SRTM `.hgt`: a bare square of big-endian `i16`, rows north to south, placed by its name.

use std::io::{BufReader, Read};
use std::path::Path;
use std::sync::Arc;

use super::blocks::Blocks;
use super::gdal_tags::Nodata;
use super::in_place::InPlace;
use super::positioned::{FileCursor, Positioned};
use super::raster::{Placement, Raster, ZMap};
use super::rasters::{RasterHeader, RasterSource};
use super::samples::{Rule, Stored};
use super::{HeightError, HeightGrid, ReadOptions, alloc};

const FORMAT: &str = "SRTM HGT";
const DTYPE: &str = "int16";
/// The value that marks a void.
const VOID: Nodata = Nodata { integer: Some(-32768), float: -32768.0 };

/// A tile whose name and length are understood.
struct Tile {
    file: Arc<Positioned>,
    /// Rows and columns.
    side: u64,
    /// Longitude and latitude of the south-west corner.
    origin: [f64; 2],
    rule: Rule,
}

impl Tile {
    fn open(path: &Path, options: &ReadOptions) -> Result<Self, HeightError> {
        let origin = corner(path).ok_or_else(|| HeightError::HgtName { path: path.to_owned() })?;
        let file = Arc::new(Positioned::open(path).map_err(|e| HeightError::io(path, e))?);
        let bytes = file.length();
        let side = (bytes / 2).isqrt();
        if bytes % 2 != 0 || side * side != bytes / 2 {
            return Err(HeightError::HgtSize { path: path.to_owned(), bytes });
        }
        let rule = Rule { nodata: Some(VOID), z: ZMap::IDENTITY.then_options(options) };
        Ok(Self { file, side, origin, rule })
    }

    /// The nodes span exactly one degree; for sides of at least 2.
    fn placement(&self) -> Placement {
        Placement::Degrees {
            crs: Some("EPSG:4326".to_owned()),
            origin: self.origin,
            step: [1.0 / (self.side - 1) as f64; 2],
            pixel_is_point: true,
        }
    }
}

/// Reads one tile.
///
/// Errors: `HgtName`, `HgtSize`, `TooLarge`, `TooSmall`, `AlreadyGeoreferenced`, `Io`.
pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<HeightGrid, HeightError> {
    let tile = Tile::open(path, options)?;
    let mut raster = Raster::new(path, [tile.side; 2], tile.rule.z, options)?;
    let mut reader = BufReader::with_capacity(1 << 16, FileCursor::new(&tile.file));
    let mut line = vec![0_u8; raster.width * 2];
    let mut heights = vec![0.0; raster.width];
    for row in (0..raster.height).rev() {
        reader.read_exact(&mut line).map_err(|e| HeightError::io(path, e))?;
        Stored::I16.heights(&line, true, tile.rule, &mut heights);
        raster.put_row(row, 0, &heights);
    }
    raster.finish(path, tile.placement(), DTYPE, FORMAT, options)
}

/// Opens one tile for reading by rectangles.
///
/// Errors: `HgtName`, `HgtSize`, `SideTooLong`, `TooSmall`, `AlreadyGeoreferenced`, `Io`.
pub(crate) fn open(path: &Path, options: &ReadOptions) -> Result<Box<dyn RasterSource>, HeightError> {
    let tile = Tile::open(path, options)?;
    alloc::sides(&path.display().to_string(), tile.side, tile.side)?;
    let located = tile.placement().locate(path, tile.side, FORMAT, options)?;
    let size = [tile.side; 2];
    Ok(Box::new(InPlace {
        header: RasterHeader::new(size, located, DTYPE, FORMAT, tile.rule.z == ZMap::IDENTITY),
        path: path.to_owned(),
        file: tile.file,
        blocks: Blocks::whole(size),
        places: vec![0],
        stored: Stored::I16,
        big_endian: true,
        rule: tile.rule,
    }))
}

/// Longitude and latitude of the south-west corner from a name like `N44W072.hgt` or
/// `n44w072.SRTMGL1.hgt`; `None` if the name does not begin so.
fn corner(path: &Path) -> Option<[f64; 2]> {
    let name = path.file_name()?.to_str()?.as_bytes();
    if name.get(7).is_some_and(u8::is_ascii_alphanumeric) {
        return None;
    }
    let number = |range: std::ops::Range<usize>| -> Option<f64> {
        let digits = std::str::from_utf8(name.get(range)?).ok()?;
        let all_digits = digits.bytes().all(|b| b.is_ascii_digit());
        all_digits.then(|| digits.parse().ok())?
    };
    let sign = |at: usize, plus: u8, minus: u8| match name.get(at)?.to_ascii_uppercase() {
        c if c == plus => Some(1.0),
        c if c == minus => Some(-1.0),
        _ => None,
    };
    let latitude: f64 = sign(0, b'N', b'S')? * number(1..3)?;
    let longitude: f64 = sign(3, b'E', b'W')? * number(4..7)?;
    let on_earth = (-90.0..90.0).contains(&latitude) && longitude.abs() <= 180.0;
    on_earth.then_some([longitude, latitude])
}

#[cfg(test)]
mod tests {
    use super::corner;
    use std::path::Path;

    #[test]
    fn corners_come_from_names() {
        let of = |name: &str| corner(Path::new(name));
        assert_eq!(of("dir/N44W072.hgt"), Some([-72.0, 44.0]));
        assert_eq!(of("s33e151.SRTMGL1.hgt"), Some([151.0, -33.0]));
        for bad in ["N4W072.hgt", "tile.hgt", "N44W0720.hgt", "N95W072.hgt", "N44X072.hgt", ""] {
            assert_eq!(of(bad), None, "{bad}");
        }
    }
}
