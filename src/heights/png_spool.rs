//! Grey PNG by rectangles. The format can only be read from its start, so rasters that are not small
//! are laid down as bare samples in a temporary file first.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;

use super::blocks::Blocks;
use super::gdal_tags::Nodata;
use super::in_place::InPlace;
use super::png::{self, FORMAT, Head};
use super::positioned::Positioned;
use super::raster::ZMap;
use super::rasters::{GridSource, RasterHeader, RasterSource};
use super::samples::{Rule, Stored};
use super::{HeightError, ReadOptions, alloc};

/// Most samples held in memory.
const HELD_SAMPLES: u64 = 1 << 24;
/// Longest row; the decoder needs several of them.
const MAX_ROW_BYTES: usize = 16 << 20;
/// Memory of the decoder for rows and for chunks other than pixels.
const DECODER_BYTES: usize = 64 << 20;
/// Rows are written in pieces of this size.
const PIECE_BYTES: usize = 1 << 20;
/// Deflate cannot pack more bytes into one.
const MOST_PACKED: u64 = 1032;
/// First column, step, first row and step of the passes of an interlaced file.
const PASSES: [[usize; 4]; 7] =
    [[0, 8, 0, 8], [4, 8, 0, 8], [0, 4, 4, 8], [2, 4, 0, 4], [0, 2, 2, 4], [1, 2, 0, 2], [0, 1, 1, 2]];

type Reader = ::png::Reader<BufReader<File>>;

/// Opens the file for reading by rectangles.
///
/// Errors: those of [`png::read`] for small rasters; for others those of [`png::head`],
/// `SideTooLong`, `TooSmall`, `Temporary`.
pub(crate) fn open(path: &Path, options: &ReadOptions) -> Result<Box<dyn RasterSource>, HeightError> {
    let mut file = File::open(path).map_err(|e| HeightError::io(path, e))?;
    let head = png::head(path, &mut file)?;
    let z = ZMap::IDENTITY.then_options(options);
    let raw = z == ZMap::IDENTITY;
    let size = head.size.map(u64::from);
    if size[0] * size[1] <= HELD_SAMPLES.min(options.max_samples) {
        // The limit is on the decoder's memory as well.
        let held = ReadOptions { max_samples: HELD_SAMPLES, ..options.clone() };
        return Ok(Box::new(GridSource::with_raw(png::read(path, &held)?, raw)));
    }
    alloc::sides(&path.display().to_string(), size[0], size[1])?;
    let located = png::placement().locate(path, size[1], FORMAT, options)?;
    let (file, void) = spool(path, file, &head)?;
    let nodata = void.map(|grey| Nodata { integer: Some(i128::from(grey)), float: f64::from(grey) });
    Ok(Box::new(InPlace {
        header: RasterHeader::new(size, located, head.dtype, FORMAT, raw),
        path: path.to_owned(),
        file: Arc::new(file),
        blocks: Blocks::whole(size),
        places: vec![0],
        stored: if head.sample_bytes == 1 { Stored::U8 } else { Stored::U16 },
        big_endian: true,
        rule: Rule { nodata, z },
    }))
}

/// All samples in a temporary file, rows from north to south, and the transparent grey (tRNS).
fn spool(path: &Path, file: File, head: &Head) -> Result<(Positioned, Option<u16>), HeightError> {
    let malformed = |detail: &str| HeightError::malformed(path, FORMAT, detail);
    let bad = |e: ::png::DecodingError| HeightError::malformed(path, FORMAT, e);
    let [width, height] = head.size;
    let row_bytes = width as usize * head.sample_bytes;
    let bytes = row_bytes as u64 * u64::from(height);
    if row_bytes > MAX_ROW_BYTES {
        return Err(HeightError::unsupported(
            path,
            FORMAT,
            format!("rows of {row_bytes} bytes (over 16 MiB)"),
        ));
    }
    let packed = file.metadata().map_err(|e| HeightError::io(path, e))?.len();
    if bytes / MOST_PACKED > packed {
        let detail = format!("{width} x {height} samples in {packed} bytes");
        return Err(malformed(&detail));
    }
    let limits = ::png::Limits { bytes: DECODER_BYTES };
    let mut decoder = ::png::Decoder::new_with_limits(BufReader::new(file), limits);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(bad)?;
    let info = reader.info();
    // An animation may begin with a smaller picture.
    let frame = info.frame_control.as_ref().map_or(head.size, |f| [f.width, f.height]);
    let depth = info.bit_depth as usize;
    let same = [info.width, info.height] == head.size && frame == head.size;
    if !same || info.interlaced != head.interlaced || depth != 8 * head.sample_bytes {
        return Err(malformed("inconsistent size"));
    }
    let void = match info.trns.as_deref() {
        Some(&[grey]) => Some(u16::from(grey)),
        Some(&[high, low]) => Some(u16::from_be_bytes([high, low])),
        _ => None,
    };
    let to = Positioned::temporary(bytes)?;
    let mut row = vec![0_u8; row_bytes];
    if head.interlaced {
        interlaced(path, &mut reader, &to, head)?;
    } else {
        let (mut pending, mut written) = (Vec::with_capacity(PIECE_BYTES + row_bytes), 0);
        for y in 0..height {
            reader.read_row(&mut row).map_err(bad)?;
            pending.extend_from_slice(&row);
            if pending.len() >= PIECE_BYTES || y + 1 == height {
                to.write_all_at(&pending, written)?;
                written += pending.len() as u64;
                pending.clear();
            }
        }
    }
    // Past the last row, where the end of the pixels is checked.
    reader.read_row(&mut row).map_err(bad)?;
    Ok((to, void))
}

/// Puts the rows of all passes into a file of zeros.
fn interlaced(path: &Path, reader: &mut Reader, to: &Positioned, head: &Head) -> Result<(), HeightError> {
    let [width, height] = head.size.map(|n| n as usize);
    let row_bytes = width * head.sample_bytes;
    let (mut line, mut row) = (vec![0_u8; row_bytes], vec![0_u8; row_bytes]);
    for [first_col, col_step, first_row, row_step] in PASSES {
        // A pass without columns has no rows either.
        if first_col >= width {
            continue;
        }
        for y in (first_row..height).step_by(row_step) {
            reader.read_row(&mut line).map_err(|e| HeightError::malformed(path, FORMAT, e))?;
            let at = y as u64 * row_bytes as u64;
            to.read_exact_at(&mut row, at).map_err(|e| HeightError::io(path, e))?;
            let samples = row.chunks_exact_mut(head.sample_bytes).skip(first_col).step_by(col_step);
            for (sample, new) in samples.zip(line.chunks_exact(head.sample_bytes)) {
                sample.copy_from_slice(new);
            }
            to.write_all_at(&row, at)?;
        }
    }
    Ok(())
}
