//! SRTM `.hgt`: a bare square of big-endian `i16`, rows north to south, placed by its name.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use super::raster::{Placement, Raster, ZMap};
use super::{HeightError, HeightGrid, ReadOptions};

/// The value that marks a void.
const VOID: i16 = -32768;

/// Reads one tile: the nodes span exactly one degree from the corner in the name.
///
/// Errors: `HgtName`, `HgtSize`, `TooLarge`, `TooSmall`, `AlreadyGeoreferenced`, `Io`.
pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<HeightGrid, HeightError> {
    let io = |e| HeightError::io(path, e);
    let origin = corner(path).ok_or_else(|| HeightError::HgtName { path: path.to_owned() })?;
    let file = File::open(path).map_err(io)?;
    let bytes = file.metadata().map_err(io)?.len();
    let side = (bytes / 2).isqrt();
    if bytes % 2 != 0 || side * side != bytes / 2 {
        return Err(HeightError::HgtSize { path: path.to_owned(), bytes });
    }
    let z = ZMap::IDENTITY.then_options(options);
    let mut raster = Raster::new(path, [side, side], z, options)?;
    let mut reader = BufReader::with_capacity(1 << 16, file);
    let mut line = vec![0_u8; raster.width * 2];
    for row in (0..raster.height).rev() {
        reader.read_exact(&mut line).map_err(io)?;
        for (col, pair) in line.chunks_exact(2).enumerate() {
            let value = i16::from_be_bytes([pair[0], pair[1]]);
            if value != VOID {
                raster.put(row, col, f64::from(value));
            }
        }
    }
    let placement = Placement::Degrees {
        crs: Some("EPSG:4326".to_owned()),
        origin,
        step: [1.0 / (side - 1) as f64; 2],
        pixel_is_point: true,
    };
    raster.finish(path, placement, "int16", "SRTM HGT", options)
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
