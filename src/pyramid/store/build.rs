//! Building a store: level 0 from a source, each coarser level from the one before, shard by shard.
//!
//! Memory does not depend on the input: every worker holds one shard, and sources are read by rectangles in
//! the order of the file. Coarser levels are made from what was already written, decoded once more; and so are
//! the deviations of blocks, at the end.

mod coarser;
mod deviations;
mod headers;
mod readback;

use std::path::Path;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use zarrs::array::Array;

use self::coarser::Coarser;
use super::codec::{Samples, array_bytes, elevation_array, one_thread};
use super::error::StoreError;
use super::level::{Level, TileStats, levels_of};
use super::manifest::{LevelFacts, Manifest, Place, SCHEMA};
use super::replace::Draft;
use super::shard::figures;
use super::sink::Sink;
use super::{Codec, Dtype, SHARD, SHARD_TILES, TILE};
use crate::heights::RasterSource;
use crate::pyramid::{Prefilter, VOID};

/// Most workers: each holds some 30 MB.
const MOST_WORKERS: usize = 8;

/// How to build.
#[derive(Clone, Debug)]
pub struct BuildOptions {
    /// Compression.
    pub codec: Codec,
    /// Most that a sample of level 0 may differ from the source, metres; 0 is lossless.
    pub max_error_m: f64,
    /// How coarser levels are made.
    pub prefilter: Prefilter,
    /// Replace a store that is already there.
    pub overwrite: bool,
    /// Workers; `None` takes one a core, at most eight.
    pub threads: Option<usize>,
    /// Names of the sources, for the record.
    pub sources: Vec<String>,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            codec: Codec::default(),
            max_error_m: 0.0,
            prefilter: Prefilter::default(),
            overwrite: false,
            threads: None,
            sources: Vec::new(),
        }
    }
}

/// How far a build is; read it from another thread.
#[derive(Debug, Default)]
pub struct Progress {
    /// Samples written plus samples whose deviations are measured, of all levels.
    pub samples: AtomicU64,
    /// What that will be in the end: each sample counts twice.
    pub total: AtomicU64,
    /// Set it to end the build with [`StoreError::Stopped`].
    pub stop: AtomicBool,
}

/// What was built.
#[derive(Clone, Debug)]
pub struct BuildSummary {
    /// The manifest as written.
    pub manifest: Manifest,
    /// Bytes of all files.
    pub bytes: u64,
    /// Bytes of the shards alone.
    pub shard_bytes: u64,
}

/// Builds a store at `target` from a source. The old store or the new one stands there at every moment.
///
/// # Errors
/// A source that cannot be read, a target that must not or cannot be written, a full disk.
pub fn build(
    source: &dyn RasterSource,
    target: &Path,
    options: &BuildOptions,
    progress: &Progress,
) -> Result<BuildSummary, StoreError> {
    if !(0.0..=1e6).contains(&options.max_error_m) {
        return Err(StoreError::MaxError { value: options.max_error_m });
    }
    let header = source.header();
    let tiles = levels_of([header.width, header.height])[0].tiles();
    if u64::from(tiles[0]) * u64::from(tiles[1]) > super::MOST_TILES {
        let (width, height) = (header.width, header.height);
        return Err(StoreError::TooManyTiles { at: target.display().to_string(), width, height });
    }
    if source.band_rows() < SHARD as u64 && header.width > SHARD as u64 {
        log::warn!("the source's strips are wide: each is decoded many times; tiles would be read faster");
    }
    let draft = Draft::begin(target, options.overwrite)?;
    let at = target.display().to_string();
    let mut dtype = first_dtype(source, options.prefilter, options.max_error_m);
    let summary = loop {
        let work = Build::new(source, &draft, &at, options, progress, dtype)?;
        match work.run()? {
            Some(summary) => break summary,
            // A height that happens to be the mark for voids, or one that is not whole after all.
            None => {
                dtype = Dtype::Float32;
                std::fs::remove_dir_all(draft.folder())
                    .and_then(|()| std::fs::create_dir(draft.folder()))
                    .map_err(|e| StoreError::io(&at, "beginning again", e))?;
            }
        }
    };
    draft.place(options.overwrite)?;
    Ok(summary)
}

/// The narrowest type that the source's own type promises to fit.
fn first_dtype(source: &dyn RasterSource, prefilter: Prefilter, max_error_m: f64) -> Dtype {
    let header = source.header();
    // Multiples of a power of two below one metre are no whole metres.
    // A low-pass makes fractions.
    let whole = header.raw && prefilter == Prefilter::Subsample && (max_error_m == 0.0 || max_error_m >= 0.5);
    match header.dtype {
        "byte" | "int8" | "int16" if whole => Dtype::Int16,
        "uint16" if whole => Dtype::Uint16,
        _ => Dtype::Float32,
    }
}

/// Step to which samples are rounded so that none moves by more than `max_error_m`: a power of two, whose
/// multiples are exact in f32 and end in zero bits, which is what the codecs live on.
fn rounding_step(max_error_m: f64) -> Option<f64> {
    (max_error_m > 0.0).then(|| (2.0 * max_error_m).log2().floor().exp2())
}

struct Build<'a> {
    source: &'a dyn RasterSource,
    draft: &'a Draft,
    at: &'a str,
    options: &'a BuildOptions,
    progress: &'a Progress,
    dtype: Dtype,
    levels: Vec<Level>,
    sink: std::sync::Arc<Sink>,
    step_m: Option<f64>,
}

/// What a level's shards add up to.
struct LevelDone {
    stats: Vec<TileStats>,
    mean_m: Option<f64>,
}

impl<'a> Build<'a> {
    fn new(
        source: &'a dyn RasterSource,
        draft: &'a Draft,
        at: &'a str,
        options: &'a BuildOptions,
        progress: &'a Progress,
        dtype: Dtype,
    ) -> Result<Self, StoreError> {
        let header = source.header();
        let levels = levels_of([header.width, header.height]);
        let total = levels.iter().map(|l| 2 * l.size[0] * l.size[1]).sum();
        progress.samples.store(0, Ordering::Relaxed);
        progress.total.store(total, Ordering::Relaxed);
        Ok(Self {
            source,
            draft,
            at,
            options,
            progress,
            dtype,
            levels,
            sink: std::sync::Arc::new(Sink::new(draft.folder().into())),
            step_m: rounding_step(options.max_error_m),
        })
    }

    /// `None` when the sample type turns out too narrow.
    fn run(&self) -> Result<Option<BuildSummary>, StoreError> {
        let mut facts = Vec::new();
        let mut range_m = None;
        let mut mean_m = None;
        for (ix, level) in self.levels.iter().enumerate() {
            let array = self.array(*level)?;
            let finer = ix.checked_sub(1).map(|finer| self.levels[finer]);
            let Some(done) = self.level(*level, finer, &array)? else { return Ok(None) };
            self.write_level_headers(*level, &array, &done.stats)?;
            let voids = done.stats.iter().map(|s| u64::from(s.voids)).sum();
            let error_m = done.stats.iter().fold(0.0_f32, |a, s| a.max(s.error_m));
            facts.push(LevelFacts { size: level.size, voids, error_m });
            if finer.is_none() {
                let low = done.stats.iter().map(|s| s.min_m).fold(f32::NAN, f32::min);
                let high = done.stats.iter().map(|s| s.max_m).fold(f32::NAN, f32::max);
                range_m = (!low.is_nan()).then_some([low, high]);
                mean_m = done.mean_m;
            }
        }
        self.measure()?;
        let header = self.source.header();
        let place = Place::new(header.spacing_m, header.origin_m, &header.georeference);
        self.write_root(&place)?;
        let manifest = Manifest {
            schema: SCHEMA.into(),
            made_by: format!("tessclip {}", env!("CARGO_PKG_VERSION")),
            sources: self.options.sources.clone(),
            dtype: self.dtype,
            source_dtype: header.dtype.into(),
            codec: self.options.codec,
            tile: TILE,
            prefilter: self.options.prefilter.to_string(),
            max_error_m: self.options.max_error_m,
            place,
            range_m,
            mean_m,
            levels: facts,
            files: self.sink.written(),
        };
        let files = manifest.to_files().map_err(|reason| self.encode_error(reason))?;
        for (file, bytes) in files {
            self.sink.write(file, &bytes).map_err(|e| StoreError::io(self.at, "writing", e))?;
        }
        let written = self.sink.written();
        let shards = written.iter().filter(|(f, _)| f.contains("/elevation/c/"));
        Ok(Some(BuildSummary {
            bytes: written.values().map(|w| w.bytes).sum(),
            shard_bytes: shards.map(|(_, w)| w.bytes).sum(),
            manifest,
        }))
    }

    fn encode_error(&self, reason: String) -> StoreError {
        StoreError::Encode { at: self.at.into(), reason }
    }

    fn array(&self, level: Level) -> Result<Array<Sink>, StoreError> {
        let builder = elevation_array(self.options.codec, self.dtype, level.size);
        let mut builder = builder.map_err(|e| self.encode_error(e))?;
        let header = self.source.header();
        let place = Place::new(header.spacing_m, header.origin_m, &header.georeference);
        builder.attributes(headers::array_attributes(&place, level, self.levels[0]));
        builder
            .build(self.sink.clone(), &format!("/{}/elevation", level.number))
            .map_err(|e| self.encode_error(e.to_string()))
    }

    /// All shards of a level, in the order of the file, by all workers.
    fn level(
        &self,
        level: Level,
        finer: Option<Level>,
        array: &Array<Sink>,
    ) -> Result<Option<LevelDone>, StoreError> {
        let tiles = level.tiles();
        let empty = TileStats { min_m: f32::NAN, max_m: f32::NAN, mean_m: f32::NAN, error_m: 0.0, voids: 0 };
        let stats = Mutex::new(vec![empty; tiles[0] as usize * tiles[1] as usize]);
        let coarser = match finer {
            Some(finer) => Some(Coarser::new(finer, level, self)?),
            None => None,
        };
        let [across, down] = level.shards();
        let fits = self.by_all_workers(across * down, &|number| {
            let shard = [number % across, number / across];
            let Some(done) = self.shard(level, coarser.as_ref(), array, shard)? else { return Ok(false) };
            let mut all = stats.lock().unwrap_or_else(PoisonError::into_inner);
            for (tile, one) in done {
                all[tile] = one;
            }
            Ok(true)
        })?;
        if !fits {
            return Ok(None);
        }
        let stats = stats.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mean_m = mean(level, &stats);
        Ok(Some(LevelDone { stats, mean_m }))
    }

    /// Does pieces of work in their order until one fails or says false; tells whether all said true.
    fn by_all_workers(
        &self,
        count: u64,
        work: &(dyn Fn(u64) -> Result<bool, StoreError> + Sync),
    ) -> Result<bool, StoreError> {
        let next = AtomicU64::new(0);
        let ended = AtomicBool::new(false);
        let failed: Mutex<Option<StoreError>> = Mutex::new(None);
        let cores = std::thread::available_parallelism().map_or(1, Into::into);
        let workers = self.options.threads.unwrap_or(cores).clamp(1, MOST_WORKERS);
        std::thread::scope(|scope| {
            for _ in 0..workers {
                scope.spawn(|| {
                    loop {
                        let number = next.fetch_add(1, Ordering::Relaxed);
                        if number >= count || ended.load(Ordering::Relaxed) {
                            return;
                        }
                        match work(number) {
                            Ok(true) => continue,
                            Ok(false) => {}
                            Err(e) => *failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(e),
                        }
                        ended.store(true, Ordering::Relaxed);
                    }
                });
            }
        });
        match failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => Ok(!ended.into_inner()),
        }
    }

    /// One shard: its samples, its tiles' figures, and the file.
    fn shard(
        &self,
        level: Level,
        coarser: Option<&Coarser<'_>>,
        array: &Array<Sink>,
        [x, y]: [u64; 2],
    ) -> Result<Option<Vec<(usize, TileStats)>>, StoreError> {
        self.go_on()?;
        let first = [x, y].map(|v| v * SHARD as u64);
        let size = [0, 1].map(|a| usize::try_from((level.size[a] - first[a]).min(SHARD as u64)).unwrap_or(0));
        // Rows from the north, the whole shard, voids beyond the data.
        let mut heights = vec![VOID; SHARD * SHARD];
        let mut errors = [0.0_f32; SHARD_TILES * SHARD_TILES];
        match coarser {
            None => self.read_source(level, first, size, &mut heights)?,
            Some(coarser) => coarser.fill(first, size, &mut heights, &mut errors)?,
        }
        if !heights.iter().all(|&h| h == VOID || self.dtype.holds(h)) {
            return Ok(None);
        }
        let mut done = Vec::new();
        let tiles = level.tiles();
        let mut tile = Vec::with_capacity(TILE * TILE);
        for ty in 0..size[1].div_ceil(TILE) {
            for tx in 0..size[0].div_ceil(TILE) {
                tile.clear();
                for row in 0..TILE {
                    let from = (ty * TILE + row) * SHARD + tx * TILE;
                    tile.extend_from_slice(&heights[from..from + TILE]);
                }
                let at = |v: u64, t: usize| u32::try_from(v).unwrap_or(0) * SHARD_TILES as u32 + t as u32;
                let (column, row) = (at(x, tx), at(y, ty));
                let mut one = figures(level, column, row, &Samples::Float32(tile.clone()));
                one.error_m = errors[ty * SHARD_TILES + tx];
                done.push((row as usize * tiles[0] as usize + column as usize, one));
            }
        }
        let samples = Samples::from_heights(self.dtype, &heights);
        drop(heights);
        array
            .store_chunk_opt(&[y, x], array_bytes(samples), &one_thread())
            .map_err(|e| self.write_error(e))?;
        self.progress.samples.fetch_add((size[0] * size[1]) as u64, Ordering::Relaxed);
        Ok(Some(done))
    }

    /// An error when the build was told to stop.
    fn go_on(&self) -> Result<(), StoreError> {
        if self.progress.stop.load(Ordering::Relaxed) {
            return Err(StoreError::Stopped { at: self.at.into() });
        }
        Ok(())
    }

    fn write_error(&self, error: zarrs::array::ArrayError) -> StoreError {
        use zarrs::array::ArrayError;
        use zarrs::storage::StorageError;
        match error {
            ArrayError::StorageError(StorageError::IOError(e)) => {
                let again = e.raw_os_error().map_or_else(
                    || std::io::Error::new(e.kind(), e.to_string()),
                    std::io::Error::from_raw_os_error,
                );
                StoreError::io(self.at, "writing", again)
            }
            other => self.encode_error(other.to_string()),
        }
    }

    fn read_source(
        &self,
        level: Level,
        first: [u64; 2],
        size: [usize; 2],
        heights: &mut [f32],
    ) -> Result<(), StoreError> {
        let mut block = vec![f32::NAN; size[0] * size[1]];
        let south = level.size[1] - first[1] - size[1] as u64;
        self.source.read([first[0], south], size, &mut block)?;
        for row in 0..size[1] {
            let from = &block[(size[1] - 1 - row) * size[0]..][..size[0]];
            for (to, &h) in heights[row * SHARD..][..size[0]].iter_mut().zip(from) {
                *to = if h.is_finite() { self.rounded(h) } else { VOID };
            }
        }
        Ok(())
    }

    /// A height to the allowed precision; one that would leave its type by rounding stays as it is.
    fn rounded(&self, h: f32) -> f32 {
        let Some(step) = self.step_m.filter(|_| h != VOID) else { return h };
        #[expect(clippy::cast_possible_truncation, reason = "a multiple of a power of two near an f32")]
        let to = ((f64::from(h) / step).round() * step) as f32;
        let moved = (f64::from(to) - f64::from(h)).abs();
        if moved <= self.options.max_error_m && self.dtype.holds(to) { to } else { h }
    }
}

/// Mean over all tiles, weighted by the heights each has.
fn mean(level: Level, stats: &[TileStats]) -> Option<f64> {
    let [across, _] = level.tiles();
    let (mut sum, mut count) = (0.0, 0_u64);
    for (ix, one) in (0_u32..).zip(stats) {
        let inside = level.rect_of(ix % across, ix / across).count() - u64::from(one.voids);
        if inside > 0 {
            sum += f64::from(one.mean_m) * inside as f64;
            count += inside;
        }
    }
    (count > 0).then(|| sum / count as f64)
}
