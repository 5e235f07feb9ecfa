//! What can be told from the layout of a TIFF alone: whether it is elevation that can be read.

use std::path::Path;

use super::samples::Stored;
use super::tiff_probe::Probe;
use super::{HeightError, alloc};

const FORMAT: &str = "GeoTIFF";
/// Largest block that is decoded at once, in bytes.
pub(crate) const MAX_BLOCK_BYTES: u64 = 1 << 30;
/// The same while reading in windows, where several may be needed at once.
pub(crate) const MAX_WINDOW_BLOCK_BYTES: u64 = 128 << 20;
/// Most blocks of a file read in windows: the decoder needs 16 bytes for each, and several times that
/// while it opens the file.
const MAX_WINDOW_BLOCKS: u64 = 1 << 22;

/// What a file is opened for, which decides how large it may be.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Purpose {
    /// To be held in memory, up to so many samples.
    Whole { max_samples: u64 },
    /// To be read in windows.
    Windows,
}

/// Checks everything that can be told from the layout; gives the sample type's name.
pub(crate) fn check(path: &Path, p: &Probe, purpose: Purpose) -> Result<&'static str, HeightError> {
    let unsupported = |detail: String| Err(HeightError::unsupported(path, FORMAT, detail));
    let malformed = |detail: String| Err(HeightError::malformed(path, FORMAT, detail));
    match p.photometric {
        Some(1) => {}
        Some(0) => return unsupported("grey that counts from white".to_owned()),
        Some(2) => return not_elevation(path, p, "RGB"),
        Some(3) => return not_elevation(path, p, "palette"),
        Some(4) => return not_elevation(path, p, "mask"),
        Some(5) => return not_elevation(path, p, "CMYK"),
        Some(6) => return not_elevation(path, p, "YCbCr"),
        Some(n) => return unsupported(format!("photometric interpretation {n}")),
        None => return malformed("tag 262 (photometric interpretation) is missing".to_owned()),
    }
    if let Some(name) = unsupported_compression(p.compression) {
        return unsupported(format!("{name} compression"));
    }
    let dtype = match (p.sample_format, p.bits) {
        (1, 8) => "byte",
        (1, 16) => "uint16",
        (1, 32) => "uint32",
        (1, 64) => "uint64",
        (2, 8) => "int8",
        (2, 16) => "int16",
        (2, 32) => "int32",
        (2, 64) => "int64",
        (3, 16) => "float16",
        (3, 32) => "float32",
        (3, 64) => "float64",
        (1, n) => return unsupported(format!("{n}-bit unsigned samples")),
        (2, n) => return unsupported(format!("{n}-bit signed samples")),
        (3, n) => return unsupported(format!("{n}-bit float samples")),
        (f, n) => return unsupported(format!("{n}-bit samples of format {f}")),
    };
    if !(1..=3).contains(&p.predictor) {
        return unsupported(format!("predictor {}", p.predictor));
    }
    let subject = path.display().to_string();
    match purpose {
        Purpose::Whole { max_samples } => {
            alloc::sample_count(&subject, p.width, p.height, max_samples)?;
        }
        Purpose::Windows => alloc::sides(&subject, p.width, p.height)?,
    }
    let tile = p.tile.unwrap_or([p.width, p.rows_per_strip.min(p.height)]);
    if tile.contains(&0) || p.samples == 0 {
        return malformed(format!("blocks of {tile:?} with {} samples", p.samples));
    }
    // The decoder multiplies these without a check.
    let blocks = p.width.div_ceil(tile[0]) * p.height.div_ceil(tile[1]);
    if blocks.saturating_mul(p.samples) > u64::from(u32::MAX) / 2 {
        return malformed(format!("{blocks} blocks for each of {} bands", p.samples));
    }
    let planes = if p.planar == 2 { p.samples } else { 1 };
    if matches!(purpose, Purpose::Windows) && blocks * planes > MAX_WINDOW_BLOCKS {
        return unsupported(format!("{} blocks (over {MAX_WINDOW_BLOCKS})", blocks * planes));
    }
    let (most, name) = match purpose {
        Purpose::Whole { .. } => (MAX_BLOCK_BYTES, "1 GiB"),
        // Only the rows asked for are ever read.
        Purpose::Windows if in_place(p).is_some() => (u64::MAX, "16 EiB"),
        Purpose::Windows => (MAX_WINDOW_BLOCK_BYTES, "128 MiB"),
    };
    let block_bytes =
        [tile[0], tile[1], p.samples, p.bits / 8].into_iter().try_fold(1_u64, |a, b| a.checked_mul(b));
    if block_bytes.is_none_or(|n| n > most) {
        return unsupported(format!("blocks of {tile:?} samples (over {name})"));
    }
    Ok(dtype)
}

/// The sample type, if band 1 lies in the file just as it is, without gaps between its samples.
pub(crate) fn in_place(p: &Probe) -> Option<Stored> {
    let bare = p.compression == 1 && p.predictor == 1 && (p.samples == 1 || p.planar == 2);
    Stored::new(p.sample_format, p.bits).filter(|_| bare)
}

fn not_elevation<T>(path: &Path, p: &Probe, kind: &str) -> Result<T, HeightError> {
    Err(HeightError::NotElevation { path: path.to_owned(), detail: format!("{}-bit {kind}", p.bits) })
}

/// The name of a compression that cannot be decoded; `None` for none, LZW, deflate, zstd and
/// PackBits.
fn unsupported_compression(code: u64) -> Option<String> {
    let name = match code {
        1 | 5 | 8 | 32773 | 32946 | 50000 => return None,
        2..=4 => "CCITT fax",
        6 | 7 => "JPEG",
        34712 => "JPEG 2000",
        34887 => "LERC",
        34925 => "LZMA",
        50001 => "WebP",
        50002 | 52546 => "JPEG XL",
        other => return Some(format!("unknown (code {other})")),
    };
    Some(name.to_owned())
}
