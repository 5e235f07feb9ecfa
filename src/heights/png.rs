//! Grey PNG height fields: raw values, no georeference.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use image::codecs::png::PngDecoder;
use image::{ColorType, ImageDecoder, Limits};

use super::raster::{Placement, Raster, ZMap};
use super::{HeightError, HeightGrid, ReadOptions, alloc};

pub(crate) const FORMAT: &str = "PNG";

/// What the first bytes of a file say.
pub(crate) struct Head {
    pub(crate) size: [u32; 2],
    /// 1 or 2.
    pub(crate) sample_bytes: usize,
    /// Name of the sample type.
    pub(crate) dtype: &'static str,
    pub(crate) interlaced: bool,
}

/// Reads the header of an 8 or 16 bit grey PNG, and stands at the start of the file again.
///
/// Errors: `NotElevation` for colour and alpha, `Unsupported` under 8 bits, `Malformed`, `Io`.
pub(crate) fn head(path: &Path, file: &mut File) -> Result<Head, HeightError> {
    // The decoder widens everything to at least 8 bits and hides what it was, so the header is
    // looked at here: columns and rows are 4 bytes each from byte 16 on, bit depth and colour type
    // bytes 24 and 25, and byte 28 tells whether rows are interlaced.
    let mut header = [0_u8; 29];
    file.read_exact(&mut header)
        .map_err(|_| HeightError::malformed(path, FORMAT, "cut off in the header"))?;
    file.rewind().map_err(|e| HeightError::io(path, e))?;
    let (dtype, sample_bytes) = match (header[25], header[24]) {
        (0, 8) => ("byte", 1),
        (0, 16) => ("uint16", 2),
        (0, depth @ (1 | 2 | 4)) => {
            return Err(HeightError::Unsupported {
                path: path.to_owned(),
                format: FORMAT,
                detail: format!("{depth}-bit grey"),
                advice: "export it with 8 or 16 bits",
            });
        }
        (colour, depth) => {
            let kind = match colour {
                2 => "RGB",
                3 => "palette",
                4 => "grey with alpha",
                6 => "RGBA",
                _ => return Err(HeightError::malformed(path, FORMAT, "unknown colour type")),
            };
            return Err(HeightError::NotElevation {
                path: path.to_owned(),
                detail: format!("{depth}-bit {kind}"),
            });
        }
    };
    let side = |at: usize| header[at..at + 4].iter().fold(0_u32, |n, &byte| n << 8 | u32::from(byte));
    Ok(Head { size: [side(16), side(20)], sample_bytes, dtype, interlaced: header[28] != 0 })
}

/// Where such files lie: they do not say.
pub(crate) fn placement() -> Placement {
    Placement::Unknown { crs: None, pixel_is_point: true }
}

/// Reads an 8 or 16 bit grey PNG; a sample of the transparent grey (tRNS) is void.
///
/// Errors: those of [`head`], `TooSmall`, `TooLarge`, `OutOfMemory`.
pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<HeightGrid, HeightError> {
    let bad = |e: image::ImageError| HeightError::malformed(path, FORMAT, e);
    let mut file = File::open(path).map_err(|e| HeightError::io(path, e))?;
    let dtype = head(path, &mut file)?.dtype;
    let mut limits = Limits::no_limits();
    // Rows and text chunks only: the pixels go into a buffer of ours.
    limits.max_alloc = Some(options.max_samples.saturating_mul(8).max(1 << 20));
    let decoder = PngDecoder::with_limits(BufReader::new(file), limits).map_err(bad)?;
    let (width, height) = decoder.dimensions();
    let size = [u64::from(width), u64::from(height)];
    let (sample_bytes, channels) = match decoder.color_type() {
        ColorType::L8 => (1, 1),
        ColorType::L16 => (2, 1),
        ColorType::La8 => (1, 2),
        ColorType::La16 => (2, 2),
        other => {
            let detail = format!("grey decodes as {other:?}");
            return Err(HeightError::unsupported(path, FORMAT, detail));
        }
    };
    let z = ZMap::IDENTITY.then_options(options);
    let mut raster = Raster::new(path, size, z, options)?;
    let pixel = sample_bytes * channels;
    let count = raster.width * raster.height;
    let mut bytes: Vec<u8> = alloc::zeroed(&path.display().to_string(), count * pixel)?;
    if decoder.total_bytes() != bytes.len() as u64 {
        return Err(HeightError::malformed(path, FORMAT, "inconsistent size"));
    }
    decoder.read_image(&mut bytes).map_err(bad)?;
    let sample = |at: &[u8]| match *at {
        [a, b] => f64::from(u16::from_ne_bytes([a, b])),
        [a] => f64::from(a),
        _ => 0.0,
    };
    for (i, texel) in bytes.chunks_exact(pixel).enumerate() {
        let (grey, alpha) = texel.split_at(sample_bytes);
        if alpha.is_empty() || sample(alpha) > 0.0 {
            let row = raster.height - 1 - i / raster.width;
            raster.put(row, i % raster.width, sample(grey));
        }
    }
    raster.finish(path, placement(), dtype, FORMAT, options)
}
