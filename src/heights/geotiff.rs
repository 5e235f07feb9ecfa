//! GeoTIFF: the first image of a TIFF or BigTIFF file, band 1, as elevation.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use tiff::decoder::{ChunkType, Decoder, Limits};
use tiff::tags::Tag;

use super::gdal_tags::{Nodata, metadata_zmap};
use super::geokeys::{self, GeoTags};
use super::raster::{Raster, ZMap};
use super::samples::{Block, place_block, place_sparse};
use super::tiff_patch::Patched;
use super::tiff_probe::{Probe, probe};
use super::{HeightError, HeightGrid, ReadOptions, alloc};

const FORMAT: &str = "GeoTIFF";
/// Largest block that is decoded at once, in bytes.
const MAX_BLOCK_BYTES: u64 = 1 << 30;

/// Reads the file. Undeclared void values are not guessed.
///
/// Errors: `Malformed`, `Unsupported`, `NotElevation`, `Rotated`, `AlreadyGeoreferenced`,
/// `TooSmall`, `TooLarge`, `OutOfMemory`, `Io`.
pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<HeightGrid, HeightError> {
    let io = |e| HeightError::io(path, e);
    let bad = |e: tiff::TiffError| HeightError::malformed(path, FORMAT, e);
    let mut file = BufReader::new(File::open(path).map_err(io)?);
    let file_bytes = file.get_ref().metadata().map_err(io)?.len();
    let layout = probe(&mut file).map_err(|e| HeightError::malformed(path, FORMAT, e))?;
    let dtype = check(path, &layout, options)?;

    std::io::Seek::rewind(&mut file).map_err(io)?;
    let mut decoder = decoder(file, &layout).map_err(bad)?;

    let tags = geo_tags(&mut decoder).map_err(bad)?;
    let placed = geokeys::place(path, &tags, layout.height)?;
    let nodata = match raw_tag(&mut decoder, Tag::GdalNodata, 256).map_err(bad)? {
        Some(text) => Nodata::parse(&text)
            .map_err(|text| HeightError::malformed(path, FORMAT, format!("nodata `{text}` is no number")))?,
        None => None,
    };
    let xml = raw_tag(&mut decoder, Tag::Unknown(42112), 1 << 20).map_err(bad)?;
    let (mut z, in_feet) = xml.map_or((ZMap::IDENTITY, false), |x| metadata_zmap(&x));
    if let Some(unit) = placed.vertical_unit_m
        && !in_feet
    {
        z = z.then(unit, 0.0);
    }

    let chunks = chunk_table(path, &mut decoder, file_bytes)?;
    let size = [layout.width, layout.height];
    let mut raster = Raster::new(path, size, z.then_options(options), options)?;
    let (chunk_width, chunk_height) = decoder.chunk_dimensions();
    let across = layout.width.div_ceil(u64::from(chunk_width).max(1)).max(1);
    let down = layout.height.div_ceil(u64::from(chunk_height).max(1));
    let stride = if layout.planar == 2 { 1 } else { layout.samples as usize };
    // Planar files store all blocks of band 1 first.
    for (index, chunk) in (0..across * down).zip(&chunks) {
        let number = index as u32;
        let (width, rows) = decoder.chunk_data_dimensions(number);
        let block = Block {
            col: ((index % across) * u64::from(chunk_width)) as usize,
            row: ((index / across) * u64::from(chunk_height)) as usize,
            width: width as usize,
            stride,
            north_up: placed.north_up,
        };
        if *chunk == Chunk::Sparse {
            if nodata.is_none() {
                place_sparse(&mut raster, block, rows as usize);
            }
            continue;
        }
        let data = decoder.read_chunk(number).map_err(|e| {
            HeightError::malformed(path, FORMAT, format!("block {number} does not decode: {e}"))
        })?;
        place_block(&mut raster, block, &data, nodata);
    }
    raster.finish(path, placed.placement, dtype, FORMAT, options)
}

/// Checks everything that can be told from the layout; gives the sample type's name.
pub(crate) fn check(path: &Path, p: &Probe, options: &ReadOptions) -> Result<&'static str, HeightError> {
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
    alloc::sample_count(&subject, p.width, p.height, options.max_samples)?;
    let tile = p.tile.unwrap_or([p.width, p.rows_per_strip.min(p.height)]);
    if tile.contains(&0) || p.samples == 0 {
        return malformed(format!("blocks of {tile:?} with {} samples", p.samples));
    }
    // The decoder multiplies these without a check.
    let blocks = p.width.div_ceil(tile[0]) * p.height.div_ceil(tile[1]);
    if blocks.saturating_mul(p.samples) > u64::from(u32::MAX) / 2 {
        return malformed(format!("{blocks} blocks for each of {} bands", p.samples));
    }
    let block_bytes =
        [tile[0], tile[1], p.samples, p.bits / 8].into_iter().try_fold(1_u64, |a, b| a.checked_mul(b));
    if block_bytes.is_none_or(|n| n > MAX_BLOCK_BYTES) {
        return unsupported(format!("blocks of {tile:?} samples (over 1 GiB)"));
    }
    Ok(dtype)
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

pub(crate) type Reader = Decoder<Patched<BufReader<File>>>;

/// A decoder of a rewound file, limited to blocks of 1 GiB.
pub(crate) fn decoder(file: BufReader<File>, layout: &Probe) -> Result<Reader, tiff::TiffError> {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_BLOCK_BYTES as usize;
    limits.intermediate_buffer_size = MAX_BLOCK_BYTES as usize;
    Ok(Decoder::new(Patched::new(file, layout))?.with_limits(limits))
}

/// The placement tags; a tag that is there but cannot be read is an error.
fn geo_tags(decoder: &mut Reader) -> Result<GeoTags, tiff::TiffError> {
    let mut doubles = |tag| -> Result<Vec<f64>, tiff::TiffError> {
        let value = decoder.find_tag(tag)?;
        Ok(value.map(|v| v.into_f64_vec()).transpose()?.unwrap_or_default())
    };
    Ok(GeoTags {
        scale: doubles(Tag::ModelPixelScaleTag)?,
        tiepoints: doubles(Tag::ModelTiepointTag)?,
        transform: doubles(Tag::ModelTransformationTag)?,
        doubles: doubles(Tag::GeoDoubleParamsTag)?,
        keys: decoder.find_tag_unsigned_vec(Tag::GeoKeyDirectoryTag)?.unwrap_or_default(),
    })
}

/// At most `limit` bytes of a text tag. Raw, because files in use lack the final zero byte or
/// hold bytes that are no UTF-8.
pub(crate) fn raw_tag(
    decoder: &mut Reader,
    tag: Tag,
    limit: usize,
) -> Result<Option<String>, tiff::TiffError> {
    let mut bytes = vec![0; limit];
    let found = decoder.image_ifd().find_tag_bytes(tag, &mut bytes, 0)?;
    Ok(found.map(|length| {
        bytes.truncate(length);
        String::from_utf8_lossy(&bytes).into_owned()
    }))
}

/// Whether a block is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Chunk {
    /// It is, within the file.
    Stored,
    /// Left out of the file.
    Sparse,
}

/// What is stored of every block. Refuses a block that lies outside the file, before any memory
/// is taken for the samples.
pub(crate) fn chunk_table(
    path: &Path,
    decoder: &mut Reader,
    file_bytes: u64,
) -> Result<Vec<Chunk>, HeightError> {
    let bad = |e: tiff::TiffError| HeightError::malformed(path, FORMAT, e);
    let (offsets, counts) = match decoder.get_chunk_type() {
        ChunkType::Strip => (Tag::StripOffsets, Tag::StripByteCounts),
        ChunkType::Tile => (Tag::TileOffsets, Tag::TileByteCounts),
    };
    let mut table = |tag| decoder.get_tag(tag).and_then(|v| v.into_u64_vec());
    let (offsets, counts) = (table(offsets).map_err(bad)?, table(counts).map_err(bad)?);
    let pairs = offsets.iter().zip(&counts).enumerate();
    pairs
        .map(|(i, pair)| match pair {
            // GDAL may leave an offset behind where nothing is stored.
            (_, 0) => Ok(Chunk::Sparse),
            (&at, &count) if at.checked_add(count).is_some_and(|end| end <= file_bytes) => Ok(Chunk::Stored),
            (at, count) => {
                let detail = format!(
                    "block {i} ({count} bytes at {at}) ends after the {file_bytes} bytes of the file"
                );
                Err(HeightError::malformed(path, FORMAT, detail))
            }
        })
        .collect()
}
