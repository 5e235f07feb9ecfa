//! An open store: checked headers, and tiles read one by one.

use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use xxhash_rust::xxh3::xxh3_64;

use super::bytes::{Folder, ReadAt};
use super::codec::{Coder, Samples};
use super::error::StoreError;
use super::level::{FIGURES, Level, TileKey, TileStats};
use super::manifest::{Manifest, Written};
use super::shard::{INDEX_BYTES, ShardIndex, Tile, TileFault, decode_index, figures};
use super::{SHARD_TILES, TILE};
use crate::clipmap::{Lattice, Rect};
use crate::heights::HeightGrid;
use crate::pyramid::VOID;

/// Shard indexes kept; each is some 400 bytes.
const INDEXES_KEPT: usize = 4096;

/// An open store. Reading blocks: it is for loader threads and tools, not for frames.
pub struct Store {
    at: String,
    bytes: Arc<dyn ReadAt>,
    manifest: Manifest,
    levels: Vec<Level>,
    stats: Vec<Vec<TileStats>>,
    coder: Coder,
    indexes: Mutex<HashMap<String, Arc<ShardIndex>>>,
    missing: Vec<String>,
}

impl std::fmt::Debug for Store {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Store").field("at", &self.at).field("levels", &self.levels).finish_non_exhaustive()
    }
}

impl Store {
    /// Opens a store in a local folder.
    ///
    /// # Errors
    /// When it is none, or one of the files that describe it is missing or damaged.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        let at = path.display().to_string();
        if !path.is_dir() {
            return Err(StoreError::NotAStore { at, reason: "no such folder".into() });
        }
        Self::open_from(Arc::new(Folder { root: path.into() }), &at)
    }

    /// True when the folder looks like a store; whether it is a whole one shows when it is opened.
    #[must_use]
    pub fn is_store(path: &Path) -> bool {
        path.is_dir() && (path.join(super::manifest::FILE).exists() || path.join("zarr.json").exists())
    }

    /// True when the folder holds a manifest of this program's: only such a one may be replaced.
    pub(crate) fn is_ours(path: &Path) -> bool {
        use std::io::Read as _;
        let mut head = Vec::new();
        let file = std::fs::File::open(path.join(super::manifest::FILE));
        let read = file.and_then(|f| f.take(64).read_to_end(&mut head));
        read.is_ok() && head.starts_with(b"{\"schema\":\"tessclip-store/")
    }

    /// Opens a store wherever its bytes come from; `at` names it in messages.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open_from(bytes: Arc<dyn ReadAt>, at: &str) -> Result<Self, StoreError> {
        let manifest = Manifest::read(bytes.as_ref(), at)?;
        let levels = manifest.geometry();
        let coder = Coder::new(manifest.codec, manifest.dtype).map_err(|reason| StoreError::Header {
            at: at.into(),
            file: super::manifest::FILE.into(),
            reason,
        })?;
        let mut store = Self {
            at: at.into(),
            bytes,
            stats: Vec::new(),
            coder,
            indexes: Mutex::default(),
            missing: Vec::new(),
            manifest,
            levels,
        };
        store.check_headers()?;
        for level in store.levels.clone() {
            store.stats.push(store.read_stats(level)?);
        }
        store.check_sums()?;
        store.missing = store.missing_shards();
        for file in store.missing.iter().take(4) {
            log::warn!("{at}/{file}: missing or cut short: its tiles show their parent level instead");
        }
        if store.missing.len() > 4 {
            log::warn!("{at}: {} shards are missing or cut short in all", store.missing.len());
        }
        Ok(store)
    }

    /// Files that describe the store, read whole and compared with the manifest.
    fn check_headers(&self) -> Result<(), StoreError> {
        for (file, written) in self.manifest.files.iter().filter(|(f, _)| f.ends_with("zarr.json")) {
            self.read_header(file, *written)?;
        }
        let known = |file: &String| self.manifest.files.contains_key(file);
        let wanted = self.levels.iter().flat_map(|l| {
            ["zarr.json", "elevation/zarr.json", "tiles/zarr.json", "tiles/c/0/0/0"]
                .map(|f| format!("{}/{f}", l.number))
        });
        let mut wanted = wanted.chain(["zarr.json".to_string()]).chain(self.deviation_files());
        match wanted.find(|f| !known(f)) {
            None => Ok(()),
            Some(file) => Err(self.header(&file, "the manifest does not list it".into())),
        }
    }

    pub(super) fn header(&self, file: &str, reason: String) -> StoreError {
        StoreError::Header { at: self.at.clone(), file: file.into(), reason }
    }

    pub(super) fn read_header(&self, file: &str, written: Written) -> Result<Vec<u8>, StoreError> {
        let content = match self.bytes.read_all(file, written.bytes) {
            Ok(content) => content,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                return Err(self.header(file, "it is missing".into()));
            }
            Err(e) => return Err(self.header(file, e.to_string())),
        };
        if content.len() as u64 != written.bytes || xxh3_64(&content) != written.xxh3 {
            return Err(self.header(file, "it is not as it was written".into()));
        }
        Ok(content)
    }

    fn read_stats(&self, level: Level) -> Result<Vec<TileStats>, StoreError> {
        let file = format!("{}/tiles/c/0/0/0", level.number);
        let written = self.manifest.files.get(&file).copied().unwrap_or(Written { bytes: 0, xxh3: 0 });
        let content = self.read_header(&file, written)?;
        let [across, down] = level.tiles();
        let array = super::codec::figures_array([across.into(), down.into()], FIGURES as u64);
        let decoded: Vec<f32> =
            decode_figures(&array, &content).map_err(|reason| self.header(&file, reason))?;
        let all: Vec<TileStats> = decoded.chunks_exact(FIGURES).map(TileStats::from_figures).collect();
        let wanted = across as usize * down as usize;
        if all.len() != wanted {
            return Err(self.header(&file, format!("{} tiles where {wanted} are expected", all.len())));
        }
        Ok(all)
    }

    /// What the manifest says in sum must be what the tiles say one by one: the shaders go by it.
    fn check_sums(&self) -> Result<(), StoreError> {
        let wrong = |reason: String| Err(self.header(super::manifest::FILE, reason));
        for (level, facts) in self.levels.iter().zip(&self.manifest.levels) {
            let voids: u64 = self.stats[level.number as usize].iter().map(|s| u64::from(s.voids)).sum();
            if voids != facts.voids {
                return wrong(format!(
                    "level {} has {voids} voids in its tiles, {} here",
                    level.number, facts.voids
                ));
            }
        }
        let finest = self.stats.first().map_or(&[][..], |s| &s[..]);
        let low = finest.iter().map(|s| s.min_m).fold(f32::NAN, f32::min);
        let high = finest.iter().map(|s| s.max_m).fold(f32::NAN, f32::max);
        if self.manifest.range_m != (!low.is_nan()).then_some([low, high]) {
            return wrong("the height range is not that of the tiles".into());
        }
        Ok(())
    }

    /// Shards that the manifest lists and that are not there, or not of their length.
    fn missing_shards(&self) -> Vec<String> {
        if !self.bytes.is_near() {
            // One question a shard would take minutes over a network; each is looked at when it is read.
            return Vec::new();
        }
        let shards = self.manifest.files.iter().filter(|(f, _)| f.contains("/elevation/c/"));
        shards
            .filter(|(file, written)| !matches!(self.bytes.size(file), Ok(Some(n)) if n == written.bytes))
            .map(|(file, _)| file.clone())
            .collect()
    }

    /// Path or address.
    #[must_use]
    pub fn at(&self) -> &str {
        &self.at
    }

    /// What the store says of itself.
    #[must_use]
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Shards found missing or of another length when it was opened.
    #[must_use]
    pub fn missing(&self) -> &[String] {
        &self.missing
    }

    /// Where its bytes come from.
    pub(crate) fn bytes(&self) -> &dyn ReadAt {
        self.bytes.as_ref()
    }

    /// Its levels, finest first.
    pub(crate) fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Lattice of level 0.
    #[must_use]
    pub fn lattice(&self) -> Lattice {
        let size = self.levels.first().map_or([2; 2], |l| l.size);
        Lattice { last: size.map(|s| i32::try_from(s - 1).unwrap_or(i32::MAX)) }
    }

    /// Coarsest level stored: one tile.
    #[must_use]
    pub fn top(&self) -> u32 {
        u32::try_from(self.levels.len() - 1).unwrap_or(0)
    }

    /// Tile columns and rows of a level.
    #[must_use]
    pub fn tiles(&self, level: u32) -> [u32; 2] {
        self.levels[level as usize].tiles()
    }

    /// Figures of a tile.
    #[must_use]
    pub fn stats(&self, key: TileKey) -> TileStats {
        self.stats[key.level as usize][self.levels[key.level as usize].tile_index(key.column, key.row)]
    }

    /// Void samples of level 0.
    #[must_use]
    pub fn void_count(&self) -> u64 {
        self.manifest.levels.first().map_or(0, |l| l.voids)
    }

    /// Reads, checks and decodes one tile.
    ///
    /// # Errors
    /// Bytes that cannot be had or are not those that were written; the fault names the place.
    pub fn read_tile(&self, key: TileKey) -> Result<Tile, TileFault> {
        let level = self.levels[key.level as usize];
        let file = level.shard_file(key.column, key.row);
        let fault = |place: Option<(u64, u64)>, reason: String, damaged: bool| TileFault {
            key,
            file: file.clone(),
            offset: place.map(|p| p.0),
            length: place.map(|p| p.1),
            reason,
            damaged,
        };
        let wanted = self.stats(key);
        let (samples, encoded_bytes, place) = match self.manifest.files.get(&file) {
            // Without any height in it a shard is not written.
            None => (self.coder.void_tile(), 0, None),
            Some(written) => {
                let index = self.index(&file, *written).map_err(|(r, damaged)| fault(None, r, damaged))?;
                let within =
                    (key.row as usize % SHARD_TILES) * SHARD_TILES + key.column as usize % SHARD_TILES;
                match index[within] {
                    None => (self.coder.void_tile(), 0, None),
                    Some(place) => {
                        let length = usize::try_from(place.1).unwrap_or(usize::MAX);
                        let most = 2 * self.manifest.dtype.tile_bytes() + (1 << 16);
                        if place.1 > most {
                            let reason = format!("{} bytes for a tile that has {most} at most", place.1);
                            return Err(fault(Some(place), reason, true));
                        }
                        let encoded = self
                            .bytes
                            .read(&file, place.0, length)
                            .map_err(|e| fault(Some(place), e.to_string(), is_damage(&e)))?;
                        let samples = self.coder.decode(&encoded).map_err(|e| fault(Some(place), e, true))?;
                        (samples, place.1, Some(place))
                    }
                }
            }
        };
        // A whole tile from elsewhere has a fitting checksum of its own: only these figures tell it apart.
        let found = figures(level, key.column, key.row, &samples);
        if !found.agrees(&wanted) {
            let reason = format!(
                "its heights reach from {} to {} m with {} voids, the store says {} to {} m with {}",
                found.min_m, found.max_m, found.voids, wanted.min_m, wanted.max_m, wanted.voids
            );
            return Err(fault(place, reason, true));
        }
        Ok(Tile { key, samples, encoded_bytes })
    }

    /// Forgets where the tiles of a tile's shard lie: the file may have been replaced.
    pub fn forget_index(&self, key: TileKey) {
        let file = self.levels[key.level as usize].shard_file(key.column, key.row);
        self.indexes.lock().unwrap_or_else(PoisonError::into_inner).remove(&file);
    }

    /// The index of a shard; the lock is never held while reading.
    fn index(&self, file: &str, written: Written) -> Result<Arc<ShardIndex>, (String, bool)> {
        if let Some(known) = self.indexes.lock().unwrap_or_else(PoisonError::into_inner).get(file) {
            return Ok(known.clone());
        }
        let bytes = match self.bytes.size(file) {
            _ if !self.bytes.is_near() => written.bytes,
            Ok(Some(bytes)) => bytes,
            Ok(None) => return Err(("the shard is missing".into(), true)),
            Err(e) => return Err((e.to_string(), is_damage(&e))),
        };
        if bytes != written.bytes || bytes < INDEX_BYTES as u64 {
            return Err((format!("the shard has {bytes} bytes, {} were written", written.bytes), true));
        }
        let encoded = self
            .bytes
            .read(file, bytes - INDEX_BYTES as u64, INDEX_BYTES)
            .map_err(|e| (e.to_string(), is_damage(&e)))?;
        let index = Arc::new(decode_index(&encoded, bytes).map_err(|reason| (reason, true))?);
        let mut known = self.indexes.lock().unwrap_or_else(PoisonError::into_inner);
        if known.len() >= INDEXES_KEPT {
            known.clear();
        }
        known.insert(file.into(), index.clone());
        Ok(index)
    }

    /// Appends the samples of a rectangle of nodes (inside the level), row by row from the south-west,
    /// [`VOID`] where there is none. Level at most [`Store::top`].
    ///
    /// # Errors
    /// The first tile that cannot be read.
    pub fn read_rect(&self, level: u32, rect: Rect, out: &mut Vec<f32>) -> Result<(), TileFault> {
        if rect.is_empty() {
            return Ok(());
        }
        let start = out.len();
        let width = rect.hi[0].abs_diff(rect.lo[0]) as usize + 1;
        out.resize(start + width * (rect.hi[1].abs_diff(rect.lo[1]) as usize + 1), VOID);
        let geometry = self.levels[level as usize];
        let (columns, rows) = geometry.tiles_of(rect);
        for row in rows[0]..=rows[1] {
            for column in columns[0]..=columns[1] {
                let tile = self.read_tile(TileKey { level, column, row })?;
                copy_tile(geometry, &tile.samples, [column, row], rect, &mut out[start..]);
            }
        }
        Ok(())
    }

    /// All of level 0 as a grid in memory.
    ///
    /// # Errors
    /// More than `most` samples, or a tile that cannot be read.
    pub fn to_grid(&self, most: u64) -> Result<HeightGrid, StoreError> {
        let size = self.levels.first().map_or([0; 2], |l| l.size);
        let [width, height] = size;
        if width.saturating_mul(height) > most {
            return Err(StoreError::TooLarge {
                at: self.at.clone(),
                width,
                height,
                most,
                advice: "on a plane (--base plane) it is streamed and may have any size",
            });
        }
        let mut heights = Vec::new();
        let whole = self.lattice().domain();
        self.read_rect(0, whole, &mut heights).map_err(|fault| StoreError::Header {
            at: self.at.clone(),
            file: fault.file.clone(),
            reason: fault.to_string(),
        })?;
        for h in heights.iter_mut().filter(|h| **h == VOID) {
            *h = f32::NAN;
        }
        let mut grid = HeightGrid::new(width as usize, height as usize, heights)?;
        let place = &self.manifest.place;
        grid.spacing_m = place.spacing_m;
        grid.origin_m = place.origin_m;
        grid.georeference = place.georeference();
        grid.dtype = self.manifest.dtype.name();
        grid.format = "tessclip store";
        Ok(grid)
    }
}

/// Copies what a tile has of a rectangle of nodes to its place in the rectangle's samples.
pub(crate) fn copy_tile(
    level: Level,
    samples: &Samples,
    [column, row]: [u32; 2],
    rect: Rect,
    out: &mut [f32],
) {
    let own = level.rect_of(column, row);
    let part = own.intersect(rect);
    if part.is_empty() {
        return;
    }
    let width = rect.hi[0].abs_diff(rect.lo[0]) as usize + 1;
    let count = part.hi[0].abs_diff(part.lo[0]) as usize + 1;
    let west = part.lo[0].abs_diff(own.lo[0]) as usize;
    let mut line = Vec::with_capacity(count);
    for y in part.lo[1]..=part.hi[1] {
        let from_north = own.hi[1].abs_diff(y) as usize;
        line.clear();
        samples.append(from_north * TILE + west, count, &mut line);
        let to = y.abs_diff(rect.lo[1]) as usize * width + part.lo[0].abs_diff(rect.lo[0]) as usize;
        out[to..to + count].copy_from_slice(&line);
    }
}

/// Errors that trying again will not mend.
fn is_damage(e: &std::io::Error) -> bool {
    use std::io::ErrorKind as Kind;
    matches!(e.kind(), Kind::NotFound | Kind::UnexpectedEof | Kind::NotADirectory | Kind::IsADirectory)
}

/// Decodes the one chunk of an array of figures.
fn decode_figures(array: &zarrs::array::ArrayBuilder, encoded: &[u8]) -> Result<Vec<f32>, String> {
    let store = Arc::new(zarrs::storage::store::MemoryStore::new());
    let array = array.build(store.clone(), "/figures").map_err(|e| e.to_string())?;
    let key = array.chunk_key(&[0, 0, 0]);
    zarrs::storage::WritableStorageTraits::set(store.as_ref(), &key, encoded.to_vec().into())
        .map_err(|e| e.to_string())?;
    array.retrieve_chunk_opt::<Vec<f32>>(&[0, 0, 0], &super::codec::one_thread()).map_err(|e| e.to_string())
}
