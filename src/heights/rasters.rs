//! Rasters that are read rectangle by rectangle, so that they may be larger than memory.

use super::geo::Georeference;
use super::raster::Located;
use super::{HeightError, HeightGrid};

/// What a raster is and where it lies; the same facts as in [`HeightGrid`], without samples.
#[derive(Clone, Debug)]
pub struct RasterHeader {
    /// Columns, 2 to `i32::MAX`.
    pub width: u64,
    /// Rows, 2 to `i32::MAX`.
    pub height: u64,
    /// Metres between samples, east and north, both positive.
    pub spacing_m: [f64; 2],
    /// Plane coordinates x, y in metres of the south-west sample.
    pub origin_m: [f64; 2],
    /// What the source says about its place.
    pub georeference: Georeference,
    /// Sample type of the source, as in [`HeightGrid`].
    pub dtype: &'static str,
    /// Format of the source, as in [`HeightGrid`].
    pub format: &'static str,
    /// True when heights are the raw values of the source: no scale, offset or unit is applied.
    pub raw: bool,
}

impl RasterHeader {
    /// The header of a raster whose blocks do not matter.
    pub(crate) fn new(
        [width, height]: [u64; 2],
        located: Located,
        dtype: &'static str,
        format: &'static str,
        raw: bool,
    ) -> Self {
        let Located { georeference, origin_m, spacing_m } = located;
        Self { width, height, spacing_m, origin_m, georeference, dtype, format, raw }
    }

    /// Refuses a rectangle that is not inside, or a buffer of another length (`Rectangle`).
    pub(crate) fn check(&self, at: [u64; 2], size: [usize; 2], got: usize) -> Result<(), HeightError> {
        let raster = [self.width, self.height];
        let inside = |i: usize| at[i].checked_add(size[i] as u64).is_some_and(|end| end <= raster[i]);
        if inside(0) && inside(1) && size[0].checked_mul(size[1]) == Some(got) {
            return Ok(());
        }
        Err(HeightError::Rectangle { at, size, got, raster })
    }
}

/// A raster read rectangle by rectangle. Row 0 = SOUTH, column 0 = WEST as in [`HeightGrid`].
///
/// Rectangles may be read from several threads at once. Values are those that
/// [`open_terrain`](super::open_terrain) gives for the same source.
pub trait RasterSource: Send + Sync {
    /// What the raster is and where it lies.
    fn header(&self) -> &RasterHeader;

    /// Fills `out` (`size[0] * size[1]` samples, row-major, its first row the southernmost of the
    /// rectangle) with metres; `f32::NAN` where void. The rectangle has its first column and row
    /// `at` and `size` columns and rows, inside the raster.
    ///
    /// What is in `out` after an error is not specified. Errors: `Rectangle`, `Malformed`, `Io`.
    fn read(&self, at: [u64; 2], size: [usize; 2], out: &mut [f32]) -> Result<(), HeightError>;

    /// Most rows of a band of rectangles, read from one end to the other before the next band, for
    /// which no block is decoded again and again; taller bands work, but may be very slow.
    fn band_rows(&self) -> u64 {
        u64::MAX
    }
}

/// A grid in memory as a [`RasterSource`].
#[derive(Clone, Debug)]
pub struct GridSource {
    header: RasterHeader,
    grid: HeightGrid,
}

impl GridSource {
    /// The source of all samples of a grid. Only a grid made in memory counts as raw: of a grid
    /// from elsewhere it is not known what was done to its heights.
    pub fn new(grid: HeightGrid) -> Self {
        let raw = grid.format == "memory";
        Self::with_raw(grid, raw)
    }

    pub(crate) fn with_raw(grid: HeightGrid, raw: bool) -> Self {
        let located = Located {
            georeference: grid.georeference.clone(),
            origin_m: grid.origin_m,
            spacing_m: grid.spacing_m,
        };
        let size = [grid.width as u64, grid.height as u64];
        Self { header: RasterHeader::new(size, located, grid.dtype, grid.format, raw), grid }
    }

    /// The grid.
    pub fn grid(&self) -> &HeightGrid {
        &self.grid
    }
}

impl RasterSource for GridSource {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, at: [u64; 2], size: [usize; 2], out: &mut [f32]) -> Result<(), HeightError> {
        self.header.check(at, size, out.len())?;
        let grid = &self.grid;
        for (row, line) in out.chunks_exact_mut(size[0].max(1)).enumerate() {
            let start = (at[1] as usize + row) * grid.width + at[0] as usize;
            let range = start..start + size[0];
            match grid.heights_m.get(range.clone()) {
                Some(heights) => line.copy_from_slice(heights),
                None => line.fill(f32::NAN),
            }
            let valid = grid.valid.as_ref().and_then(|v| v.get(range)).unwrap_or_default();
            for (height, _) in line.iter_mut().zip(valid).filter(|(_, valid)| !**valid) {
                *height = f32::NAN;
            }
        }
        Ok(())
    }
}
