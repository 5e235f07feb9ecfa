//! The seam for sources whose samples arrive in the background.

use serde::Serialize;

use crate::clipmap::Rect;

/// What one level of the clipmap wants of a streamed source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelWish {
    /// Level of the clipmap.
    pub level: u32,
    /// Nodes its window holds.
    pub needed: Rect,
    /// How far the window will move within the time that loading is ahead, in nodes.
    pub ahead: [f64; 2],
    /// True when the samples are wanted for this very frame; false for a level that is only near.
    pub now: bool,
}

/// A source of samples that come later. Nothing here waits for a disk or a decoder.
pub trait Streaming: Send + Sync {
    /// True when all samples of these rectangles are there as they are stored.
    fn is_ready(&self, level: u32, rects: &[Rect]) -> bool;

    /// What is wanted from now on; what was wanted before and is not named again is cancelled.
    fn wish(&self, wishes: &[LevelWish]);

    /// What happened so far.
    fn counters(&self) -> StreamCounters;

    /// Forgets every sample and wish, as if just opened.
    fn forget(&self);

    /// True when nothing is queued or being loaded.
    fn is_idle(&self) -> bool;

    /// Most bytes of samples to send to the GPU in one frame.
    fn upload_bytes_per_frame(&self) -> u64;

    /// Bytes of cache that the samples wanted now take, all at once.
    fn needs_bytes(&self, wishes: &[LevelWish]) -> u64;
}

/// Sums since the source was opened; all of them only grow, but for `resident_bytes`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct StreamCounters {
    /// Tiles read and decoded, whatever became of them.
    pub tiles_read: u64,
    /// Encoded bytes read.
    pub bytes_read: u64,
    /// Tiles that were in the cache when a window first asked for them.
    pub cache_hits: u64,
    /// Tiles that were not.
    pub cache_misses: u64,
    /// Tiles that made room for others.
    pub evicted: u64,
    /// Requests dropped because no window wanted them any more, queued or already being loaded.
    pub cancelled: u64,
    /// Loads that ended when nobody wanted the tile any more, and were thrown away.
    pub stale_loads: u64,
    /// Reads that failed; a tile is tried again before it is given up.
    pub failed_reads: u64,
    /// Different tiles that could not be read and show their parent level instead.
    pub damaged_tiles: u64,
    /// Bytes of decoded tiles held or being decoded now.
    pub resident_bytes: u64,
    /// Most of them at any moment.
    pub resident_bytes_max: u64,
    /// Bound on them.
    pub limit_bytes: u64,
}
