//! Positions from a TIFF or BigTIFF file: three bands of floats, x, y and z in metres.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Seek};
use std::path::Path;

use tiff::decoder::DecodingResult;
use tiff::tags::Tag;

use super::gdal_tags::Nodata;
use super::geotiff::{SPARSE, chunk_table, decoder, raw_tag};
use super::positions::{MAX_NODES, PositionGrid};
use super::tiff_check::{MAX_BLOCK_BYTES, Purpose, check};
use super::tiff_probe::{Probe, probe};
use super::{HeightError, alloc};

const FORMAT: &str = "TIFF of positions";
/// x, y and z.
const BANDS: usize = 3;

/// Whether the file is a TIFF whose first image has three bands of 32- or 64-bit floats, as
/// [`PositionGrid::read`] wants them.
///
/// Only the directory is read. False for everything else, also for files that cannot be read; the
/// reader that is chosen then says why.
#[must_use]
pub fn is_position_file(path: &Path) -> bool {
    File::open(path).ok().and_then(|f| probe(BufReader::new(f)).ok()).is_some_and(|p| has_positions(&p))
}

fn has_positions(p: &Probe) -> bool {
    p.samples == BANDS as u64 && p.sample_format == 3 && matches!(p.bits, 32 | 64)
}

impl PositionGrid {
    /// Reads a TIFF of three float bands (x, y, z in world metres), chunky or planar, in strips or
    /// tiles, of at most 8193 x 8193 nodes. Row 0 of the file becomes the last row of the grid.
    ///
    /// Nodes are void where any band is not finite or has the declared nodata value, and in blocks
    /// that the file leaves out. Georeferencing tags mean nothing here and are not read.
    ///
    /// Errors: `NotFound`, `NotAFile`, `Empty`, `Io`, `NotPositions`, `Malformed`, `Unsupported`,
    /// `TooSmall`, `TooLarge`, `OutOfMemory`, `FarPosition`.
    pub fn read(path: &Path) -> Result<Self, HeightError> {
        let io = |e: std::io::Error| match e.kind() {
            ErrorKind::NotFound => HeightError::NotFound { path: path.to_owned() },
            _ => HeightError::io(path, e),
        };
        let malformed = |e: &dyn ToString| HeightError::malformed(path, FORMAT, e.to_string());
        let metadata = std::fs::metadata(path).map_err(io)?;
        if !metadata.is_file() {
            return Err(HeightError::NotAFile { path: path.to_owned() });
        }
        if metadata.len() == 0 {
            return Err(HeightError::Empty { path: path.to_owned() });
        }
        let mut file = BufReader::new(File::open(path).map_err(io)?);
        let layout = probe(&mut file).map_err(|e| malformed(&e))?;
        if !has_positions(&layout) {
            let (samples, bits) = (layout.samples, layout.bits);
            let detail = format!("{samples} bands of {bits}-bit samples, format {}", layout.sample_format);
            return Err(HeightError::NotPositions { path: path.to_owned(), detail });
        }
        // Three floats are no colours, though writers tend to call them RGB.
        let photometric = if layout.photometric == Some(2) { Some(1) } else { layout.photometric };
        let purpose = Purpose::Whole { max_samples: MAX_NODES };
        check(path, &Probe { photometric, ..layout.clone() }, purpose)?;
        file.rewind().map_err(io)?;
        let mut decoder = decoder(file, &layout, MAX_BLOCK_BYTES).map_err(|e| malformed(&e))?;
        let nodata = match raw_tag(&mut decoder, Tag::GdalNodata, 256).map_err(|e| malformed(&e))? {
            Some(text) => {
                Nodata::parse(&text).map_err(|text| malformed(&format!("nodata `{text}` is no number")))?
            }
            None => None,
        };
        let chunks = chunk_table(path, &mut decoder, metadata.len())?;

        let subject = path.display().to_string();
        let count = alloc::sample_count(&subject, layout.width, layout.height, MAX_NODES)?;
        let (width, height) = (layout.width as usize, layout.height as usize);
        let mut nodes: Vec<[f64; BANDS]> = alloc::zeroed(&subject, count)?;
        // A band that is never stored stays NaN, and its node void.
        nodes.fill([f64::NAN; BANDS]);
        let (chunk_width, chunk_height) = decoder.chunk_dimensions();
        let (chunk_width, chunk_height) = (chunk_width.max(1) as usize, chunk_height.max(1) as usize);
        let across = width.div_ceil(chunk_width);
        let plane = across * height.div_ceil(chunk_height);
        let planes = if layout.planar == 2 { BANDS } else { 1 };
        if chunks.len() < plane * planes {
            return Err(malformed(&format!("{} blocks where {} are needed", chunks.len(), plane * planes)));
        }
        for (number, chunk) in chunks.iter().enumerate().take(plane * planes) {
            if *chunk == SPARSE {
                continue;
            }
            let data = decoder
                .read_chunk(number as u32)
                .map_err(|e| malformed(&format!("block {number} does not decode: {e}")))?;
            let (data_width, _) = decoder.chunk_data_dimensions(number as u32);
            let place = Place {
                width,
                height,
                col: number % plane % across * chunk_width,
                row: number % plane / across * chunk_height,
                data_width: data_width as usize,
                band: number / plane,
                bands: BANDS / planes,
            };
            match data {
                DecodingResult::F32(v) => {
                    let void = nodata.map(|n| n.float as f32);
                    let value = |s: f32| if Some(s) == void { f64::NAN } else { f64::from(s) };
                    place.put(&mut nodes, v.into_iter().map(value));
                }
                DecodingResult::F64(v) => {
                    let void = nodata.map(|n| n.float);
                    place.put(&mut nodes, v.into_iter().map(|s| if Some(s) == void { f64::NAN } else { s }));
                }
                _ => return Err(malformed(&format!("block {number} holds no floats"))),
            }
        }
        Self::checked(&subject, width, height, nodes)
    }
}

/// Where the samples of one decoded block go.
struct Place {
    /// Columns of the grid.
    width: usize,
    /// Rows of the grid.
    height: usize,
    /// First column of the block.
    col: usize,
    /// First row of the block, counted as in the file.
    row: usize,
    /// Columns of the block.
    data_width: usize,
    /// First band in the block.
    band: usize,
    /// Bands in the block, interleaved.
    bands: usize,
}

impl Place {
    /// Stores the samples, flipping rows; drops what reaches over the edges of the image.
    fn put(&self, nodes: &mut [[f64; BANDS]], samples: impl Iterator<Item = f64>) {
        for (i, sample) in samples.enumerate() {
            let (pixel, band) = (i / self.bands, self.band + i % self.bands);
            let row = self.row + pixel / self.data_width.max(1);
            let col = self.col + pixel % self.data_width.max(1);
            if row >= self.height {
                return;
            }
            if col < self.width
                && let Some(node) = nodes.get_mut((self.height - 1 - row) * self.width + col)
            {
                node[band] = sample;
            }
        }
    }
}
