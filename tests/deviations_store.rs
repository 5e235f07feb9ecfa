//! Stores hold deviations of blocks that bound the surface as those measured in memory do.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use std::sync::Arc;

use common::stores::in_memory;
use tessclip::clipmap::Rect;
use tessclip::heights::{GridSource, HeightError, HeightGrid, RasterHeader, RasterSource};
use tessclip::pyramid::store::{BuildOptions, InMemory, Progress, Store, StoreError, build};
use tessclip::pyramid::{
    BlockDeviation, Deviations, FIGURES, MemoryPyramid, Prefilter, SampleSource, blocks_at,
};
use tessclip::stream::{StreamOptions, TileSource};

/// A grid of whole metres as a file of int16 gives it.
struct Whole(GridSource, RasterHeader);

impl Whole {
    fn new(grid: HeightGrid) -> Self {
        let source = GridSource::new(grid);
        let header = RasterHeader { dtype: "int16", ..source.header().clone() };
        Self(source, header)
    }
}

impl RasterSource for Whole {
    fn header(&self) -> &RasterHeader {
        &self.1
    }
    fn read(&self, at: [u64; 2], size: [usize; 2], out: &mut [f32]) -> Result<(), HeightError> {
        self.0.read(at, size, out)
    }
}

fn built_whole(grid: &HeightGrid, options: &BuildOptions) -> InMemory {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path().join("t.zarr");
    build(&Whole::new(grid.clone()), &at, options, &Progress::default()).unwrap();
    InMemory::from_folder(&at).unwrap()
}

fn streamed(files: InMemory) -> Result<TileSource, StoreError> {
    let store = Store::open_from(Arc::new(files), "memory")?;
    TileSource::new(Arc::new(store), StreamOptions::default())
}

/// Why a store or its deviations cannot be read.
fn unread(files: InMemory) -> String {
    streamed(files).and_then(|source| source.load_deviations()).err().unwrap().to_string()
}

fn mountains(width: usize, height: usize) -> HeightGrid {
    common::terrain(&format!("procedural:mountains?width={width}&height={height}"))
}

/// All blocks of a level, stored and measured in memory.
fn pairs(
    stored: &TileSource,
    exact: &Deviations,
    level: u32,
) -> Vec<([i32; 2], BlockDeviation, BlockDeviation)> {
    let size = blocks_at(stored.lattice(), level);
    let all = Rect { lo: [0, 0], hi: size.map(|n| n - 1) };
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    assert!(stored.read_deviations(level, all, &mut ours));
    exact.read(level, all, &mut theirs);
    assert_eq!(ours.len() as u64, all.count());
    let places = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
    places.zip(ours.into_iter().zip(theirs)).map(|(place, (a, b))| (place, a, b)).collect()
}

fn compare(stored: &TileSource, exact: &Deviations, name: &str) {
    let top = stored.store().top();
    let mut loosest = 1.0_f32;
    for level in 0..=stored.lattice().coarsest_level() {
        for (place, ours, theirs) in pairs(stored, exact, level) {
            if level <= top.min(3) {
                assert_eq!(ours, theirs, "{name}: level {level}, block {place:?}");
                continue;
            }
            for k in 0..FIGURES {
                let (ours, theirs) = (ours.metres(k), theirs.metres(k));
                let at = format!("{name}: level {level}, block {place:?}, rank {k}: {ours} {theirs}");
                assert!(ours >= theirs / 1.01, "{at}");
                assert!(ours <= 4.0 * theirs + 1.0, "{at}");
                loosest = loosest.max((ours - 1.0) / theirs.max(1.0));
            }
        }
    }
    eprintln!("{name}: at most {loosest} times the exact figure");
}

#[test]
fn stored_figures_are_those_measured_in_memory_or_a_little_more() {
    for (width, height) in [(2, 2), (300, 40), (700, 533), (1025, 1025), (2100, 1603)] {
        let grid = mountains(width, height);
        let mut whole = grid.clone();
        whole.heights_m.iter_mut().for_each(|h| *h = h.round());
        for prefilter in [Prefilter::Subsample, Prefilter::LowPass] {
            let options = BuildOptions { prefilter, ..BuildOptions::default() };
            let name = format!("{width} x {height}, {prefilter}");
            let source = streamed(in_memory(&grid, &options)).unwrap();
            compare(&source, &Deviations::of(&MemoryPyramid::new(&grid, prefilter)), &name);
            let source = streamed(built_whole(&whole, &options)).unwrap();
            compare(&source, &Deviations::of(&MemoryPyramid::new(&whole, prefilter)), &name);
        }
    }
}

#[test]
fn blocks_with_a_void_anywhere_under_them_are_unknown() {
    let unknown = BlockDeviation::UNKNOWN.metres(1);
    let mut grid = mountains(2100, 1603);
    // On nodes of all levels, of none but the finest, and on the last.
    let voids = [[1024, 512], [301, 777], [2099, 1602]];
    grid.valid = Some((0..2100 * 1603).map(|i| !voids.contains(&[i % 2100, i / 2100])).collect());
    for prefilter in [Prefilter::Subsample, Prefilter::LowPass] {
        let options = BuildOptions { prefilter, ..BuildOptions::default() };
        let source = streamed(in_memory(&grid, &options)).unwrap();
        let exact = Deviations::of(&MemoryPyramid::new(&grid, prefilter));
        for level in 0..=source.lattice().coarsest_level() {
            for (place, ours, theirs) in pairs(&source, &exact, level) {
                assert!(ours.metres(0) < unknown);
                for k in 1..FIGURES {
                    let (ours, theirs) = (ours.metres(k) == unknown, theirs.metres(k) == unknown);
                    assert_eq!(ours, theirs, "{prefilter}: level {level}, block {place:?}, rank {k}");
                }
            }
        }
    }
}

#[test]
fn figures_do_not_depend_on_the_number_of_workers() {
    let grid = mountains(4200, 2300);
    let of = |threads| {
        let options = BuildOptions { threads: Some(threads), ..BuildOptions::default() };
        let files = in_memory(&grid, &options).files;
        files.into_iter().filter(|(f, _)| f.contains("/deviations/")).collect::<Vec<_>>()
    };
    let one = of(1);
    // 263 x 144 blocks on level 0: two chunks.
    assert_eq!(one.iter().filter(|(f, _)| f.starts_with("0/deviations/c/")).count(), 2);
    assert!(one == of(3));
}

#[test]
fn damage_is_noticed_and_named() {
    let whole = in_memory(&mountains(700, 533), &BuildOptions::default());
    let names: Vec<String> = whole.files.keys().filter(|f| f.contains("/deviations/")).cloned().collect();
    assert_eq!(names.len(), 2 * 3);
    assert!(streamed(whole.clone()).unwrap().store().verify(2, &|_, _| {}).whole());
    for name in names {
        let mut flipped = whole.clone();
        let content = flipped.files.get_mut(&name).unwrap();
        let middle = content.len() / 2;
        content[middle] ^= 1;
        let mut cut = whole.clone();
        cut.files.get_mut(&name).unwrap().pop();
        let mut long = whole.clone();
        long.files.get_mut(&name).unwrap().push(0);
        let mut missing = whole.clone();
        missing.files.remove(&name);
        for files in [flipped, cut, long, missing] {
            if let Ok(store) = Store::open_from(Arc::new(files.clone()), "memory") {
                let report = store.verify(2, &|_, _| {});
                assert!(report.damage.len() == 1 && report.damage[0].file == name, "{report:?}");
            }
            let error = unread(files);
            assert!(error.contains(&name) && !error.contains('\n'), "{error}");
        }
    }
}

/// The same files with another manifest, whose checksum fits.
fn with_manifest(mut files: InMemory, change: impl Fn(&mut serde_json::Value)) -> InMemory {
    let mut manifest = serde_json::from_slice(&files.files["manifest.json"]).unwrap();
    change(&mut manifest);
    let text = manifest.to_string();
    let hash = format!("{:016x}\n", xxhash_rust::xxh3::xxh3_64(text.as_bytes()));
    files.files.insert("manifest.json".into(), text.into_bytes());
    files.files.insert("manifest.json.xxh3".into(), hash.into_bytes());
    files
}

/// Streams the samples, and knows no deviations.
fn streamed_without(grid: &HeightGrid, files: InMemory) {
    let source = streamed(files).unwrap();
    assert!(!source.store().has_deviations());
    assert!(source.store().verify(2, &|_, _| {}).whole());
    source.load_deviations().unwrap();
    let mut out = Vec::new();
    assert!(!source.read_deviations(0, Rect { lo: [0, 0], hi: [3, 3] }, &mut out) && out.is_empty());
    let mut samples = Vec::new();
    source.read_now(0, Rect { lo: [5, 7], hi: [5, 7] }, &mut samples);
    assert_eq!(samples, [grid.heights_m[7 * 700 + 5]]);
}

#[test]
fn stores_made_before_there_were_deviations_are_streamed_without() {
    let grid = mountains(700, 533);
    let mut old = with_manifest(in_memory(&grid, &BuildOptions::default()), |manifest| {
        manifest["schema"] = "tessclip-store/1".into();
        manifest["files"].as_object_mut().unwrap().retain(|f, _| !f.contains("/deviations/"));
    });
    old.files.retain(|f, _| !f.contains("/deviations/"));
    streamed_without(&grid, old);
}

#[test]
fn deviations_of_the_meshes_before_these_are_not_read() {
    let grid = mountains(700, 533);
    let now = in_memory(&grid, &BuildOptions::default());
    assert!(streamed(now.clone()).unwrap().store().has_deviations());
    let mut old = with_manifest(now, |manifest| manifest["schema"] = "tessclip-store/2".into());
    // Five figures a block are not nine.
    for (_, content) in old.files.iter_mut().filter(|(f, _)| f.contains("/deviations/c/")) {
        content.truncate(content.len() * 5 / 9);
    }
    streamed_without(&grid, old);
}

#[test]
fn a_manifest_that_lists_only_some_of_them_or_too_large_ones_is_refused() {
    let whole = in_memory(&mountains(700, 533), &BuildOptions::default());
    let file = "1/deviations/c/0/0/0";
    let some = with_manifest(whole.clone(), |manifest| {
        manifest["files"].as_object_mut().unwrap().remove(file);
    });
    assert!(unread(some).contains(file));
    let large = with_manifest(whole, |manifest| manifest["files"][file]["bytes"] = (1_u64 << 40).into());
    assert!(unread(large).contains(file));
}

#[test]
fn they_take_little_room() {
    let grid = mountains(1025, 1025);
    let mut whole = grid.clone();
    whole.heights_m.iter_mut().for_each(|h| *h = h.round());
    let options = BuildOptions::default();
    for (files, bytes) in [(in_memory(&grid, &options), 4), (built_whole(&whole, &options), 2)] {
        let sum = |part: &str| -> usize {
            files.files.iter().filter(|(f, _)| f.contains(part)).map(|(_, content)| content.len()).sum()
        };
        let (deviations, shards) = (sum("/deviations/"), sum("/elevation/c/"));
        // Level 0 alone; the coarser ones are a third as much again.
        let samples = 1025 * 1025 * bytes;
        eprintln!("{deviations} bytes for {samples} of samples, {shards} compressed");
        assert!(deviations * 20 <= samples);
    }
}
