//! The grid itself and the options for reading one.

use super::geo::Georeference;
use super::{HeightError, alloc, fill};

/// A regular grid of heights in metres.
///
/// Row-major, row 0 = SOUTH, column 0 = WEST: `index = row * width + column`.
#[derive(Clone, Debug)]
pub struct HeightGrid {
    /// Columns, at least 2.
    pub width: usize,
    /// Rows, at least 2.
    pub height: usize,
    /// `width * height` heights in metres, finite everywhere; void samples hold 0.0.
    pub heights_m: Vec<f32>,
    /// Which samples carry data, same length and order; `None` when all do.
    pub valid: Option<Vec<bool>>,
    /// Metres between samples, east and north, both positive.
    pub spacing_m: [f64; 2],
    /// Plane coordinates x, y in metres of the south-west sample (a node, not a pixel corner).
    pub origin_m: [f64; 2],
    /// What the source says about its place.
    pub georeference: Georeference,
    /// Sample type of the source: "int16", "uint16", "float32", "byte", ...
    pub dtype: &'static str,
    /// Format of the source: "GeoTIFF", "SRTM HGT", "PNG", "procedural" or "memory".
    pub format: &'static str,
}

/// How to read a terrain.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// Metres between samples of a source that does not say; an error for one that does.
    pub spacing_m: Option<f64>,
    /// Factor on the heights, after the source's own scale, offset and unit; default 1.
    pub z_scale: Option<f64>,
    /// Metres added to the heights after `z_scale`; default 0.
    pub z_offset: Option<f64>,
    /// Most samples accepted, checked before memory is taken; default 2^28.
    pub max_samples: u64,
    /// Most bytes of decoded blocks kept by a raster read by rectangles; default 128 MiB.
    pub block_cache_bytes: u64,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            spacing_m: None,
            z_scale: None,
            z_offset: None,
            max_samples: 1 << 28,
            block_cache_bytes: 128 << 20,
        }
    }
}

/// Distances between samples that f32 positions and their squares can hold.
pub(crate) const SPACING_M: std::ops::RangeInclusive<f64> = 1e-6..=1e9;

/// Largest scale, offset and amplitude: what is asked for must never overflow into a void in silence.
pub(crate) const MOST_M: f64 = 1e12;

impl ReadOptions {
    /// Refuses numbers that would give an unusable grid (`BadOption`).
    pub(crate) fn check(&self) -> Result<(), HeightError> {
        let bad = |name, value, expected| Err(HeightError::BadOption { name, value, expected });
        match (self.spacing_m, self.z_scale, self.z_offset) {
            (Some(s), _, _) if !SPACING_M.contains(&s) => bad("spacing", s, "metres from 1e-6 to 1e9"),
            (_, Some(z), _) if z == 0.0 || z.is_nan() || z.abs() > MOST_M => {
                bad("z_scale", z, "a number other than 0, at most 1e12 in magnitude")
            }
            (_, _, Some(o)) if o.is_nan() || o.abs() > MOST_M => {
                bad("z_offset", o, "metres, at most 1e12 in magnitude")
            }
            _ => Ok(()),
        }
    }
}

/// What becomes of void samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodataPolicy {
    /// They stay void.
    Hole,
    /// They get heights interpolated from the valid samples around them.
    Fill,
}

impl HeightGrid {
    /// A grid from heights in metres (row 0 south), spacing 1 m, south-west sample at (0, 0).
    ///
    /// Samples that are not finite become void. Errors: `TooSmall`, `Length`.
    pub fn new(width: usize, height: usize, heights_m: Vec<f32>) -> Result<Self, HeightError> {
        alloc::sample_count("grid", width as u64, height as u64, u64::MAX)?;
        let expected = width.saturating_mul(height);
        if heights_m.len() != expected {
            return Err(HeightError::Length { width, height, expected, got: heights_m.len() });
        }
        let mut heights_m = heights_m;
        let mut valid = None;
        if heights_m.iter().any(|h| !h.is_finite()) {
            valid = Some(heights_m.iter().map(|h| h.is_finite()).collect());
            for h in heights_m.iter_mut().filter(|h| !h.is_finite()) {
                *h = 0.0;
            }
        }
        Ok(Self {
            width,
            height,
            heights_m,
            valid,
            spacing_m: [1.0; 2],
            origin_m: [0.0; 2],
            georeference: Georeference::none(),
            dtype: "float32",
            format: "memory",
        })
    }

    /// Number of void samples.
    pub fn void_count(&self) -> u64 {
        self.valid.as_ref().map_or(0, |v| v.iter().filter(|&&ok| !ok).count() as u64)
    }

    /// Lowest, highest and mean height in metres of the valid samples; `None` if all are void.
    pub fn min_max_mean(&self) -> Option<(f32, f32, f64)> {
        let mut low = f32::INFINITY;
        let mut high = f32::NEG_INFINITY;
        let mut sum = 0.0_f64;
        let mut count = 0_u64;
        for (i, &h) in self.heights_m.iter().enumerate() {
            if self.is_valid(i) {
                low = low.min(h);
                high = high.max(h);
                sum += f64::from(h);
                count += 1;
            }
        }
        (count > 0).then(|| (low, high, sum / count as f64))
    }

    /// West, south, east, north of the outermost samples, in native units: degrees for a
    /// geographic grid, else metres.
    pub fn bounds(&self) -> [f64; 4] {
        let (origin, step) = match self.georeference.degrees {
            Some(d) => ([d.west, d.south], d.step),
            None => (self.origin_m, self.spacing_m),
        };
        [
            origin[0],
            origin[1],
            origin[0] + step[0] * self.width.saturating_sub(1) as f64,
            origin[1] + step[1] * self.height.saturating_sub(1) as f64,
        ]
    }

    /// The same grid with its voids treated by `policy`.
    ///
    /// `Fill` leaves valid samples untouched, stays within their range and gives `valid: None`;
    /// a grid without any valid sample becomes flat at 0.
    pub fn with_nodata(mut self, policy: NodataPolicy) -> Self {
        if policy == NodataPolicy::Fill
            && let Some(valid) = self.valid.take()
        {
            fill::fill_voids(&mut self.heights_m, &valid, self.width, self.height);
        }
        self
    }

    /// Plane coordinates in metres of a native position (longitude and latitude in degrees for a
    /// geographic grid, else metres already).
    pub fn native_to_world(&self, native: [f64; 2]) -> [f64; 2] {
        match self.georeference.degrees {
            Some(d) => [native[0] * d.metres_per_degree[0], native[1] * d.metres_per_degree[1]],
            None => native,
        }
    }

    /// Inverse of [`Self::native_to_world`].
    pub fn world_to_native(&self, world_m: [f64; 2]) -> [f64; 2] {
        match self.georeference.degrees {
            Some(d) => [world_m[0] / d.metres_per_degree[0], world_m[1] / d.metres_per_degree[1]],
            None => world_m,
        }
    }

    fn is_valid(&self, index: usize) -> bool {
        self.valid.as_ref().is_none_or(|v| v.get(index).copied().unwrap_or(false))
    }
}
