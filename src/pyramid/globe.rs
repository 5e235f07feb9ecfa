//! Heights anywhere on an ellipsoid, from geographic grids of any extent and spacing.
//!
//! Every height is a function of the place alone: a bilinear sample of the finest grid there, eased into
//! the coarser one towards the finer one's border. Levels are subsamples of that one function, so they
//! nest, and the charts of neighbouring faces agree bit for bit where they meet.

mod axis;
mod coverage;
mod face;
mod layer;
#[cfg(test)]
mod tests;

pub use face::GlobeFace;

use glam::DVec3;

use self::layer::Layer;
use super::VOID;
use crate::heights::HeightGrid;

/// Heights of a globe made of whole metres are multiples of this, metres.
///
/// Half the step of the source: interpolated heights stay finer than what was measured, and anything
/// from the deepest trench to the highest peak still travels as two bytes.
const STEP_M: f32 = 0.5;
/// Heights under this magnitude, metres, fit an `i16` in units of [`STEP_M`].
const FITS_M: f32 = 16_383.0;
/// Widest blend, cells; distances to voids are not counted further.
const MOST_BLEND_CELLS: f64 = 250.0;
/// Cells a side of a face: the least and the most.
const SIZES: [u32; 2] = [1 << 6, 1 << 21];
/// Relative rounding of steps such as 1/3600 that no power of two should be doubled for.
const ROUNDING: f64 = 1e-9;

/// Why grids cannot be put on a globe.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum GlobeError {
    /// The list of grids is empty.
    #[error("no height grid for the globe; name at least one geographic elevation file")]
    NoGrid,
    /// The grid is not placed in degrees.
    #[error(
        "grid {index} is not in longitude and latitude; warp it to EPSG:4326 (gdalwarp -t_srs EPSG:4326)"
    )]
    NotGeographic {
        /// Place in the list, from 0.
        index: usize,
    },
    /// Rows lie more than half a cell beyond a pole.
    #[error("grid {index} reaches from latitude {south} to {north}; cut it at -90 and 90 degrees")]
    Latitude {
        /// Place in the list, from 0.
        index: usize,
        /// Latitude of the southernmost row, degrees.
        south: f64,
        /// Latitude of the northernmost row, degrees.
        north: f64,
    },
    /// The columns go more than once around.
    #[error("grid {index} spans {degrees} degrees of longitude; cut it to at most 360")]
    Longitude {
        /// Place in the list, from 0.
        index: usize,
        /// First to last column, degrees.
        degrees: f64,
    },
    /// The fields of the grid contradict each other.
    #[error("grid {index} cannot be used: {detail}; read it again")]
    Broken {
        /// Place in the list, from 0.
        index: usize,
        /// What is wrong.
        detail: &'static str,
    },
}

/// Geographic height grids on one ellipsoid, finest first.
#[derive(Debug)]
pub struct Globe {
    layers: Vec<Layer>,
    range: Option<[f32; 2]>,
    has_voids: bool,
    step_m: Option<f32>,
}

impl Globe {
    /// Puts the grids on one globe; their order only matters among grids of one spacing (first wins).
    ///
    /// Over `blend_cells` of its own cells (at most 250) from its border, and from its voids, a grid
    /// passes smoothly into what coarser grids say; without a coarser grid there it keeps its value.
    /// Grids of one spacing that lie side by side with a shared row or column do not blend there.
    ///
    /// # Errors
    /// No grid at all; a grid that is not in degrees; rows more than half a cell beyond a pole; more
    /// than 360 degrees of longitude; a grid whose fields contradict each other.
    pub fn new(grids: Vec<HeightGrid>, blend_cells: f64) -> Result<Self, GlobeError> {
        if grids.is_empty() {
            return Err(GlobeError::NoGrid);
        }
        let integers = grids.iter().all(is_integer);
        let mut layers = Vec::with_capacity(grids.len());
        for (index, grid) in grids.into_iter().enumerate() {
            layers.push(Layer::new(index, grid)?);
        }
        layers.sort_by(|a, b| a.y.step.total_cmp(&b.y.step));
        join_neighbours(&mut layers);
        let blend_cells = if blend_cells.is_nan() { 0.0 } else { blend_cells.clamp(0.0, MOST_BLEND_CELLS) };
        let under = layers.len() - 1;
        for layer in &mut layers[..under] {
            layer.blend_over(blend_cells);
        }

        let mut range: Option<[f32; 2]> = None;
        let mut has_voids = true;
        for layer in &layers {
            let mut voids = false;
            for &h in layer.samples() {
                if h == VOID {
                    voids = true;
                } else {
                    let [low, high] = range.unwrap_or([h; 2]);
                    range = Some([low.min(h), high.max(h)]);
                }
            }
            has_voids &= voids || !(layer.periodic && layer.poles == [true; 2]);
        }
        let fits = range.is_some_and(|r| r.iter().all(|h| h.abs() < FITS_M));
        Ok(Self { layers, range, has_voids, step_m: (integers && fits).then_some(STEP_M) })
    }

    /// Unit normal in the middle of the largest grid and the angle from there to its corners, radians;
    /// `None` when the grids cover the whole globe.
    #[must_use]
    pub fn middle(&self) -> Option<(DVec3, f64)> {
        let layer = self.layers.iter().max_by(|a, b| a.area_deg2().total_cmp(&b.area_deg2()))?;
        let [x, y] = layer.size_deg();
        if !self.has_voids || x >= 300.0 && y >= 120.0 {
            return None;
        }
        let [west, south] = layer.origin;
        let (lon, lat) = ((west + 0.5 * x).to_radians(), (south + 0.5 * y).to_radians());
        // Around a pole, the pole is the middle.
        let lat =
            if x >= 300.0 && lat.abs() > 0.5 { lat.signum() * std::f64::consts::FRAC_PI_2 } else { lat };
        let wide = if x >= 300.0 { y } else { x * lat.cos() };
        let normal = DVec3::new(lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin());
        Some((normal, 0.5 * wide.hypot(y).to_radians()))
    }

    /// Number of grids.
    #[must_use]
    pub fn layer_count(&self) -> usize {
        self.layers.len()
    }

    /// Height in metres at a geodetic surface normal (unit length, world axes: x to longitude 0, z to
    /// the north pole); [`VOID`] where no grid has data, and for a normal that is not finite.
    #[must_use]
    pub fn height(&self, normal: DVec3) -> f32 {
        let Some([lon, lat]) = degrees(normal) else {
            return VOID;
        };
        let (mut sum, mut left, mut lowest) = (0.0, 1.0, None);
        let mut mosaic = usize::MAX;
        for layer in &self.layers {
            // On a shared border, the weight of one tile is the weight of all.
            if layer.mosaic == mosaic {
                continue;
            }
            let Some((height, weight)) = layer.sample(lon, lat) else {
                continue;
            };
            sum += left * weight * height;
            left *= 1.0 - weight;
            lowest = Some(height);
            mosaic = layer.mosaic;
            if left <= 0.0 {
                break;
            }
        }
        // What is left over belongs to the last grid that had a value: nothing lies under it.
        let Some(lowest) = lowest else {
            return VOID;
        };
        let height = sum + left * lowest;
        if let Some(step) = self.step_m {
            let step = f64::from(step);
            // Adding 0 turns -0 into 0, which would come back from two bytes with another sign.
            return ((height / step).round() * step + 0.0) as f32;
        }
        height as f32
    }

    /// Cells along the side of a cube face: the smallest power of two from 2^6 to 2^21 whose cells are no
    /// larger than those of the finest grid, both as angles along the meridian.
    #[must_use]
    pub fn size(&self) -> u32 {
        let finest = self.layers.first().map_or(90.0, |l| l.y.step);
        // The charts' cells are widest on the lines through a face's centre: 90 degrees, evenly divided.
        let cells = (90.0 / finest * (1.0 - ROUNDING)).ceil();
        // Beyond the range of u32 the cast gives the largest one.
        (cells as u32).clamp(SIZES[0], SIZES[1]).next_power_of_two()
    }

    /// True when a grid with less than `cell_deg` degrees between its rows may reach into the cap of
    /// `radius_rad` radians around the geodetic normal `centre`; never false when one does.
    #[must_use]
    pub fn finer_than(&self, cell_deg: f64, centre: DVec3, radius_rad: f64) -> bool {
        let mut finer = self.layers.iter().filter(|l| l.y.step < cell_deg * (1.0 - ROUNDING)).peekable();
        if finer.peek().is_none() {
            return false;
        }
        let Some([lon, lat]) = degrees(centre).filter(|_| radius_rad.is_finite()) else {
            return true;
        };
        let radius = radius_rad.abs().to_degrees() + ROUNDING;
        // The widest parallel of a cap lies poleward of its centre; a cap over a pole has all of them.
        let half = if lat.abs() + radius >= 90.0 {
            180.0
        } else {
            let ratio = radius.to_radians().sin() / lat.to_radians().cos();
            ratio.min(1.0).asin().to_degrees() + ROUNDING
        };
        finer.any(|layer| {
            let south = lat - radius - layer.origin[1];
            if south > layer.y.span || south + 2.0 * radius < 0.0 {
                return false;
            }
            let west = (lon - half - layer.origin[0]).rem_euclid(360.0);
            layer.periodic || west <= layer.x.span || west + 2.0 * half >= 360.0
        })
    }

    /// Bounds of all heights, metres; `None` when every sample of every grid is void.
    #[must_use]
    pub fn height_range(&self) -> Option<[f32; 2]> {
        self.range
    }

    /// True unless one grid alone covers the whole ellipsoid without a void: whether several do
    /// together is not looked into.
    #[must_use]
    pub fn has_voids(&self) -> bool {
        self.has_voids
    }

    /// `Some(0.5)` when every grid has whole metres only and all of them are under 16383 m: heights are
    /// then rounded to multiples of half a metre, and those multiples fit an `i16`.
    #[must_use]
    pub fn step_m(&self) -> Option<f32> {
        self.step_m
    }
}

/// Longitude and geodetic latitude of a normal in degrees; `None` when it is not finite.
fn degrees(normal: DVec3) -> Option<[f64; 2]> {
    if !normal.is_finite() {
        return None;
    }
    let flat = (normal.x * normal.x + normal.y * normal.y).sqrt();
    // An arc sine would lose half of the digits near the poles.
    let lat = normal.z.atan2(flat).to_degrees().clamp(-90.0, 90.0);
    // At a pole, the signs of two zeros would choose the longitude.
    let lon = if flat == 0.0 { 0.0 } else { normal.y.atan2(normal.x).to_degrees() };
    Some([lon, lat])
}

/// True when the grid comes from an integer type and all its heights are still whole metres.
fn is_integer(grid: &HeightGrid) -> bool {
    let integer = ["int", "uint", "byte"].iter().any(|t| grid.dtype.starts_with(t));
    let valid = |i: usize| grid.valid.as_ref().is_none_or(|v| v.get(i).copied().unwrap_or(false));
    integer && grid.heights_m.iter().enumerate().all(|(i, h)| h.fract() == 0.0 || !valid(i))
}

/// Tells grids of one size and spacing which of them lie side by side, so that tiles of one survey keep
/// their own heights up to the rows and columns that they share, and makes one mosaic of them.
fn join_neighbours(layers: &mut [Layer]) {
    for (index, layer) in layers.iter_mut().enumerate() {
        layer.mosaic = index;
    }
    for a in 0..layers.len() {
        for b in 0..layers.len() {
            let place = neighbour(&layers[a], &layers[b]);
            if let Some(place) = place.filter(|p| *p != [1, 1]) {
                layers[a].coverage.join(place);
                let (p, q) = (layers[a].mosaic, layers[b].mosaic);
                for layer in layers.iter_mut().filter(|l| l.mosaic == p.max(q)) {
                    layer.mosaic = p.min(q);
                }
            }
        }
    }
    // A mosaic is named after its first tile, which keeps the finest first.
    layers.sort_by_key(|l| l.mosaic);
}

/// Where tile `b` lies as seen from its twin `a`: column and row from 0 to 2, 1 being that of `a`.
fn neighbour(a: &Layer, b: &Layer) -> Option<[usize; 2]> {
    let same = |p: f64, q: f64| (p - q).abs() <= 1e-6 * p;
    let twins = [(&a.x, &b.x), (&a.y, &b.y)].iter().all(|(p, q)| p.last == q.last && same(p.step, q.step));
    if !twins || a.periodic || b.periodic {
        return None;
    }
    let side = |offset: f64, span: f64, step: f64| {
        (0..3_u8).find(|k| (offset - (f64::from(*k) - 1.0) * span).abs() <= 0.5 * step).map(usize::from)
    };
    let east = (b.origin[0] - a.origin[0] + 180.0).rem_euclid(360.0) - 180.0;
    Some([side(east, a.x.span, a.x.step)?, side(b.origin[1] - a.origin[1], a.y.span, a.y.step)?])
}
