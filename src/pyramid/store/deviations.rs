//! Deviations of blocks in a store: one array of u16 a level, [block rows, block columns, ranks].
//!
//! Rows count from the south, as blocks do: a level's northernmost block may be cut off, so that blocks counted
//! from the north would not line up with those of the finer levels under them. Chunks are 256 x 256 blocks (or all
//! there are), so that levels of 65,537 x 65,537 samples come in some 340 files.

use std::num::NonZeroU64;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use serde_json::json;
use zarrs::array::codec::{BytesCodec, Crc32cCodec};
use zarrs::array::{ArrayBuilder, ArrayToBytesCodecTraits as _, CodecChain, FillValue, data_type};

use super::Store;
use super::codec::{blosc, check_frame, one_thread};
use super::error::StoreError;
use super::level::Level;
use crate::pyramid::deviations::{Below, Samples, Surfaces};
use crate::pyramid::{BLOCK_CELLS, BlockDeviation, Deviations, FIGURES, MemoryPyramid};

/// Most blocks along a side of a chunk.
const CHUNK: usize = 256;
/// Most bytes of figures held in memory: those of 65,537 x 65,537 samples are 403 MB.
const MOST_BYTES: u64 = 448 << 20;
/// Chunks read at a time; over a network they are waited for.
const READERS: usize = 8;

/// How the blocks of a level are cut into chunks; columns before rows, unlike in the array's shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    level: u32,
    /// Blocks east and north.
    pub blocks: [usize; 2],
    /// Blocks of a whole chunk; the last ones are filled up.
    pub chunk: [usize; 2],
}

impl Layout {
    pub fn of(level: Level) -> Self {
        let cells = level.size.map(|s| usize::try_from(s.saturating_sub(1)).unwrap_or(usize::MAX));
        let blocks = cells.map(|n| n.div_ceil(BLOCK_CELLS as usize).max(1));
        Self { level: level.number, blocks, chunk: blocks.map(|n| n.min(CHUNK)) }
    }

    /// Chunks east and north.
    pub fn chunks(self) -> [usize; 2] {
        [0, 1].map(|a: usize| self.blocks[a].div_ceil(self.chunk[a]))
    }

    /// Every chunk, row by row from the south-west.
    pub fn places(self) -> impl Iterator<Item = [usize; 2]> {
        let [across, down] = self.chunks();
        (0..down).flat_map(move |y| (0..across).map(move |x| [x, y]))
    }

    /// First block of a chunk, and the first beyond it.
    pub fn part(self, place: [usize; 2]) -> [[usize; 2]; 2] {
        let from = [0, 1].map(|a: usize| place[a] * self.chunk[a]);
        [from, [0, 1].map(|a: usize| (from[a] + self.chunk[a]).min(self.blocks[a]))]
    }

    fn header_file(self) -> String {
        format!("{}/deviations/zarr.json", self.level)
    }

    fn file(self, [x, y]: [usize; 2]) -> String {
        format!("{}/deviations/c/{y}/{x}/0", self.level)
    }

    fn chunk_bytes(self) -> u64 {
        (self.chunk[0] * self.chunk[1] * size_of::<BlockDeviation>()) as u64
    }

    /// Bytes of all figures of the level.
    fn bytes(self) -> u64 {
        self.blocks.iter().fold(size_of::<BlockDeviation>() as u64, |all, n| all.saturating_mul(*n as u64))
    }

    /// The array.
    ///
    /// # Errors
    /// In the library's words.
    pub fn array(self) -> Result<ArrayBuilder, String> {
        let shape = |size: [usize; 2]| vec![size[1] as u64, size[0] as u64, FIGURES as u64];
        let (blocks, chunk) = (shape(self.blocks), shape(self.chunk));
        let mut builder = ArrayBuilder::new(blocks, chunk, data_type::uint16(), unknown());
        let crc = Arc::new(Crc32cCodec::new());
        builder
            .dimension_names(["block_row", "block_column", "rank"].into())
            .array_to_bytes_codec(Arc::new(BytesCodec::little()))
            // By whole blocks: the same rank's bytes side by side.
            .bytes_to_bytes_codecs(vec![blosc(size_of::<BlockDeviation>())?, crc]);
        let attributes = builder.attributes_mut();
        attributes.insert("rows".into(), json!("from the south"));
        attributes.insert("block_cells".into(), json!(BLOCK_CELLS));
        attributes.insert("ranks".into(), json!([0, 1, 2, 3, 4, 5, 6, 7, 8]));
        let encoding = "upper 16 bits of a float32 in metres, rounded up; 32639 is unknown";
        attributes.insert("encoding".into(), json!(encoding));
        Ok(builder)
    }

    /// The blocks of a whole chunk.
    fn decode(self, encoded: &[u8]) -> Result<Vec<BlockDeviation>, String> {
        check_frame(encoded, self.chunk_bytes())?;
        let crc = Arc::new(Crc32cCodec::new());
        let bytes = Arc::new(BytesCodec::little());
        let chain = CodecChain::new(vec![], bytes, vec![blosc(size_of::<BlockDeviation>())?, crc]);
        let shape = [self.chunk[1], self.chunk[0], FIGURES].map(|n| NonZeroU64::new(n as u64));
        let shape: Vec<NonZeroU64> = shape.into_iter().flatten().collect();
        let bytes = chain
            .decode(encoded.into(), &shape, &data_type::uint16(), &unknown(), &one_thread())
            .and_then(|b| b.into_fixed().map_err(Into::into))
            .map_err(|e| e.to_string())?;
        if bytes.len() as u64 != self.chunk_bytes() {
            return Err(format!("{} bytes decoded, {} expected", bytes.len(), self.chunk_bytes()));
        }
        let bits: Vec<u16> = bytemuck::pod_collect_to_vec(&bytes);
        let blocks = bits.as_chunks::<FIGURES>().0.iter().map(|b| BlockDeviation::from_bits(*b));
        blocks.collect::<Option<_>>().ok_or_else(|| "a figure is no distance".into())
    }
}

fn unknown() -> FillValue {
    FillValue::from(BlockDeviation::UNKNOWN.bits()[0])
}

impl Store {
    /// True when it holds the deviations of its blocks. Those made before version 2 of the layout have none,
    /// those of version 2 have others, which are not looked at.
    #[must_use]
    pub fn has_deviations(&self) -> bool {
        self.manifest().has_deviations()
    }

    /// Files that a store with any deviation must have.
    pub(super) fn deviation_files(&self) -> Vec<String> {
        let levels = if self.has_deviations() { self.levels() } else { &[] };
        let files = levels.iter().map(|l| Layout::of(*l)).flat_map(|layout| {
            std::iter::once(layout.header_file()).chain(layout.places().map(move |place| layout.file(place)))
        });
        files.collect()
    }

    /// Deviations of all levels, those above the stored ones measured here from the samples of `top`, the stored
    /// top level. `None` when the store has none. Waits for the disk.
    ///
    /// # Errors
    /// The first file that cannot be read or is damaged.
    pub(crate) fn deviations(&self, top: &MemoryPyramid) -> Result<Option<Deviations>, StoreError> {
        if !self.has_deviations() {
            return Ok(None);
        }
        let (mut room, mut left_out) = (MOST_BYTES, 0_u64);
        let mut levels = Vec::new();
        for layout in self.levels().iter().rev().map(|l| Layout::of(*l)) {
            if let (Some(rest), 0) = (room.checked_sub(layout.bytes()), left_out) {
                room = rest;
                levels.push(self.read_level(layout)?);
            } else {
                left_out = left_out.saturating_add(layout.bytes());
                levels.push(Vec::new());
            }
        }
        levels.reverse();
        if left_out > 0 {
            log::warn!(
                "{}: {} MB of deviations are not held in memory: nothing is left out of the finest levels",
                self.at(),
                left_out >> 20
            );
        }
        self.measure_above(top, &mut levels);
        Ok(Some(Deviations::from_levels(self.lattice(), levels)))
    }

    /// Appends the levels above the stored top.
    fn measure_above(&self, top: &MemoryPyramid, levels: &mut Vec<Vec<BlockDeviation>>) {
        let (lattice, stored) = (self.lattice(), self.top());
        let last = lattice.last.map(|v| v.unsigned_abs() as usize);
        let blocks_of = |level: u32| {
            let size = lattice.last_at(level).map(|v| u64::from(v.unsigned_abs()) + 1);
            Layout::of(Level { number: level, size }).blocks
        };
        let size = blocks_of(stored);
        let top_figures = levels.last().cloned().unwrap_or_default();
        let base = Samples::read(top, stored, 0);
        let mut finer = None;
        for level in stored + 1..=lattice.coarsest_level() {
            let own = Samples::read(top, level, level - stored);
            let surfaces = Surfaces {
                base: &base,
                own: &own,
                finer: Some(finer.as_ref().unwrap_or(&base)),
                last,
                parallel: false,
            };
            let [across, down] = blocks_of(level);
            let block = |[x, y]: [usize; 2]| {
                let mut below = Below::SAMPLES;
                let range = |v: usize, a: usize| {
                    let k = level - stored;
                    v << k..((v + 1) << k).min(size[a])
                };
                for y in range(y, 1) {
                    for x in range(x, 0) {
                        let known = top_figures.get(y * size[0] + x).copied();
                        below.take(known.unwrap_or(BlockDeviation::UNKNOWN));
                    }
                }
                surfaces.block([x, y], below)
            };
            levels.push((0..across * down).map(|i| block([i % across, i / across])).collect());
            finer = Some(own);
        }
    }

    /// All blocks of a level, row by row from the south-west.
    fn read_level(&self, layout: Layout) -> Result<Vec<BlockDeviation>, StoreError> {
        let places: Vec<[usize; 2]> = layout.places().collect();
        let all = vec![BlockDeviation::UNKNOWN; layout.blocks[0] * layout.blocks[1]];
        let all = Mutex::new(Ok(all));
        let next = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..READERS.min(places.len()) {
                scope.spawn(|| {
                    while let Some(place) = places.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let read = self.read_chunk(layout, *place);
                        let mut all = all.lock().unwrap_or_else(PoisonError::into_inner);
                        match (&mut *all, read) {
                            (Ok(all), Ok(chunk)) => copy_chunk(layout, *place, &chunk, all),
                            (Err(_), _) => return,
                            (to, Err(e)) => *to = Err(e),
                        }
                    }
                });
            }
        });
        all.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// The blocks of a whole chunk.
    fn read_chunk(&self, layout: Layout, place: [usize; 2]) -> Result<Vec<BlockDeviation>, StoreError> {
        let file = layout.file(place);
        let Some(written) = self.manifest().files.get(&file).copied() else {
            return Err(self.header(&file, "the manifest does not list it".into()));
        };
        let most = 2 * layout.chunk_bytes() + (1 << 16);
        if written.bytes > most {
            let reason = format!("{} bytes for a chunk that has {most} at most", written.bytes);
            return Err(self.header(&file, reason));
        }
        let content = self.read_header(&file, written)?;
        layout.decode(&content).map_err(|reason| self.header(&file, reason))
    }

    /// What is wrong with a chunk, if anything; and its file and bytes.
    pub(super) fn verify_deviations(
        &self,
        layout: Layout,
        place: [usize; 2],
    ) -> (String, u64, Option<String>) {
        let file = layout.file(place);
        let bytes = self.manifest().files.get(&file).map_or(0, |w| w.bytes);
        let reason = self.read_chunk(layout, place).err().map(|e| match e {
            StoreError::Header { reason, .. } => reason,
            other => other.to_string(),
        });
        (file, bytes, reason)
    }
}

fn copy_chunk(layout: Layout, place: [usize; 2], chunk: &[BlockDeviation], all: &mut [BlockDeviation]) {
    let [from, to] = layout.part(place);
    for (y, row) in (from[1]..to[1]).zip(chunk.chunks_exact(layout.chunk[0])) {
        let count = to[0] - from[0];
        all[y * layout.blocks[0] + from[0]..][..count].copy_from_slice(&row[..count]);
    }
}
