//! GeoTIFF by rectangles: bare samples straight from the file, others through decoded blocks.

use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use tiff::decoder::DecodingResult;

use super::blocks::Blocks;
use super::cache::Cache;
use super::geotiff::{FORMAT, Opened, Reader, SPARSE, decode, decoder};
use super::in_place::InPlace;
use super::positioned::{FileCursor, Positioned};
use super::raster::ZMap;
use super::rasters::{RasterHeader, RasterSource};
use super::samples::{Rule, from_block};
use super::tiff_check::{MAX_WINDOW_BLOCK_BYTES, Purpose, in_place};
use super::tiff_probe::Probe;
use super::{HeightError, ReadOptions};

/// Most memory a source keeps between reads: decoded blocks, tables and decoders.
const KEPT_BYTES: u64 = 160 << 20;
/// The decoders among it, but always one.
const MOST_DECODER_BYTES: u64 = 24 << 20;
/// What keeping a block costs beyond its samples.
const ENTRY_BYTES: u64 = 256;

/// Opens the file for reading by rectangles; blocks are looked at only when they are needed.
///
/// Errors: those of [`Opened::new`], `AlreadyGeoreferenced`.
pub(crate) fn open(path: &Path, options: &ReadOptions) -> Result<Box<dyn RasterSource>, HeightError> {
    let opened = Opened::new(path, options, Purpose::Windows)?;
    let Opened { layout, dtype, placement, rule, blocks, chunks, all_chunks, stride, file, decoder } = opened;
    let located = placement.locate(path, layout.height, FORMAT, options)?;
    let raw = rule.z == ZMap::IDENTITY;
    let header = RasterHeader::new(blocks.size, located, dtype, FORMAT, raw);
    if (chunks.len() as u64) < blocks.count() {
        let detail = format!("{} blocks where {} are needed", chunks.len(), blocks.count());
        return Err(HeightError::malformed(path, FORMAT, detail));
    }
    let path = path.to_owned();
    if let Some(stored) = in_place(&layout) {
        let big_endian = layout.big_endian;
        return Ok(Box::new(InPlace {
            header,
            path,
            file,
            blocks,
            places: chunks,
            stored,
            big_endian,
            rule,
        }));
    }
    let block_rows = blocks.block[1].min(blocks.size[1]);
    let row_bytes = blocks.block[0].saturating_mul(stride as u64).saturating_mul(layout.bits / 8);
    let block_bytes = row_bytes.saturating_mul(block_rows);
    if block_bytes > MAX_WINDOW_BLOCK_BYTES {
        let detail = format!("blocks of {:?} samples (over 128 MiB)", blocks.block);
        return Err(HeightError::unsupported(&path, FORMAT, detail));
    }
    // A decoder has two tables of its own, and its buffers.
    let decoder_bytes = all_chunks as u64 * 16 + (1 << 18);
    let threads = std::thread::available_parallelism().map_or(4, usize::from) as u64;
    let decoders = (MOST_DECODER_BYTES / decoder_bytes).min(threads).max(1);
    let tables = chunks.len() as u64 * 8 + decoders * decoder_bytes;
    let cache_bytes = options.block_cache_bytes.min(KEPT_BYTES.saturating_sub(tables));

    let block_bytes = block_bytes + ENTRY_BYTES;
    let all_fits = block_bytes.saturating_mul(blocks.count()) <= cache_bytes;
    // Blocks of the columns that are being read, and of those that are begun.
    let fits = cache_bytes / row_bytes.max(1) / blocks.across().min(2);
    let fits = (fits / block_rows).saturating_sub(1).max(1) * block_rows;
    Ok(Box::new(Coded {
        header,
        blocks,
        chunks,
        stride,
        rule,
        block_bytes: block_bytes as usize,
        band_rows: if all_fits { u64::MAX } else { fits },
        cache: Cache::new(cache_bytes as usize),
        decoders: Decoders::new(file, layout, decoder, decoders as usize),
        path,
    }))
}

/// A file whose blocks have to be decoded.
struct Coded {
    header: RasterHeader,
    path: PathBuf,
    blocks: Blocks,
    /// Where in the file the blocks begin, or [`SPARSE`].
    chunks: Vec<u64>,
    stride: usize,
    rule: Rule,
    /// What a block costs in the cache.
    block_bytes: usize,
    band_rows: u64,
    cache: Cache<Decoded>,
    decoders: Decoders,
}

struct Decoded {
    data: DecodingResult,
    /// Columns.
    width: usize,
}

impl RasterSource for Coded {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, at: [u64; 2], size: [usize; 2], out: &mut [f32]) -> Result<(), HeightError> {
        self.header.check(at, size, out.len())?;
        for piece in self.blocks.pieces(at, size) {
            if self.chunks.get(piece.block).is_none_or(|&at| at == SPARSE) {
                for row in 0..piece.size[1] {
                    out[piece.target(row)].fill(self.rule.sparse());
                }
                continue;
            }
            let block = self.cache.get(piece.block, self.block_bytes, || self.decode(piece.block as u32))?;
            for row in 0..piece.size[1] {
                let start = (piece.first[1] + row) * block.width + piece.first[0];
                from_block(&block.data, start, self.stride, self.rule, &mut out[piece.target(row)]);
            }
        }
        Ok(())
    }

    fn band_rows(&self) -> u64 {
        self.band_rows
    }
}

impl Coded {
    fn decode(&self, number: u32) -> Result<Decoded, HeightError> {
        let decoded = self.decoders.with(|decoder| -> Result<Decoded, HeightError> {
            let data = decode(&self.path, decoder, number)?;
            Ok(Decoded { data, width: decoder.chunk_data_dimensions(number).0 as usize })
        });
        decoded.map_err(|e| HeightError::malformed(&self.path, FORMAT, e))?
    }
}

/// A few decoders of one file, each for one thread at a time.
struct Decoders {
    file: Arc<Positioned>,
    layout: Probe,
    most: usize,
    state: Mutex<Lent>,
    returned: Condvar,
}

struct Lent {
    idle: Vec<Reader>,
    lent: usize,
}

/// One of the decoders lent out; gives its place back even when decoding panics.
struct Place<'a>(&'a Decoders);

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.0.lock().lent -= 1;
        self.0.returned.notify_one();
    }
}

impl Decoders {
    fn new(file: Arc<Positioned>, layout: Probe, first: Reader, most: usize) -> Self {
        let state = Mutex::new(Lent { idle: vec![first], lent: 0 });
        Self { file, layout, most, state, returned: Condvar::new() }
    }

    /// Calls `use_it` with a decoder that nobody else uses.
    fn with<T>(&self, use_it: impl FnOnce(&mut Reader) -> T) -> Result<T, tiff::TiffError> {
        let mut state = self.lock();
        while state.lent >= self.most {
            state = self.returned.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.lent += 1;
        let idle = state.idle.pop();
        drop(state);
        let place = Place(self);
        let mut reader = match idle {
            Some(reader) => reader,
            None => {
                let file = BufReader::new(FileCursor::new(&self.file));
                decoder(file, &self.layout, MAX_WINDOW_BLOCK_BYTES)?
            }
        };
        let result = use_it(&mut reader);
        self.lock().idle.push(reader);
        drop(place);
        Ok(result)
    }

    fn lock(&self) -> MutexGuard<'_, Lent> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
