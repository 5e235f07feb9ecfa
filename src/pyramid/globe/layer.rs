//! One geographic grid, made ready for sampling anywhere on the ellipsoid.

use super::axis::Axis;
use super::{GlobeError, coverage};
use crate::heights::HeightGrid;
use crate::pyramid::VOID;

/// Cells by which a grid may miss a full circle or a pole and still be meant to reach it: steps come
/// from files with as few as eight digits.
const SLACK_CELLS: f64 = 0.05;
/// Degrees by which a position may miss a border through rounding alone; a tenth of a millimetre.
const ROUNDING_DEG: f64 = 1e-9;

/// A grid with its rows at the poles and its repeated first column, if it reaches around.
#[derive(Debug)]
pub(super) struct Layer {
    /// Longitude of the first column in [-180, 180) and latitude of the first row, degrees.
    pub(super) origin: [f64; 2],
    /// Columns, eastward.
    pub(super) x: Axis,
    /// Rows, northward.
    pub(super) y: Axis,
    /// True when the columns close the circle: the last one repeats the first.
    pub(super) periodic: bool,
    /// South and north: true when the outermost row is the pole itself.
    pub(super) poles: [bool; 2],
    /// Heights in metres, row by row from the south-west, [`VOID`] where there is none.
    samples: Vec<f32>,
    /// Where blending to coarser grids has to happen.
    pub(super) coverage: coverage::Coverage,
    /// Shared by tiles that lie side by side.
    pub(super) mosaic: usize,
}

impl Layer {
    /// Degrees of longitude and latitude it spans.
    pub(super) fn size_deg(&self) -> [f64; 2] {
        [self.x.span, self.y.span]
    }

    pub(super) fn area_deg2(&self) -> f64 {
        let [x, y] = self.size_deg();
        x * y
    }

    /// Takes over a grid; `index` is its place in the caller's list, for messages.
    pub(super) fn new(index: usize, grid: HeightGrid) -> Result<Self, GlobeError> {
        let Some(degrees) = grid.georeference.degrees else {
            return Err(GlobeError::NotGeographic { index });
        };
        let broken = |detail| Err(GlobeError::Broken { index, detail });
        let [dx, dy] = degrees.step;
        if !(degrees.west.is_finite() && degrees.south.is_finite()) {
            return broken("its origin is not finite");
        }
        if !(dx > 0.0 && dy > 0.0 && dx <= 360.0 && dy <= 180.0) {
            return broken("its steps are no degrees between samples");
        }
        let (width, height) = (grid.width, grid.height);
        let count = width.checked_mul(height).filter(|_| width >= 2 && height >= 2);
        let masked = grid.valid.as_ref().is_none_or(|v| Some(v.len()) == count);
        if Some(grid.heights_m.len()) != count || !masked {
            return broken("its width and height do not fit its samples");
        }
        let north = degrees.south + dy * (height - 1) as f64;
        let reach = 90.0 + (0.5 + SLACK_CELLS) * dy;
        if degrees.south < -reach || north > reach {
            return Err(GlobeError::Latitude { index, south: degrees.south, north });
        }
        let around = dx * (width - 1) as f64;
        if around > 360.0 + SLACK_CELLS * dx {
            return Err(GlobeError::Longitude { index, degrees: around });
        }

        let periodic = around + dx >= 360.0 - SLACK_CELLS * dx;
        // A last column that stands on the first one is dropped for an exact copy of that.
        let columns = if around >= 360.0 - SLACK_CELLS * dx { width - 1 } else { width };
        let x = if periodic {
            let closing = 360.0 - dx * (columns - 1) as f64;
            Axis::new(columns + 1, dx, [if columns == 1 { closing } else { dx }, closing])
        } else {
            Axis::new(width, dx, [dx; 2])
        };

        let mut samples = grid.heights_m;
        if let Some(valid) = &grid.valid {
            for (h, _) in samples.iter_mut().zip(valid).filter(|(_, valid)| !**valid) {
                *h = VOID;
            }
        }
        for h in samples.iter_mut().filter(|h| !h.is_finite()) {
            *h = VOID;
        }

        // A row that stands at a pole, or past it, is the pole; where a grid that reaches around ends
        // up to a cell short of it, the pole is added.
        let ends = [degrees.south + 90.0, 90.0 - north];
        let at = ends.map(|e| e <= SLACK_CELLS * dy);
        let added = ends.map(|e| periodic && e > SLACK_CELLS * dy && e <= (1.0 + SLACK_CELLS) * dy);
        let poles = [at[0] || added[0], at[1] || added[1]];
        let gap = |side: usize| match (at[side], added[side]) {
            (true, _) => dy + ends[side],
            (_, true) => ends[side],
            _ => dy,
        };
        let rows = height + usize::from(added[0]) + usize::from(added[1]);
        let span = dy * (height - 1) as f64;
        // With two rows and no more, one cell takes the corrections of both of its ends.
        let end = |side: usize| if at[side] { ends[side] } else { 0.0 };
        let gaps = if rows == 2 { [span + end(0) + end(1); 2] } else { [gap(0), gap(1)] };
        let y = Axis::new(rows, dy, gaps);

        if x.last + 1 != width || rows != height {
            samples = widened(&samples, width, columns, x.last + 1, added);
        } else if periodic {
            close_rows(&mut samples, width);
        }
        let stride = x.last + 1;
        let unique = if periodic { columns } else { stride };
        if poles[0] {
            level_pole(&mut samples, stride, unique, 0, if added[0] { 1 } else { 0 });
        }
        if poles[1] {
            let top = rows - 1;
            level_pole(&mut samples, stride, unique, top, if added[1] { top - 1 } else { top });
        }
        let south = if poles[0] { -90.0 } else { degrees.south };
        let west = (degrees.west + 180.0).rem_euclid(360.0) - 180.0;
        let origin = [if west >= 180.0 { -180.0 } else { west }, south];
        let coverage = coverage::Coverage::alone(periodic, poles);
        Ok(Self { origin, x, y, periodic, poles, samples, coverage, mosaic: index })
    }

    /// All samples, the repeated column and the rows at the poles included; metres or [`VOID`].
    pub(super) fn samples(&self) -> &[f32] {
        &self.samples
    }

    /// Prepares blending over `cells` of this grid's own cells, at borders and around voids.
    pub(super) fn blend_over(&mut self, cells: f64) {
        let columns = self.x.last + 1;
        self.coverage.blend_over(cells, &self.samples, columns, self.periodic);
    }

    /// Degrees east of the first column and north of the first row; `None` outside.
    pub(super) fn offset(&self, lon: f64, lat: f64) -> Option<[f64; 2]> {
        let y = lat - self.origin[1];
        if !(-ROUNDING_DEG..=self.y.span + ROUNDING_DEG).contains(&y) {
            return None;
        }
        let mut x = lon - self.origin[0];
        if x < 0.0 {
            x += 360.0;
        }
        if x >= 360.0 {
            x -= 360.0;
        }
        if !self.periodic && x > self.x.span + ROUNDING_DEG {
            // Just west of the first column, the circle has wrapped by rounding.
            if x < 360.0 - ROUNDING_DEG {
                return None;
            }
            x = 0.0;
        }
        Some([x, y])
    }

    /// Bilinear height in metres and its weight over coarser grids, 0 to 1, at a position in degrees
    /// (longitude in [-180, 180]); `None` outside and in cells with a void corner.
    pub(super) fn sample(&self, lon: f64, lat: f64) -> Option<(f64, f64)> {
        let [x, y] = self.offset(lon, lat)?;
        let (i, s) = self.x.locate(x);
        let (j, t) = self.y.locate(y);
        let stride = self.x.last + 1;
        let low = j * stride + i;
        let (&[a, b], &[c, d]) =
            (self.samples.get(low..)?.first_chunk()?, self.samples.get(low + stride..)?.first_chunk()?);
        if a == VOID || b == VOID || c == VOID || d == VOID {
            return None;
        }
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let south = mix(f64::from(a), f64::from(b), s);
        let north = mix(f64::from(c), f64::from(d), s);
        let weight = self.coverage.weight([i, j], [s, t], [self.x.last, self.y.last]);
        Some((mix(south, north, t), weight))
    }
}

/// The samples with `columns` of `width` kept, repeated from the first up to `stride`, and room for the
/// rows `added` in the south and the north.
fn widened(samples: &[f32], width: usize, columns: usize, stride: usize, added: [bool; 2]) -> Vec<f32> {
    let height = samples.len() / width + usize::from(added[0]) + usize::from(added[1]);
    let mut out = Vec::with_capacity(stride * height);
    out.resize(stride * usize::from(added[0]), VOID);
    for row in samples.chunks_exact(width) {
        out.extend_from_slice(&row[..columns]);
        out.extend(row.iter().take(stride - columns));
    }
    out.resize(stride * height, VOID);
    out
}

/// Makes the last sample of every row the first one again.
fn close_rows(samples: &mut [f32], width: usize) {
    for row in samples.chunks_exact_mut(width) {
        row[width - 1] = row[0];
    }
}

/// Gives the pole in `row` one height: the mean of the first `unique` samples of row `from` that are
/// not void. Whatever the columns say, the pole is a single point.
fn level_pole(samples: &mut [f32], stride: usize, unique: usize, row: usize, from: usize) {
    let source = &samples[from * stride..from * stride + unique];
    let (mut sum, mut count) = (0.0_f64, 0_u32);
    for &h in source.iter().filter(|h| **h != VOID) {
        sum += f64::from(h);
        count += 1;
    }
    let mean = if count == 0 { VOID } else { (sum / f64::from(count)) as f32 };
    samples[row * stride..(row + 1) * stride].fill(mean);
}
