//! A store as a source of samples that never waits.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use super::cache::TileCache;
use super::fallback::{parents, refine};
use super::loader::{self, StreamOptions};
use super::wishes::ordered;
use crate::clipmap::{Lattice, Rect};
use crate::pyramid::store::{Dtype, Store, StoreError, TileKey, copy_tile};
use crate::pyramid::{
    BlockDeviation, Deviations, LevelWish, MemoryPyramid, SampleSource, StreamCounters, Streaming, VOID,
};

/// Heights of a store, tile by tile as they arrive. One renderer follows it at a time: what one asks for cancels
/// what another did, so open the store once for each view.
pub struct TileSource {
    store: Arc<Store>,
    cache: Arc<TileCache>,
    /// The stored top level and all coarser ones.
    top: Arc<MemoryPyramid>,
    /// All in memory from the start: which nodes are drawn must not depend on what has arrived.
    /// Read when first asked for; none where the store has none or they cannot be read.
    deviations: OnceLock<Option<Deviations>>,
    options: StreamOptions,
}

impl TileSource {
    /// Opens a store in a local folder and starts its loaders.
    ///
    /// # Errors
    /// When it is no whole store, or its top cannot be read.
    pub fn open(path: &Path, options: StreamOptions) -> Result<Self, StoreError> {
        Self::new(Arc::new(Store::open(path)?), options)
    }

    /// Streams an open store.
    ///
    /// # Errors
    /// When the one tile of its coarsest level cannot be read, or no thread can be
    /// started.
    pub fn new(store: Arc<Store>, options: StreamOptions) -> Result<Self, StoreError> {
        let top = store.top();
        let whole = Rect { lo: [0, 0], hi: store.lattice().last_at(top) };
        let mut samples = Vec::new();
        store
            .read_rect(top, whole, &mut samples)
            .map_err(|fault| StoreError::Top { at: store.at().into(), fault: fault.to_string() })?;
        let size = whole.hi.map(|v| v.unsigned_abs() as usize + 1);
        // A stored low-pass goes on as one.
        let top = Arc::new(MemoryPyramid::from_samples(samples, size, store.manifest().prefilter()));
        let tile_bytes = store.manifest().dtype.tile_bytes();
        let cache = Arc::new(TileCache::new(options.cache_bytes, tile_bytes));
        let work = loader::Loading { store: store.clone(), cache: cache.clone(), top: top.clone() };
        loader::start(&work, options.loaders).map_err(|e| {
            cache.close();
            StoreError::io(store.at(), "starting loader threads", e)
        })?;
        Ok(Self { store, cache, top, deviations: OnceLock::new(), options })
    }

    /// Reads the deviations of blocks, where the store has them and they were not read yet; waits for the disk.
    /// Scenes with uniform factors never do. What cannot be read is not tried again.
    ///
    /// # Errors
    /// When a file of them is missing or damaged; it is named.
    pub fn load_deviations(&self) -> Result<(), StoreError> {
        let mut failed = None;
        self.deviations.get_or_init(|| {
            self.store.deviations(&self.top).unwrap_or_else(|error| {
                failed = Some(error);
                None
            })
        });
        failed.map_or(Ok(()), Err)
    }

    /// The store underneath.
    #[must_use]
    pub fn store(&self) -> &Arc<Store> {
        &self.store
    }

    fn keys(&self, level: u32, rect: Rect) -> impl Iterator<Item = TileKey> {
        let (columns, rows) = self.store.levels()[level as usize].tiles_of(rect);
        (rows[0]..=rows[1])
            .flat_map(move |row| (columns[0]..=columns[1]).map(move |column| TileKey { level, column, row }))
    }

    /// Samples of a level from what is there.
    fn read_present(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        if level >= self.store.top() {
            self.top.read(level - self.store.top(), rect, out);
            return;
        }
        let start = out.len();
        out.resize(start + usize::try_from(rect.count()).unwrap_or(0), VOID);
        let geometry = self.store.levels()[level as usize];
        let width = rect.hi[0].abs_diff(rect.lo[0]) as usize + 1;
        for key in self.keys(level, rect) {
            if let Some(tile) = self.cache.get(key) {
                copy_tile(geometry, &tile.samples, [key.column, key.row], rect, &mut out[start..]);
                continue;
            }
            let part = geometry.rect_of(key.column, key.row).intersect(rect);
            let mut coarse = Vec::new();
            self.read_present(level + 1, parents(self.lattice(), level, part), &mut coarse);
            let mut fine = Vec::new();
            refine(self.lattice(), level, part, &coarse, &mut fine);
            let row = part.hi[0].abs_diff(part.lo[0]) as usize + 1;
            for (y, line) in (part.lo[1]..).zip(fine.chunks_exact(row)) {
                let to = y.abs_diff(rect.lo[1]) as usize * width + part.lo[0].abs_diff(rect.lo[0]) as usize;
                out[start + to..start + to + row].copy_from_slice(line);
            }
        }
    }
}

impl Drop for TileSource {
    fn drop(&mut self) {
        self.cache.close();
    }
}

impl SampleSource for TileSource {
    fn lattice(&self) -> Lattice {
        self.store.lattice()
    }

    fn has_voids(&self) -> bool {
        self.store.void_count() > 0
    }

    /// What is there now; where a tile is not, the next coarser level's surface. Never waits.
    fn read(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        if !rect.is_empty() {
            self.read_present(level, rect, out);
        }
    }

    fn height_range(&self) -> Option<[f32; 2]> {
        self.store.manifest().range_m
    }

    fn step_m(&self) -> Option<f32> {
        (self.store.manifest().dtype == Dtype::Int16).then_some(1.0)
    }

    /// Straight from the store, past the cache; waits for the disk.
    fn read_now(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        if rect.is_empty() {
            return;
        }
        let start = out.len();
        let read = level < self.store.top() && self.store.read_rect(level, rect, out).is_ok();
        if !read {
            out.truncate(start);
            self.read(level, rect, out);
        }
    }

    /// Of the tile of level 0 there.
    fn relief_near(&self, base: [i32; 2]) -> Option<[f32; 2]> {
        let base = [0, 1].map(|a| base[a].clamp(0, self.lattice().last[a]));
        let key = self.keys(0, Rect { lo: base, hi: base }).next()?;
        let stats = self.store.stats(key);
        (!stats.min_m.is_nan()).then_some([stats.min_m, stats.max_m])
    }

    fn has_deviations(&self) -> bool {
        self.store.has_deviations()
    }

    fn read_deviations(&self, level: u32, blocks: Rect, out: &mut Vec<BlockDeviation>) -> bool {
        if let Err(error) = self.load_deviations() {
            log::error!("{error}; nothing is left out of any patch");
        }
        let Some(deviations) = self.deviations.get().and_then(Option::as_ref) else {
            return false;
        };
        deviations.read(level, blocks, out);
        true
    }

    fn streaming(&self) -> Option<&dyn Streaming> {
        Some(self)
    }
}

impl Streaming for TileSource {
    fn is_ready(&self, level: u32, rects: &[Rect]) -> bool {
        level >= self.store.top()
            || rects.iter().filter(|r| !r.is_empty()).all(|r| self.cache.has_all(self.keys(level, *r)))
    }

    fn wish(&self, wishes: &[LevelWish]) {
        self.cache.wish(&ordered(&self.store, wishes, self.cache.capacity()));
    }

    fn counters(&self) -> StreamCounters {
        self.cache.counters()
    }

    fn forget(&self) {
        self.cache.clear();
    }

    fn is_idle(&self) -> bool {
        self.cache.is_idle()
    }

    fn upload_bytes_per_frame(&self) -> u64 {
        self.options.upload_bytes_per_frame
    }

    fn needs_bytes(&self, wishes: &[LevelWish]) -> u64 {
        let tiles = ordered(&self.store, wishes, usize::MAX).iter().filter(|w| w.now).count();
        tiles as u64 * self.store.manifest().dtype.tile_bytes()
    }
}
