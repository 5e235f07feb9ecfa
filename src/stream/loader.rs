//! The threads that read and decode.

use std::sync::Arc;

use super::cache::{Ticket, TileCache};
use super::fallback::{parents, refine};
use crate::clipmap::Rect;
use crate::pyramid::store::{Dtype, Samples, Store, TILE, Tile, TileFault, TileKey};
use crate::pyramid::{MemoryPyramid, SampleSource as _, VOID};

/// How to stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamOptions {
    /// Bound on the bytes of decoded tiles, those being decoded included; at least one tile. The top of the
    /// pyramid (at most some 700 kB), where factors go by error the deviations of blocks (3.5 % of int16 samples, at most 470 MB) and what each
    /// loader needs while it decodes (about a megabyte) come on top.
    pub cache_bytes: u64,
    /// Loader threads. More than cores help where reads take long.
    pub loaders: usize,
    /// Most bytes of samples sent to the GPU in one frame; at least two windows are allowed.
    pub upload_bytes_per_frame: u64,
}

impl Default for StreamOptions {
    fn default() -> Self {
        Self { cache_bytes: 256 << 20, loaders: 4, upload_bytes_per_frame: 8 << 20 }
    }
}

/// Times a read that failed in a way that may pass is tried before the parent level stands in.
const TRIES: u32 = 6;
/// Damaged tiles that are told one by one.
const MOST_WARNINGS: u64 = 20;

/// Starts the loaders; they end when the cache is closed.
pub(crate) fn start(work: &Loading, loaders: usize) -> std::io::Result<()> {
    for number in 0..loaders.clamp(1, 256) {
        let work = work.clone();
        std::thread::Builder::new().name(format!("tile-loader-{number}")).spawn(move || {
            while let Some(ticket) = work.cache.next() {
                work.load(ticket);
            }
        })?;
    }
    Ok(())
}

/// What a loader works with.
#[derive(Clone)]
pub(crate) struct Loading {
    pub store: Arc<Store>,
    pub cache: Arc<TileCache>,
    /// The stored top level and all coarser ones: what stands in when all else fails.
    pub top: Arc<MemoryPyramid>,
}

impl Loading {
    fn load(&self, ticket: Ticket) {
        let (store, cache) = (&self.store, &self.cache);
        if !cache.is_current(&ticket) {
            cache.give_up(ticket);
            return;
        }
        let key = ticket.key;
        let fault = match read(store, key) {
            Ok(tile) => {
                cache.put(ticket, tile.samples, false, tile.encoded_bytes);
                return;
            }
            Err(fault) => fault,
        };
        // The shard may have been replaced since its index was read.
        store.forget_index(key);
        let again = if fault.damaged { read(store, key) } else { Err(fault) };
        match again {
            Ok(tile) => {
                cache.count_failure();
                cache.put(ticket, tile.samples, false, tile.encoded_bytes);
            }
            Err(fault) if !fault.damaged => {
                if let Some(ticket) = cache.put_off(ticket, TRIES) {
                    self.stand_in(ticket, &fault);
                }
            }
            Err(fault) => {
                cache.count_failure();
                self.stand_in(ticket, &fault);
            }
        }
    }

    /// Draws the parent level in place of a tile that cannot be read.
    fn stand_in(&self, ticket: Ticket, fault: &TileFault) {
        match self.cache.counters().damaged_tiles {
            0..MOST_WARNINGS => log::warn!("{}: {fault}; its parent level is drawn instead", self.store.at()),
            MOST_WARNINGS => log::warn!("{}: more tiles are damaged; run tessclip verify", self.store.at()),
            _ => {}
        }
        let samples = self.parent_tile(ticket.key);
        self.cache.put(ticket, samples, true, 0);
    }

    /// A tile made from the next coarser level.
    fn parent_tile(&self, key: TileKey) -> Samples {
        let store = &self.store;
        let rect = store.levels()[key.level as usize].rect_of(key.column, key.row);
        let heights = self.refined_parent(key.level, rect);
        let width = rect.hi[0].abs_diff(rect.lo[0]) as usize + 1;
        let rows = heights.len() / width;
        // Means need not be whole metres: to the nearest one where the store has no others.
        let whole = store.manifest().dtype != Dtype::Float32;
        let mut tile = vec![VOID; TILE * TILE];
        for (y, row) in heights.chunks_exact(width).enumerate() {
            for (to, &h) in tile[(rows - 1 - y) * TILE..][..width].iter_mut().zip(row) {
                *to = if whole && h != VOID { h.round() } else { h };
            }
        }
        Samples::from_heights(store.manifest().dtype, &tile)
    }

    fn refined_parent(&self, level: u32, rect: Rect) -> Vec<f32> {
        let (lattice, top) = (self.store.lattice(), self.store.top());
        let wanted = parents(lattice, level, rect);
        let mut coarse = Vec::new();
        // The top is in memory, whatever has become of the files: there the recursion ends.
        if level + 1 >= top {
            self.top.read(level + 1 - top, wanted, &mut coarse);
        } else if self.store.read_rect(level + 1, wanted, &mut coarse).is_err() {
            coarse = self.refined_parent(level + 1, wanted);
        }
        let mut out = Vec::new();
        refine(lattice, level, rect, &coarse, &mut out);
        out
    }
}

/// Reads a tile; a decoder that panics on damaged bytes has found them damaged.
fn read(store: &Store, key: TileKey) -> Result<Tile, TileFault> {
    let read = || store.read_tile(key);
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(read)).unwrap_or_else(|_| {
        Err(TileFault {
            key,
            file: "its shard".into(),
            offset: None,
            length: None,
            reason: "the decoder gave up on its bytes".into(),
            damaged: true,
        })
    })
}
