//! Several rasters of one lattice as one: tiles of a survey, joined at the rows and columns they share.

use std::sync::{Arc, Mutex, PoisonError};

use super::geo::metres_per_degree;
use super::{Degrees, Georeference, HeightError, RasterHeader, RasterSource};

/// Furthest that a tile's nodes may lie off the first one's lattice, cells.
const OFF_LATTICE: f64 = 0.01;
/// Parts kept open at once: what each holds (its file, decoded blocks) must not grow with their number.
const OPEN: usize = 8;

/// Opens a part by its name.
pub type Opener = Box<dyn Fn(&str) -> Result<Box<dyn RasterSource>, HeightError> + Send + Sync>;

/// Rasters side by side. Where several have a height, the first in the list wins; where none has, it is void.
pub struct Mosaic {
    header: RasterHeader,
    parts: Vec<Part>,
    band_rows: u64,
    opener: Opener,
    /// Parts that are open, the least recently used first.
    open: Mutex<Vec<(usize, Arc<dyn RasterSource>)>>,
}

struct Part {
    name: String,
    header: RasterHeader,
    /// South-west node in the mosaic.
    at: [u64; 2],
}

impl Mosaic {
    /// Joins the rasters of these names. Each is opened once to see what it is, and again when it is read; few
    /// are open at any time.
    ///
    /// # Errors
    /// `Mosaic` when they do not lie on one lattice, or span more than 2^31 samples a side; those of `opener`.
    pub fn new(names: &[String], opener: Opener) -> Result<Self, HeightError> {
        let mut parts: Vec<(String, RasterHeader)> = Vec::with_capacity(names.len());
        let mut band_rows = u64::MAX;
        for name in names {
            let part = opener(name)?;
            band_rows = band_rows.min(part.band_rows());
            parts.push((name.clone(), part.header().clone()));
        }
        let Some((first_name, base)) = parts.first().cloned() else {
            return Err(HeightError::Mosaic { name: "mosaic".into(), reason: "no raster is given".into() });
        };
        let (origin, step) = frame(&base);
        let mut places = Vec::with_capacity(parts.len());
        for (name, part) in &parts {
            let wrong = |reason: String| HeightError::Mosaic { name: name.clone(), reason };
            let header = part;
            let (own, own_step) = frame(header);
            if header.georeference.unit != base.georeference.unit
                || header.georeference.crs != base.georeference.crs
            {
                let crs = |h: &RasterHeader| h.georeference.crs.clone().unwrap_or_else(|| "none".into());
                let (theirs, ours) = (crs(&base), crs(header));
                return Err(wrong(format!(
                    "its coordinate system is {ours}, that of {first_name} is {theirs}; warp one to the other"
                )));
            }
            if !header.georeference.georeferenced && parts.len() > 1 {
                return Err(wrong("it has no georeference, so its place among the others is unknown".into()));
            }
            let mut at = [0_i64; 2];
            for axis in 0..2 {
                let side = [header.width, header.height][axis] as f64;
                // Over its whole width it must not drift off the lattice.
                let drift = (own_step[axis] / step[axis] - 1.0).abs() * side;
                if drift.is_nan() || drift > OFF_LATTICE {
                    return Err(wrong(format!(
                        "its samples are {} apart, those of {first_name} {}; resample one (gdalwarp -tr)",
                        own_step[axis], step[axis]
                    )));
                }
                let offset = (own[axis] - origin[axis]) / step[axis];
                if (offset - offset.round()).abs() > OFF_LATTICE || offset.abs() > 2e9 {
                    return Err(wrong(format!(
                        "its nodes lie {offset:.3} cells from those of {first_name}; resample one (gdalwarp -tap)"
                    )));
                }
                #[expect(clippy::cast_possible_truncation, reason = "at most 2e9 in magnitude")]
                let whole = offset.round() as i64;
                at[axis] = whole;
            }
            places.push(at);
        }
        let low = [0, 1].map(|a| places.iter().map(|p| p[a]).min().unwrap_or(0));
        let sizes = parts.iter().map(|(_, p)| [p.width, p.height]);
        let high = places.iter().zip(sizes).fold([i64::MIN; 2], |high, (p, size)| {
            [0, 1].map(|a| high[a].max(p[a].saturating_add(i64::try_from(size[a]).unwrap_or(i64::MAX))))
        });
        let size = [0, 1].map(|a| u64::try_from(high[a] - low[a]).unwrap_or(u64::MAX));
        if size.iter().any(|s| *s > i32::MAX as u64) {
            return Err(HeightError::Mosaic {
                name: first_name,
                reason: format!("the mosaic would have {} x {} samples, too many a side", size[0], size[1]),
            });
        }
        let header = joined(&base, &parts, low, size);
        let place = |p: [i64; 2]| [0, 1].map(|a| u64::try_from(p[a] - low[a]).unwrap_or(0));
        let parts = parts.into_iter().zip(places);
        let parts = parts.map(|((name, header), p)| Part { name, header, at: place(p) }).collect();
        Ok(Self { header, parts, band_rows, opener, open: Mutex::default() })
    }

    fn part(&self, number: usize) -> Result<Arc<dyn RasterSource>, HeightError> {
        let known = |open: &mut Vec<(usize, Arc<dyn RasterSource>)>| {
            let at = open.iter().position(|(k, _)| *k == number)?;
            let part = open.remove(at);
            open.push(part.clone());
            Some(part.1)
        };
        if let Some(part) = known(&mut self.open.lock().unwrap_or_else(PoisonError::into_inner)) {
            return Ok(part);
        }
        let part: Arc<dyn RasterSource> = (self.opener)(&self.parts[number].name)?.into();
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(other) = known(&mut open) {
            return Ok(other);
        }
        if open.len() >= OPEN {
            open.remove(0);
        }
        open.push((number, part.clone()));
        Ok(part)
    }
}

/// South-west node and spacing in the raster's own units.
fn frame(header: &RasterHeader) -> ([f64; 2], [f64; 2]) {
    match header.georeference.degrees {
        Some(d) => ([d.west, d.south], d.step),
        None => (header.origin_m, header.spacing_m),
    }
}

fn joined(
    base: &RasterHeader,
    parts: &[(String, RasterHeader)],
    low: [i64; 2],
    size: [u64; 2],
) -> RasterHeader {
    let (origin, step) = frame(base);
    let corner = [0, 1].map(|a| origin[a] + low[a] as f64 * step[a]);
    let mut header = RasterHeader { width: size[0], height: size[1], ..base.clone() };
    match base.georeference.degrees {
        None => header.origin_m = corner,
        Some(_) => {
            let centre = corner[1] + 0.5 * step[1] * (size[1] - 1) as f64;
            let [mx, my] = metres_per_degree(centre.clamp(-89.9, 89.9));
            header.origin_m = [corner[0] * mx, corner[1] * my];
            header.spacing_m = [step[0] * mx, step[1] * my];
            header.georeference = Georeference {
                degrees: Some(Degrees {
                    west: corner[0],
                    south: corner[1],
                    step,
                    metres_per_degree: [mx, my],
                }),
                ..base.georeference.clone()
            };
        }
    }
    let headers = || parts.iter().map(|(_, h)| h);
    header.raw = headers().all(|h| h.raw);
    if headers().any(|h| h.dtype != base.dtype) {
        let short = |h: &RasterHeader| matches!(h.dtype, "byte" | "int8" | "int16");
        header.dtype = if headers().all(short) { "int16" } else { "float32" };
    }
    header
}

impl RasterSource for Mosaic {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn band_rows(&self) -> u64 {
        self.band_rows
    }

    fn read(&self, at: [u64; 2], size: [usize; 2], out: &mut [f32]) -> Result<(), HeightError> {
        out.fill(f32::NAN);
        let mut own = Vec::new();
        for (number, part) in self.parts.iter().enumerate() {
            let extent = [part.header.width, part.header.height];
            let lo = [0, 1].map(|a| at[a].max(part.at[a]));
            let hi = [0, 1].map(|a| (at[a] + size[a] as u64).min(part.at[a] + extent[a]));
            if lo[0] >= hi[0] || lo[1] >= hi[1] {
                continue;
            }
            let count = [0, 1].map(|a| usize::try_from(hi[a] - lo[a]).unwrap_or(0));
            own.clear();
            own.resize(count[0] * count[1], f32::NAN);
            self.part(number)?.read([0, 1].map(|a| lo[a] - part.at[a]), count, &mut own)?;
            let skip = [0, 1].map(|a| usize::try_from(lo[a] - at[a]).unwrap_or(0));
            for (row, line) in own.chunks_exact(count[0]).enumerate() {
                let to = &mut out[(skip[1] + row) * size[0] + skip[0]..][..count[0]];
                for (to, from) in to.iter_mut().zip(line) {
                    if to.is_nan() {
                        *to = *from;
                    }
                }
            }
        }
        Ok(())
    }
}
