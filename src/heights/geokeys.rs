//! GeoTIFF keys and placement tags, turned into a [`Placement`].

use std::path::Path;

use super::HeightError;
use super::gdal_tags::{FOOT_M, US_FOOT_M};
use super::raster::Placement;

const FORMAT: &str = "GeoTIFF";

/// The raw placement tags of one image; empty where a tag is missing.
#[derive(Debug, Default)]
pub(crate) struct GeoTags {
    /// Tag 33550.
    pub(crate) scale: Vec<f64>,
    /// Tag 33922.
    pub(crate) tiepoints: Vec<f64>,
    /// Tag 34264.
    pub(crate) transform: Vec<f64>,
    /// Tag 34735.
    pub(crate) keys: Vec<u64>,
    /// Tag 34736.
    pub(crate) doubles: Vec<f64>,
}

/// Placement, the direction of the rows, and the unit of the heights.
pub(crate) struct Placed {
    pub(crate) placement: Placement,
    /// Whether row 0 of the file is the northern one.
    pub(crate) north_up: bool,
    /// Metres per vertical unit, if the file names one.
    pub(crate) vertical_unit_m: Option<f64>,
}

/// Where sample (column, row) of the file lies: `x = x0 + column * dx`, `y = y0 + row * dy`.
struct Affine {
    x0: f64,
    dx: f64,
    y0: f64,
    dy: f64,
}

/// Interprets the tags for a raster of `height` rows.
///
/// A CRS without a linear unit key is taken to be in metres; unknown vertical units likewise.
/// Errors: `Rotated`, `Unsupported` for units and mirrored columns, `Malformed`.
pub(crate) fn place(path: &Path, tags: &GeoTags, height: u64) -> Result<Placed, HeightError> {
    let model = tags.short(1024);
    let geographic_crs = tags.short(2048);
    let projected_crs = tags.short(3072);
    let geographic = match model {
        Some(2) => true,
        Some(1) => false,
        Some(3) => {
            let detail = "geocentric coordinates";
            return Err(HeightError::unsupported(path, FORMAT, detail));
        }
        _ => geographic_crs.is_some() && projected_crs.is_none(),
    };
    let code = if geographic { geographic_crs } else { projected_crs };
    let crs = code.filter(|c| (1024..32767).contains(c)).map(|c| format!("EPSG:{c}"));
    let pixel_is_point = tags.short(1025) == Some(2);
    let vertical_unit_m = match (tags.short(4099), tags.short(4096)) {
        (Some(9001), _) => Some(1.0),
        (Some(9002), _) | (None, Some(8228)) => Some(FOOT_M),
        (Some(9003), _) | (None, Some(6360)) => Some(US_FOOT_M),
        _ => None,
    };
    let Some(affine) = affine(path, tags, pixel_is_point)? else {
        return Ok(Placed {
            placement: Placement::Unknown { crs, pixel_is_point },
            north_up: true,
            vertical_unit_m,
        });
    };
    let unit = if geographic { tags.angular_unit(path)? } else { tags.linear_unit(path)? };
    let north_up = affine.dy < 0.0;
    let last_row = height.saturating_sub(1) as f64;
    let south = if north_up { affine.y0 + last_row * affine.dy } else { affine.y0 };
    let origin = [affine.x0 * unit, south * unit];
    let step = [affine.dx * unit, affine.dy.abs() * unit];
    let placement = if geographic {
        Placement::Degrees { crs, origin, step, pixel_is_point }
    } else {
        Placement::Metres { crs, origin, step, pixel_is_point }
    };
    Ok(Placed { placement, north_up, vertical_unit_m })
}

/// The sample positions in native units; `None` without placement (ground control points alone
/// are none).
fn affine(path: &Path, tags: &GeoTags, point: bool) -> Result<Option<Affine>, HeightError> {
    let half = if point { 0.0 } else { 0.5 };
    let found = match (&tags.scale[..], &tags.tiepoints[..], &tags.transform[..]) {
        // GDAL before 1.6 wrote a negative scale for ordinary north-up files, and readers have
        // ignored its sign ever since.
        ([sx, sy, ..], [i, j, _, x, y, ..], _) => {
            Affine { x0: x + (half - i) * sx, dx: *sx, y0: y - (half - j) * sy.abs(), dy: -sy.abs() }
        }
        (_, _, [a, b, _, x, e, f, _, y, ..]) => {
            let tiny = 1e-9 * (a.abs() + f.abs());
            if b.abs() > tiny || e.abs() > tiny {
                return Err(HeightError::Rotated { path: path.to_owned() });
            }
            Affine { x0: x + half * a, dx: *a, y0: y + half * f, dy: *f }
        }
        _ => return Ok(None),
    };
    let values = [found.x0, found.dx, found.y0, found.dy];
    if values.iter().any(|v| !v.is_finite()) || found.dx == 0.0 || found.dy == 0.0 {
        let detail = format!("pixel size {} x {}", found.dx, found.dy);
        return Err(HeightError::malformed(path, FORMAT, detail));
    }
    if found.dx < 0.0 {
        let detail = "columns that run from east to west";
        return Err(HeightError::unsupported(path, FORMAT, detail));
    }
    Ok(Some(found))
}

impl GeoTags {
    /// The entry of a key: location, count, value or index.
    fn entry(&self, key: u64) -> Option<[u64; 3]> {
        self.keys.get(4..)?.chunks_exact(4).find(|e| e[0] == key).map(|e| [e[1], e[2], e[3]])
    }

    /// A key with an immediate value.
    fn short(&self, key: u64) -> Option<u64> {
        match self.entry(key)? {
            [0, _, value] => Some(value),
            _ => None,
        }
    }

    /// A key whose value is in the doubles.
    fn double(&self, key: u64) -> Option<f64> {
        match self.entry(key)? {
            [34736, _, index] => self.doubles.get(usize::try_from(index).ok()?).copied(),
            _ => None,
        }
    }

    /// Metres per unit of the plane coordinates.
    fn linear_unit(&self, path: &Path) -> Result<f64, HeightError> {
        match self.short(3076) {
            None | Some(0 | 9001) => Ok(1.0),
            Some(9002) => Ok(FOOT_M),
            Some(9003) => Ok(US_FOOT_M),
            Some(9036) => Ok(1000.0),
            Some(32767) => self.user_unit(path, 3077, 1.0),
            Some(code) => {
                let detail = format!("linear unit EPSG:{code}");
                Err(HeightError::unsupported(path, FORMAT, detail))
            }
        }
    }

    /// Degrees per unit of the geographic coordinates.
    fn angular_unit(&self, path: &Path) -> Result<f64, HeightError> {
        match self.short(2054) {
            None | Some(0 | 9102 | 9122) => Ok(1.0),
            Some(9101) => Ok(1.0_f64.to_degrees()),
            Some(32767) => self.user_unit(path, 2055, 1.0_f64.to_degrees()),
            Some(code) => {
                let detail = format!("angular unit EPSG:{code}");
                Err(HeightError::unsupported(path, FORMAT, detail))
            }
        }
    }

    fn user_unit(&self, path: &Path, key: u64, factor: f64) -> Result<f64, HeightError> {
        let size = self.double(key).map(|v| v * factor);
        size.filter(|v| v.is_finite() && *v > 0.0).ok_or_else(|| {
            HeightError::malformed(path, FORMAT, format!("unit size in key {key} is unusable"))
        })
    }
}
