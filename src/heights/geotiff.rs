//! GeoTIFF: the first image of a TIFF or BigTIFF file, band 1, as elevation.

use std::io::{BufReader, Read, Seek};
use std::path::Path;
use std::sync::Arc;

use tiff::decoder::{ChunkType, Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

use super::blocks::Blocks;
use super::gdal_tags::{Nodata, metadata_zmap};
use super::geokeys::{self, GeoTags};
use super::positioned::{FileCursor, Positioned};
use super::raster::{Placement, Raster, ZMap};
use super::samples::{Rule, from_block};
use super::tiff_check::{MAX_BLOCK_BYTES, MAX_WINDOW_BLOCK_BYTES, Purpose, check};
use super::tiff_patch::Patched;
use super::tiff_probe::{Probe, probe};
use super::{HeightError, HeightGrid, ReadOptions};

pub(crate) const FORMAT: &str = "GeoTIFF";

/// A file whose tags are read and checked; what is left is to read its blocks.
pub(crate) struct Opened {
    pub(crate) layout: Probe,
    /// Name of the sample type.
    pub(crate) dtype: &'static str,
    pub(crate) placement: Placement,
    pub(crate) rule: Rule,
    pub(crate) blocks: Blocks,
    /// Where in the file the blocks of band 1 begin, or [`SPARSE`].
    pub(crate) chunks: Vec<u64>,
    /// Blocks of all bands.
    pub(crate) all_chunks: usize,
    /// Samples of a pixel in a block, of which the first counts.
    pub(crate) stride: usize,
    pub(crate) file: Arc<Positioned>,
    pub(crate) decoder: Reader,
}

impl Opened {
    /// Reads everything but the blocks. Undeclared void values are not guessed.
    ///
    /// Errors: `Malformed`, `Unsupported`, `NotElevation`, `Rotated`, `TooSmall`, `TooLarge`,
    /// `SideTooLong`, `Io`.
    pub(crate) fn new(path: &Path, options: &ReadOptions, purpose: Purpose) -> Result<Self, HeightError> {
        let bad = |e: tiff::TiffError| HeightError::malformed(path, FORMAT, e);
        let file = Arc::new(Positioned::open(path).map_err(|e| HeightError::io(path, e))?);
        let layout = probe(BufReader::new(FileCursor::new(&file)))
            .map_err(|e| HeightError::malformed(path, FORMAT, e))?;
        let dtype = check(path, &layout, purpose)?;
        let most = match purpose {
            Purpose::Whole { .. } => MAX_BLOCK_BYTES,
            Purpose::Windows => MAX_WINDOW_BLOCK_BYTES,
        };
        let mut decoder = decoder(BufReader::new(FileCursor::new(&file)), &layout, most).map_err(bad)?;

        let tags = geo_tags(&mut decoder).map_err(bad)?;
        let placed = geokeys::place(path, &tags, layout.height)?;
        let nodata = match raw_tag(&mut decoder, Tag::GdalNodata, 256).map_err(bad)? {
            Some(text) => Nodata::parse(&text).map_err(|text| {
                HeightError::malformed(path, FORMAT, format!("nodata `{text}` is no number"))
            })?,
            None => None,
        };
        let xml = raw_tag(&mut decoder, Tag::Unknown(42112), 1 << 20).map_err(bad)?;
        let (mut z, in_feet) = xml.map_or((ZMap::IDENTITY, false), |x| metadata_zmap(&x));
        if let Some(unit) = placed.vertical_unit_m
            && !in_feet
        {
            z = z.then(unit, 0.0);
        }

        let mut chunks = chunk_table(path, &mut decoder, file.length())?;
        let all_chunks = chunks.len();
        let (chunk_width, chunk_height) = decoder.chunk_dimensions();
        let blocks = Blocks {
            size: [layout.width, layout.height],
            block: [chunk_width, chunk_height].map(|n| u64::from(n).max(1)),
            north_up: placed.north_up,
        };
        // Planar files store all blocks of band 1 first.
        chunks.truncate(usize::try_from(blocks.count()).unwrap_or(usize::MAX));
        chunks.shrink_to_fit();
        Ok(Self {
            dtype,
            placement: placed.placement,
            rule: Rule { nodata, z: z.then_options(options) },
            blocks,
            chunks,
            all_chunks,
            stride: if layout.planar == 2 { 1 } else { layout.samples as usize },
            layout,
            file,
            decoder,
        })
    }
}

/// Reads the file.
///
/// Errors: those of [`Opened::new`], `AlreadyGeoreferenced`, `OutOfMemory`.
pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<HeightGrid, HeightError> {
    let purpose = Purpose::Whole { max_samples: options.max_samples };
    let mut opened = Opened::new(path, options, purpose)?;
    let Opened { rule, blocks, stride, .. } = opened;
    let mut raster = Raster::new(path, blocks.size, rule.z, options)?;
    let mut line = Vec::new();
    for (number, &at) in opened.chunks.iter().enumerate() {
        // All is void from the start, and memory that is never touched costs nothing.
        if at == SPARSE && rule.nodata.is_some() {
            continue;
        }
        let data = if at == SPARSE { None } else { Some(decode(path, &mut opened.decoder, number as u32)?) };
        let (width, rows) = opened.decoder.chunk_data_dimensions(number as u32);
        let (width, rows) = (width as usize, rows as usize);
        let [col, first_row] = blocks.first(number);
        line.resize(width.min(raster.width.saturating_sub(col)), 0.0);
        for i in 0..rows {
            let Some(row) = blocks.row_from_south(first_row + i) else {
                break;
            };
            match &data {
                Some(data) => from_block(data, i * width, stride, rule, &mut line),
                None => line.fill(rule.sparse()),
            }
            raster.put_row(row, col, &line);
        }
    }
    raster.finish(path, opened.placement, opened.dtype, FORMAT, options)
}

pub(crate) type Reader = Decoder<Patched<BufReader<FileCursor>>>;

/// A decoder of a file at its start, limited to blocks of so many bytes.
pub(crate) fn decoder<R: Read + Seek>(
    file: R,
    layout: &Probe,
    most_bytes: u64,
) -> Result<Decoder<Patched<R>>, tiff::TiffError> {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = most_bytes as usize;
    // Of encoded bytes, which are only counted.
    limits.intermediate_buffer_size = MAX_BLOCK_BYTES as usize;
    Ok(Decoder::new(Patched::new(file, layout))?.with_limits(limits))
}

/// The samples of a block.
pub(crate) fn decode(path: &Path, decoder: &mut Reader, number: u32) -> Result<DecodingResult, HeightError> {
    decoder
        .read_chunk(number)
        .map_err(|e| HeightError::malformed(path, FORMAT, format!("block {number} does not decode: {e}")))
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
pub(crate) fn raw_tag<R: Read + Seek>(
    decoder: &mut Decoder<R>,
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

/// Stands for the place of a block that is left out of the file.
pub(crate) const SPARSE: u64 = u64::MAX;

/// Where every block begins, or [`SPARSE`]. Refuses a block that lies outside the file, before any
/// memory is taken for the samples.
pub(crate) fn chunk_table<R: Read + Seek>(
    path: &Path,
    decoder: &mut Decoder<R>,
    file_bytes: u64,
) -> Result<Vec<u64>, HeightError> {
    let bad = |e: tiff::TiffError| HeightError::malformed(path, FORMAT, e);
    let (offsets, counts) = match decoder.get_chunk_type() {
        ChunkType::Strip => (Tag::StripOffsets, Tag::StripByteCounts),
        ChunkType::Tile => (Tag::TileOffsets, Tag::TileByteCounts),
    };
    let mut table = |tag| decoder.get_tag(tag).and_then(|v| v.into_u64_vec());
    let (mut places, counts) = (table(offsets).map_err(bad)?, table(counts).map_err(bad)?);
    places.truncate(counts.len());
    for (i, (at, count)) in places.iter_mut().zip(counts).enumerate() {
        if count == 0 {
            // GDAL may leave an offset behind where nothing is stored.
            *at = SPARSE;
        } else if at.checked_add(count).is_none_or(|end| end > file_bytes) {
            let detail =
                format!("block {i} ({count} bytes at {at}) ends after the {file_bytes} bytes of the file");
            return Err(HeightError::malformed(path, FORMAT, detail));
        }
    }
    Ok(places)
}
