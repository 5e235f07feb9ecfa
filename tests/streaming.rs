//! The tile cache and its loaders: nothing waits, nothing is lost, and what fails is replaced and counted.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use common::stores::{Double, in_memory, open};
use tessclip::clipmap::Rect;
use tessclip::heights::HeightGrid;
use tessclip::pyramid::store::{BuildOptions, Store};
use tessclip::pyramid::{LevelWish, MemoryPyramid, Prefilter, SampleSource, Streaming, VOID};
use tessclip::stream::{StreamOptions, TileSource};

const TILE_BYTES: u64 = 256 * 256 * 4;

fn grid() -> HeightGrid {
    common::terrain("procedural:mountains?width=1300&height=1100")
}

fn source(store: Store, tiles: u64, loaders: usize) -> TileSource {
    let options = StreamOptions { cache_bytes: tiles * TILE_BYTES, loaders, ..StreamOptions::default() };
    TileSource::new(Arc::new(store), options).unwrap()
}

fn wish(level: u32, needed: Rect) -> LevelWish {
    LevelWish { level, needed, ahead: [0.0; 2], now: true }
}

fn rect(lo: [i32; 2], side: i32) -> Rect {
    Rect { lo, hi: [lo[0] + side - 1, lo[1] + side - 1] }
}

/// Waits until nothing is under way; fails the test when that takes too long.
fn settle(source: &TileSource, seconds: u64) {
    let begin = Instant::now();
    while !source.is_idle() {
        assert!(begin.elapsed() < Duration::from_secs(seconds), "loading does not come to rest");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn read(source: &dyn SampleSource, level: u32, rect: Rect) -> Vec<f32> {
    let mut out = Vec::new();
    source.read(level, rect, &mut out);
    out
}

#[test]
fn what_has_not_arrived_is_the_coarser_levels_surface_and_then_the_samples() {
    let grid = grid();
    let memory = MemoryPyramid::new(&grid, Prefilter::Subsample);
    let source = source(open(in_memory(&grid, &BuildOptions::default())), 64, 2);
    let top = source.store().top();
    let area = rect([200, 300], 200);
    // Nothing asked for: all comes from the top of the pyramid, on its own triangles.
    let coarse = read(&source, 0, area);
    let step = 1 << top;
    for (k, h) in coarse.iter().enumerate() {
        let p = [area.lo[0] + k as i32 % 200, area.lo[1] + k as i32 / 200];
        if p.iter().all(|v| v % step == 0) {
            assert_eq!(*h, memory.sample(0, p), "nodes of the top level are exact");
        }
    }
    assert!(!source.is_ready(0, &[area]));
    source.wish(&[wish(0, area)]);
    settle(&source, 20);
    assert!(source.is_ready(0, &[area]));
    assert_eq!(read(&source, 0, area), read(&memory, 0, area));
    // Waiting reads are exact from the start, wherever.
    let mut now = Vec::new();
    source.read_now(1, rect([0, 0], 500), &mut now);
    assert_eq!(now, read(&memory, 1, rect([0, 0], 500)));
}

#[test]
fn coarse_levels_come_first_and_near_tiles_before_far_ones() {
    let slow = Double {
        delay: Duration::from_millis(2),
        ..Double::of(in_memory(&grid(), &BuildOptions::default()))
    };
    let (double, store) = slow.open();
    let before = double.reads.load(Ordering::SeqCst);
    // One loader and room for all: the order of arrival is the order of wishes.
    let source = source(store, 64, 1);
    let all = Rect { lo: [0, 0], hi: [1299, 1099] };
    let half = Rect { lo: [0, 0], hi: [649, 549] };
    source.wish(&[wish(0, all), wish(1, half), wish(2, Rect { lo: [0, 0], hi: [324, 274] })]);
    // Tiles of level 0 in the middle of the window, and in a corner of it.
    let (near, far) = (rect([640, 540], 20), rect([0, 0], 20));
    let mut seen = Vec::new();
    while !source.is_idle() {
        let ready = [source.is_ready(2, &[Rect { lo: [0, 0], hi: [324, 274] }]), source.is_ready(1, &[half])];
        // The later ones first: one may arrive between two questions.
        let far_first = source.is_ready(0, &[far]) && !source.is_ready(0, &[near]);
        seen.push((ready, source.is_ready(0, &[all]), far_first));
    }
    settle(&source, 20);
    assert!(source.is_ready(0, &[all]));
    assert!(seen.len() > 20, "looked at too seldom to tell an order");
    for (coarse, fine, far_first) in seen {
        assert!(!fine || coarse == [true; 2]);
        assert!(!coarse[1] || coarse[0]);
        assert!(!far_first);
    }
    assert!(double.reads.load(Ordering::SeqCst) > before);
}

#[test]
fn memory_never_passes_its_bound_and_a_full_cache_evicts() {
    let files = in_memory(&grid(), &BuildOptions::default());
    for tiles in [1, 2, 5] {
        let source = source(open(files.clone()), tiles, 4);
        let memory = MemoryPyramid::new(&grid(), Prefilter::Subsample);
        for k in 0..60 {
            let area = rect([(k * 37) % 1000, (k * 53) % 800], 120);
            source.wish(&[wish(0, area), wish(1, rect(area.lo.map(|v| v / 2), 60))]);
            // Reading goes on while others load and evict.
            let some = read(&source, 0, area);
            assert!(some.iter().all(|h| h.is_finite() && *h != VOID));
            let c = source.counters();
            assert!(c.resident_bytes <= tiles * TILE_BYTES && c.resident_bytes_max <= tiles * TILE_BYTES);
            if k % 7 == 0 {
                settle(&source, 20);
                if source.is_ready(0, &[area]) {
                    assert_eq!(read(&source, 0, area), read(&memory, 0, area));
                }
            }
        }
        let c = source.counters();
        assert!(c.evicted > 0 && c.limit_bytes == tiles * TILE_BYTES, "{c:?}");
    }
}

#[test]
fn whichever_read_fails_the_samples_are_right_in_the_end() {
    let grid = grid();
    let files = in_memory(&grid, &BuildOptions::default());
    let memory = MemoryPyramid::new(&grid, Prefilter::Subsample);
    let area = rect([100, 100], 400);
    let run = |fail_from: u64, fail_count: u64| {
        let double = Double { fail_from, fail_count, ..Double::of(files.clone()) };
        let (double, store) = double.open();
        let source = source(store, 64, 3);
        source.wish(&[wish(0, area), wish(1, rect([50, 50], 200))]);
        settle(&source, 60);
        assert_eq!(read(&source, 0, area), read(&memory, 0, area), "failing from read {fail_from}");
        let c = source.counters();
        assert_eq!(c.damaged_tiles, 0);
        (double.reads.load(Ordering::SeqCst), c.failed_reads)
    };
    let (reads, _) = run(u64::MAX, 0);
    // The first two reads are those of the top, without which nothing opens. Threads that meet at a shard's
    // index may each read it: a run can have a read more or fewer than another, and be over before its read k.
    let mut reached = 0;
    for k in 2..reads {
        let (asked, failed) = run(k, 1);
        assert!(failed >= 1 || asked <= k, "read {k} of {asked}");
        reached += u64::from(failed >= 1);
    }
    assert!(2 * reached >= reads, "{reached} of {reads}");
    let (_, failed) = run(4, 5);
    assert!(failed >= 5);
    let double = Double { fail_from: 0, fail_count: 1, ..Double::of(files) };
    let (_, store) = double.open();
    let error = TileSource::new(Arc::new(store), StreamOptions::default()).err().expect("refused");
    assert!(error.to_string().contains("nothing coarser"), "{error}");
}

#[test]
fn damaged_tiles_show_their_parent_and_are_counted() {
    let grid = grid();
    let mut files = in_memory(&grid, &BuildOptions::default());
    let memory = MemoryPyramid::new(&grid, Prefilter::Subsample);
    let shard = files.files.get_mut("0/elevation/c/0/0").unwrap();
    shard[1000] ^= 4;
    let source = source(open(files), 64, 2);
    // The first tile of the shard is the north-west one.
    let hit = Rect { lo: [0, 1099 - 255], hi: [255, 1099] };
    source.wish(&[wish(0, hit), wish(1, Rect { lo: [0, 400], hi: [130, 549] })]);
    settle(&source, 20);
    let c = source.counters();
    assert_eq!((c.damaged_tiles, c.failed_reads), (1, 1));
    assert!(source.is_ready(0, &[hit]), "the parent stands in");
    for (k, h) in read(&source, 0, hit).iter().enumerate() {
        let p = [k as i32 % 256, hit.lo[1] + k as i32 / 256];
        let odd = [0, 1].map(|a| p[a] % 2 == 1 && p[a] != [1299, 1099][a]).map(i32::from);
        let low = [0, 1].map(|a| (p[a] - odd[a] + 1) / 2);
        let a = memory.sample(1, [low[0] + odd[0], low[1]]);
        let b = memory.sample(1, [low[0], low[1] + odd[1]]);
        assert_eq!(*h, (a + b) * 0.5, "{p:?}");
    }
}

#[test]
fn a_place_that_can_never_be_read_shows_its_parent_in_the_end() {
    let grid = grid();
    let files = in_memory(&grid, &BuildOptions::default());
    // The first tile of the first shard lies at its beginning.
    let double = Double { bad_place: Some(("0/elevation/c/0/0", 0)), ..Double::of(files) };
    let (_, store) = double.open();
    let source = source(store, 64, 2);
    let hit = Rect { lo: [0, 1099 - 255], hi: [255, 1099] };
    source.wish(&[wish(0, hit)]);
    settle(&source, 60);
    assert!(source.is_ready(0, &[hit]), "something stands in");
    let c = source.counters();
    assert_eq!(c.damaged_tiles, 1);
    assert!(c.failed_reads >= 6, "{c:?}");
}

#[test]
fn files_cut_replaced_or_removed_under_us_show_coarser_levels_and_are_counted() {
    let grid = grid();
    let memory = MemoryPyramid::new(&grid, Prefilter::Subsample);
    let all = Rect { lo: [0, 0], hi: [1299, 1099] };
    for harm in ["cut", "replaced", "removed", "rebuilt"] {
        let dir = tempfile::tempdir().unwrap();
        let at = dir.path().join("t.zarr");
        common::stores::built(&grid, &at, &BuildOptions::default());
        let source = source(Store::open(&at).unwrap(), 64, 2);
        let shard = at.join("0/elevation/c/0/0");
        match harm {
            "cut" => std::fs::File::options().write(true).open(&shard).unwrap().set_len(5_000).unwrap(),
            "replaced" => std::fs::write(&shard, vec![7; 100_000]).unwrap(),
            "removed" => std::fs::remove_dir_all(&at).unwrap(),
            _ => {
                // Another terrain under the same name: nothing of it may be drawn as this one.
                let other = common::terrain("procedural:dunes?width=1300&height=1100");
                common::stores::built(
                    &other,
                    &at,
                    &BuildOptions { overwrite: true, ..BuildOptions::default() },
                );
            }
        }
        source.wish(&[wish(0, all), wish(1, Rect { lo: [0, 0], hi: [649, 549] })]);
        settle(&source, 60);
        let c = source.counters();
        assert!(c.damaged_tiles >= 15 && c.failed_reads >= c.damaged_tiles, "{harm}: {c:?}");
        assert!(source.is_ready(0, &[all]));
        let [low, high] = memory.height_range().unwrap();
        let heights = read(&source, 0, all);
        assert!(heights.iter().all(|h| (low..=high).contains(h)), "{harm}: a height from nowhere");
        // Nodes of the top level are those of this terrain.
        let step = 1 << source.store().top();
        for y in (0..1100).step_by(step) {
            for x in (0..1300).step_by(step) {
                assert_eq!(heights[y * 1300 + x], memory.sample(0, [x as i32, y as i32]), "{harm}");
            }
        }
    }
}

#[test]
fn late_and_reordered_loads_never_show_a_wrong_place() {
    let grid = grid();
    let memory = MemoryPyramid::new(&grid, Prefilter::Subsample);
    let double =
        Double { jitter: Duration::from_millis(3), ..Double::of(in_memory(&grid, &BuildOptions::default())) };
    let (_, store) = double.open();
    let source = source(store, 6, 8);
    for k in 0..400_i32 {
        let area = rect([(k * 211) % 1200, (k * 397) % 1000], 90);
        source.wish(&[wish(0, area), wish(1, rect(area.lo.map(|v| v / 2), 45))]);
        if k % 3 == 0 {
            std::thread::sleep(Duration::from_micros(700));
        }
        for level in [0, 1] {
            let asked = rect(area.lo.map(|v| v >> level), 90 >> level);
            if source.is_ready(level, &[asked]) {
                // Between the two calls nothing wanted may be evicted.
                assert_eq!(read(&source, level, asked), read(&memory, level, asked), "step {k}");
            }
        }
    }
    settle(&source, 20);
    let c = source.counters();
    eprintln!("{c:?}");
    assert!(c.cancelled > 0 && c.stale_loads > 0, "the test was too tame: {c:?}");
    assert!(c.resident_bytes_max <= 6 * TILE_BYTES);
}

#[test]
fn wishes_never_wait_for_a_slow_disk() {
    let double =
        Double { delay: Duration::from_secs(1), ..Double::of(in_memory(&grid(), &BuildOptions::default())) };
    let (_, store) = double.open();
    let source = source(store, 64, 4);
    let begin = Instant::now();
    for k in 0..200 {
        let area = rect([k * 4, k * 3], 127);
        source.wish(&[wish(0, area)]);
        let _ = source.is_ready(0, &[area]);
        let _ = read(&source, 0, area);
    }
    // 200 frames; a single read takes a second. Not a timing but an order of magnitude.
    assert!(begin.elapsed() < Duration::from_millis(900), "{:?}", begin.elapsed());
}
