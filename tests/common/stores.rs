//! Stores for tests, and a source of bytes that misbehaves.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tessclip::heights::{GridSource, HeightGrid};
use tessclip::pyramid::store::{BuildOptions, BuildSummary, InMemory, Progress, ReadAt, Store, build};

/// Builds a store of a grid.
pub fn built(grid: &HeightGrid, at: &Path, options: &BuildOptions) -> BuildSummary {
    build(&GridSource::new(grid.clone()), at, options, &Progress::default()).expect("a store")
}

/// The same, in memory.
pub fn in_memory(grid: &HeightGrid, options: &BuildOptions) -> InMemory {
    let dir = tempfile::tempdir().expect("a folder");
    let at = dir.path().join("t.zarr");
    built(grid, &at, options);
    InMemory::from_folder(&at).expect("a readable store")
}

/// Opens files in memory as a store.
pub fn open(files: InMemory) -> Store {
    Store::open_from(Arc::new(files), "memory").expect("a whole store")
}

/// Files in memory, whose reads of shards are late, fail, or come in another order.
pub struct Double {
    pub files: InMemory,
    /// Every read takes this long.
    pub delay: Duration,
    /// Reads take up to this much longer, by chance: they end in another order than they began.
    pub jitter: Duration,
    /// Reads of shards from this one on fail (counted from 0) ...
    pub fail_from: u64,
    /// ... as many of them.
    pub fail_count: u64,
    /// Reads from this place of this file always fail.
    pub bad_place: Option<(&'static str, u64)>,
    pub reads: AtomicU64,
}

impl Double {
    pub fn of(files: InMemory) -> Self {
        Self {
            files,
            delay: Duration::ZERO,
            jitter: Duration::ZERO,
            fail_from: u64::MAX,
            fail_count: 0,
            bad_place: None,
            reads: AtomicU64::new(0),
        }
    }

    pub fn open(self) -> (Arc<Self>, Store) {
        let double = Arc::new(self);
        let store = Store::open_from(double.clone(), "double").expect("a whole store");
        (double, store)
    }
}

impl ReadAt for Double {
    fn size(&self, file: &str) -> io::Result<Option<u64>> {
        self.files.size(file)
    }

    fn read(&self, file: &str, offset: u64, length: usize) -> io::Result<Vec<u8>> {
        if !file.contains("/elevation/c/") {
            return self.files.read(file, offset, length);
        }
        let number = self.reads.fetch_add(1, Ordering::SeqCst);
        let chance = number.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
        let extra = self.jitter.mul_f64((chance % 1000) as f64 / 1000.0);
        if self.delay + extra > Duration::ZERO {
            std::thread::sleep(self.delay + extra);
        }
        if number >= self.fail_from && number - self.fail_from < self.fail_count {
            return Err(io::Error::other("the double was told to fail"));
        }
        if self.bad_place.is_some_and(|(bad, from)| bad == file && offset == from) {
            return Err(io::Error::other("a bad sector"));
        }
        self.files.read(file, offset, length)
    }
}
