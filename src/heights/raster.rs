//! From raw source values to a finished grid: height scaling, voids, placement.

use std::path::Path;

use super::geo::{Degrees, Georeference, metres_per_degree};
use super::{HeightError, HeightGrid, ReadOptions, alloc};

/// The linear map from raw values to metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ZMap {
    scale: f64,
    offset: f64,
}

impl ZMap {
    /// Raw values are metres.
    pub(crate) const IDENTITY: Self = Self { scale: 1.0, offset: 0.0 };

    /// This map followed by `h * scale + offset`.
    pub(crate) fn then(self, scale: f64, offset: f64) -> Self {
        Self { scale: self.scale * scale, offset: self.offset * scale + offset }
    }

    /// This map followed by the caller's `z_scale` and `z_offset`.
    pub(crate) fn then_options(self, options: &ReadOptions) -> Self {
        self.then(options.z_scale.unwrap_or(1.0), options.z_offset.unwrap_or(0.0))
    }

    /// One height in metres; `None` if it is not a finite `f32`.
    pub(crate) fn metres(self, raw: f64) -> Option<f32> {
        let h = if self == Self::IDENTITY { raw as f32 } else { self.apply(raw) };
        h.is_finite().then_some(h)
    }

    /// One height in metres by scale and offset, also where that changes nothing.
    pub(crate) fn apply(self, raw: f64) -> f32 {
        (raw * self.scale + self.offset) as f32
    }
}

/// Where the samples of a source lie. Positions and steps are those of samples, not of pixel
/// edges, and steps are positive.
pub(crate) enum Placement {
    /// The source does not say.
    Unknown {
        /// Coordinate system code, if it names one all the same.
        crs: Option<String>,
        /// Raster type of the source.
        pixel_is_point: bool,
    },
    /// Plane metres.
    Metres {
        /// Coordinate system code.
        crs: Option<String>,
        /// South-west sample, metres.
        origin: [f64; 2],
        /// Spacing, metres.
        step: [f64; 2],
        /// Raster type of the source.
        pixel_is_point: bool,
    },
    /// Longitude and latitude in degrees.
    Degrees {
        /// Coordinate system code.
        crs: Option<String>,
        /// South-west sample, degrees.
        origin: [f64; 2],
        /// Spacing, degrees.
        step: [f64; 2],
        /// Raster type of the source.
        pixel_is_point: bool,
    },
}

/// Where a raster lies, in metres.
pub(crate) struct Located {
    pub(crate) georeference: Georeference,
    pub(crate) origin_m: [f64; 2],
    pub(crate) spacing_m: [f64; 2],
}

impl Placement {
    /// The place of a raster of `height` rows. Errors: `AlreadyGeoreferenced`, and `Malformed` for
    /// an impossible place.
    pub(crate) fn locate(
        self,
        path: &Path,
        height: u64,
        format: &'static str,
        options: &ReadOptions,
    ) -> Result<Located, HeightError> {
        let (georeference, origin_m, spacing_m) = match self {
            Self::Unknown { crs, pixel_is_point } => {
                let georeference = Georeference { crs, pixel_is_point, ..Georeference::none() };
                (georeference, [0.0; 2], [options.spacing_m.unwrap_or(1.0); 2])
            }
            Self::Metres { crs, origin, step, pixel_is_point } => {
                let georeference =
                    Georeference { crs, degrees: None, unit: "metre", georeferenced: true, pixel_is_point };
                (georeference, origin, step)
            }
            Self::Degrees { crs, origin: [west, south], step, pixel_is_point } => {
                let centre = south + 0.5 * step[1] * height.saturating_sub(1) as f64;
                if centre.is_nan() || centre.abs() > 89.9 {
                    let detail = format!("centre latitude {centre} leaves no plane around it");
                    return Err(HeightError::malformed(path, format, detail));
                }
                let metres_per_degree = metres_per_degree(centre);
                let georeference = Georeference {
                    crs,
                    degrees: Some(Degrees { west, south, step, metres_per_degree }),
                    unit: "degree",
                    georeferenced: true,
                    pixel_is_point,
                };
                let [mx, my] = metres_per_degree;
                (georeference, [west * mx, south * my], [step[0] * mx, step[1] * my])
            }
        };
        let usable = origin_m.iter().all(|v| v.is_finite())
            && spacing_m.iter().all(|v| super::grid::SPACING_M.contains(v));
        if !usable {
            let detail = format!("spacing {spacing_m:?} m at {origin_m:?} m");
            return Err(HeightError::malformed(path, format, detail));
        }
        if georeference.georeferenced && options.spacing_m.is_some() {
            return Err(HeightError::AlreadyGeoreferenced {
                path: path.to_owned(),
                east_m: spacing_m[0],
                north_m: spacing_m[1],
            });
        }
        Ok(Located { georeference, origin_m, spacing_m })
    }
}

/// Samples on their way into a grid. Starts all void, and all memory untouched.
pub(crate) struct Raster {
    pub(crate) width: usize,
    pub(crate) height: usize,
    heights: Vec<f32>,
    valid: Vec<bool>,
    valid_count: usize,
    z: ZMap,
}

impl Raster {
    /// An all-void raster. Errors: `TooSmall`, `TooLarge`, `OutOfMemory`.
    pub(crate) fn new(
        path: &Path,
        [width, height]: [u64; 2],
        z: ZMap,
        options: &ReadOptions,
    ) -> Result<Self, HeightError> {
        let subject = path.display().to_string();
        let count = alloc::sample_count(&subject, width, height, options.max_samples)?;
        Ok(Self {
            width: width as usize,
            height: height as usize,
            heights: alloc::zeroed(&subject, count)?,
            valid: alloc::zeroed(&subject, count)?,
            valid_count: 0,
            z,
        })
    }

    /// Sets the sample in `row` (0 = south) to a raw value; does nothing outside the raster.
    /// To be called at most once for a sample.
    pub(crate) fn put(&mut self, row: usize, col: usize, raw: f64) {
        if row >= self.height || col >= self.width {
            return;
        }
        let i = row * self.width + col;
        if let Some(h) = self.z.metres(raw) {
            self.heights[i] = h;
            self.valid[i] = true;
            self.valid_count += 1;
        }
    }

    /// Sets samples of `row` (0 = south) from `col` on to heights in metres, of which those that
    /// are not finite stay void; does nothing outside the raster.
    /// To be called at most once for a sample.
    pub(crate) fn put_row(&mut self, row: usize, col: usize, heights: &[f32]) {
        if row >= self.height || col >= self.width {
            return;
        }
        let start = row * self.width + col;
        let end = start + heights.len().min(self.width - col);
        let targets = self.heights[start..end].iter_mut().zip(&mut self.valid[start..end]);
        for ((target, valid), &h) in targets.zip(heights) {
            if h.is_finite() {
                *target = h;
                *valid = true;
                self.valid_count += 1;
            }
        }
    }

    /// The grid. Errors: as [`Placement::locate`].
    pub(crate) fn finish(
        self,
        path: &Path,
        placement: Placement,
        dtype: &'static str,
        format: &'static str,
        options: &ReadOptions,
    ) -> Result<HeightGrid, HeightError> {
        let Located { georeference, origin_m, spacing_m } =
            placement.locate(path, self.height as u64, format, options)?;
        Ok(HeightGrid {
            width: self.width,
            height: self.height,
            valid: (self.valid_count < self.valid.len()).then_some(self.valid),
            heights_m: self.heights,
            spacing_m,
            origin_m,
            georeference,
            dtype,
            format,
        })
    }
}
