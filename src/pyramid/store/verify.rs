//! Reading everything once: is each byte as it was written?

use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::Serialize;
use xxhash_rust::xxh3::xxh3_64;

use super::SHARD_TILES;
use super::Store;
use super::deviations::Layout;
use super::level::{Level, TileKey};

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Damage {
    /// File inside the store.
    pub file: String,
    /// Level and tile, where a tile is hit.
    pub tile: Option<String>,
    /// First byte of the tile in the file.
    pub offset: Option<u64>,
    /// What is wrong.
    pub reason: String,
}

/// What verifying found.
#[derive(Clone, Debug, Default, Serialize)]
pub struct VerifyReport {
    /// Shards read.
    pub shards: usize,
    /// Tiles decoded and compared with their figures.
    pub tiles: u64,
    /// Bytes read.
    pub bytes: u64,
    /// Everything that is wrong, in the order of files.
    pub damage: Vec<Damage>,
    /// Files in the folder that do not belong to the store.
    pub strangers: Vec<String>,
}

impl VerifyReport {
    /// True when every byte is as it was written.
    #[must_use]
    pub fn whole(&self) -> bool {
        self.damage.is_empty()
    }
}

/// One file to be read.
enum Part {
    Shard(Level, [u64; 2]),
    Deviations(Layout, [usize; 2]),
}

impl Store {
    /// Reads every shard and all deviations whole and decodes every tile; headers were checked when it was opened.
    /// `step` is called after each file with files done and in all.
    #[must_use]
    pub fn verify(&self, threads: usize, step: &(dyn Fn(usize, usize) + Sync)) -> VerifyReport {
        let mut parts = Vec::new();
        for level in self.levels() {
            let [across, down] = level.shards();
            parts.extend((0..down).flat_map(|y| (0..across).map(move |x| Part::Shard(*level, [x, y]))));
        }
        for layout in self.levels().iter().map(|l| Layout::of(*l)).filter(|_| self.has_deviations()) {
            parts.extend(layout.places().map(|place| Part::Deviations(layout, place)));
        }
        let next = AtomicUsize::new(0);
        let done = AtomicUsize::new(0);
        let report = Mutex::new(VerifyReport::default());
        std::thread::scope(|scope| {
            for _ in 0..threads.max(1) {
                scope.spawn(|| {
                    while let Some(part) = parts.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let part = self.verify_part(part);
                        {
                            let mut all = report.lock().unwrap_or_else(PoisonError::into_inner);
                            all.shards += part.shards;
                            all.tiles += part.tiles;
                            all.bytes += part.bytes;
                            all.damage.extend(part.damage);
                        }
                        step(done.fetch_add(1, Ordering::Relaxed) + 1, parts.len());
                    }
                });
            }
        });
        let mut report = report.into_inner().unwrap_or_else(PoisonError::into_inner);
        report.damage.sort_by(|a, b| (&a.file, a.offset, &a.tile).cmp(&(&b.file, b.offset, &b.tile)));
        let known = &self.manifest().files;
        let own = [super::manifest::FILE, super::manifest::HASH_FILE];
        report.strangers = self.bytes().list().unwrap_or_default();
        report.strangers.retain(|f| !known.contains_key(f) && !own.contains(&f.as_str()));
        report.strangers.sort();
        report
    }

    fn verify_part(&self, part: &Part) -> VerifyReport {
        match *part {
            Part::Shard(level, place) => self.verify_shard(level, place),
            Part::Deviations(layout, place) => {
                let (file, bytes, reason) = self.verify_deviations(layout, place);
                let damage = reason.map(|reason| Damage { file, tile: None, offset: None, reason });
                VerifyReport { bytes, damage: damage.into_iter().collect(), ..VerifyReport::default() }
            }
        }
    }

    fn verify_shard(&self, level: Level, [x, y]: [u64; 2]) -> VerifyReport {
        let mut out = VerifyReport::default();
        let [across, down] = level.tiles();
        let first = [x, y].map(|v| u32::try_from(v).unwrap_or(u32::MAX).saturating_mul(SHARD_TILES as u32));
        let file = level.shard_file(first[0], first[1]);
        let mut tile_damage = Vec::new();
        for row in first[1]..(first[1] + SHARD_TILES as u32).min(down) {
            for column in first[0]..(first[0] + SHARD_TILES as u32).min(across) {
                out.tiles += 1;
                let key = TileKey { level: level.number, column, row };
                if let Err(fault) = self.read_tile(key) {
                    tile_damage.push(Damage {
                        file: fault.file,
                        tile: Some(key.to_string()),
                        offset: fault.offset,
                        reason: fault.reason,
                    });
                }
            }
        }
        if let Some(written) = self.manifest().files.get(&file) {
            out.shards = 1;
            let content = self.bytes().read_all(&file, written.bytes.saturating_add(1 << 20));
            let reason = match content {
                Ok(content) => {
                    out.bytes = content.len() as u64;
                    let same = content.len() as u64 == written.bytes && xxh3_64(&content) == written.xxh3;
                    (!same).then(|| "the file is not as it was written".to_string())
                }
                Err(e) => Some(e.to_string()),
            };
            // A tile that is named says more than its file.
            if let (Some(reason), true) = (reason, tile_damage.is_empty()) {
                out.damage.push(Damage { file, tile: None, offset: None, reason });
            }
        }
        out.damage.extend(tile_damage);
        out
    }
}
