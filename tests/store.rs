//! Stores hold what went in: every sample of every level, within the loss that was allowed, for any reader.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use common::stores::{built, in_memory, open};
use tessclip::clipmap::{Lattice, Rect};
use tessclip::heights::{GridSource, HeightGrid, Mosaic, RasterSource, ReadOptions, open_raster};
use tessclip::pyramid::store::{BuildOptions, Codec, Dtype, Progress, Store, TileKey, build};
use tessclip::pyramid::{MemoryPyramid, Prefilter, SampleSource, VOID};

fn options(codec: Codec) -> BuildOptions {
    BuildOptions { codec, ..BuildOptions::default() }
}

/// Samples of a level of a store and of the pyramid in memory.
fn levels(store: &Store, memory: &MemoryPyramid, level: u32) -> (Vec<f32>, Vec<f32>) {
    let whole = Rect { lo: [0, 0], hi: store.lattice().last_at(level) };
    let (mut stored, mut wanted) = (Vec::new(), Vec::new());
    store.read_rect(level, whole, &mut stored).unwrap();
    memory.read(level, whole, &mut wanted);
    (stored, wanted)
}

/// A grid with voids in odd places: whole rows, single samples, a corner.
fn holed(mut grid: HeightGrid) -> HeightGrid {
    let (w, h) = (grid.width, grid.height);
    let void = |x: usize, y: usize| {
        (x * 7 + y * 13).is_multiple_of(97) || y == h / 3 || (x > w - 40 && y > h - 50) || (x == 0 && y == 0)
    };
    grid.valid = Some((0..w * h).map(|i| !void(i % w, i / w)).collect());
    grid
}

#[test]
fn every_sample_of_every_level_is_what_the_pyramid_in_memory_has() {
    for (width, height) in [(2, 2), (256, 256), (257, 1030), (1300, 700)] {
        let grid = common::terrain(&format!("procedural:mountains?width={width}&height={height}"));
        for grid in [grid.clone(), holed(grid)] {
            for codec in [Codec::Blosc, Codec::Pcodec] {
                for prefilter in [Prefilter::Subsample, Prefilter::LowPass] {
                    let built = in_memory(&grid, &BuildOptions { prefilter, ..options(codec) });
                    let store = open(built);
                    let memory = MemoryPyramid::new(&grid, prefilter);
                    assert_eq!(store.lattice(), memory.lattice());
                    for level in 0..=store.top() {
                        let (stored, wanted) = levels(&store, &memory, level);
                        let bits = |v: &[f32]| v.iter().map(|h| h.to_bits()).collect::<Vec<_>>();
                        assert!(
                            bits(&stored) == bits(&wanted),
                            "{width} {height} {codec} {prefilter} {level}"
                        );
                    }
                    let range = memory.height_range();
                    assert_eq!(store.manifest().range_m, range);
                    let voids = grid.valid.as_ref().map_or(0, |v| v.iter().filter(|v| !**v).count());
                    assert_eq!(store.void_count(), voids as u64);
                }
            }
        }
    }
}

/// A source of the given type over a grid of whole metres.
struct Typed(GridSource, tessclip::heights::RasterHeader);

impl Typed {
    fn new(grid: HeightGrid, dtype: &'static str) -> Self {
        let source = GridSource::new(grid);
        let header = tessclip::heights::RasterHeader { dtype, ..source.header().clone() };
        Self(source, header)
    }
}

impl RasterSource for Typed {
    fn header(&self) -> &tessclip::heights::RasterHeader {
        &self.1
    }
    fn read(
        &self,
        at: [u64; 2],
        size: [usize; 2],
        out: &mut [f32],
    ) -> Result<(), tessclip::heights::HeightError> {
        self.0.read(at, size, out)
    }
}

fn whole_metres(size: usize, low: f32, high: f32) -> HeightGrid {
    let at = |i: usize| (low + (high - low) * (i * 7919 % 1009) as f32 / 1008.0).round();
    HeightGrid::new(size, size, (0..size * size).map(at).collect()).unwrap()
}

fn build_typed(source: &Typed, options: &BuildOptions) -> Store {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path().join("t.zarr");
    build(source, &at, options, &Progress::default()).unwrap();
    open(tessclip::pyramid::store::InMemory::from_folder(&at).unwrap())
}

#[test]
fn integers_stay_integers_unless_a_height_is_the_mark_for_voids() {
    let cases = [
        ("int16", whole_metres(300, -32_767.0, 32_767.0), Dtype::Int16),
        ("int16", whole_metres(300, -32_768.0, 100.0), Dtype::Float32),
        ("uint16", whole_metres(300, 0.0, 65_534.0), Dtype::Uint16),
        ("uint16", whole_metres(300, 0.0, 65_535.0), Dtype::Float32),
        ("byte", whole_metres(300, 0.0, 255.0), Dtype::Int16),
    ];
    for (dtype, grid, wanted) in cases {
        for grid in [grid.clone(), holed(grid)] {
            let store = build_typed(&Typed::new(grid.clone(), dtype), &BuildOptions::default());
            assert_eq!(store.manifest().dtype, wanted, "{dtype}");
            let memory = MemoryPyramid::new(&grid, Prefilter::Subsample);
            for level in 0..=store.top() {
                let (stored, wanted) = levels(&store, &memory, level);
                assert!(stored == wanted, "{dtype} {level}");
            }
        }
    }
}

#[test]
fn no_sample_moves_by_more_than_was_allowed() {
    let rough = holed(common::terrain("procedural:mountains?size=600"));
    let mut extreme = common::terrain("procedural:spikes?size=300&amp=1e9");
    for (i, h) in extreme.heights_m.iter_mut().enumerate() {
        *h = [*h, 1e-30, -1e12, 3.402e38, 0.1, -7.3][i % 6];
    }
    for max_error_m in [0.001, 0.01, 0.3, 0.5, 1.0, 2.5, 100.0] {
        for codec in [Codec::Blosc, Codec::Pcodec] {
            let allowed = BuildOptions { max_error_m, ..options(codec) };
            for grid in [&rough, &extreme] {
                let store = open(in_memory(grid, &allowed));
                let (stored, wanted) = levels(&store, &MemoryPyramid::new(grid, Prefilter::Subsample), 0);
                let mut moved = 0;
                for (a, b) in stored.iter().zip(&wanted) {
                    assert_eq!(*a == VOID, *b == VOID);
                    assert!((f64::from(*a) - f64::from(*b)).abs() <= max_error_m, "{a} {b} {max_error_m}");
                    moved += usize::from(a != b);
                }
                assert!(moved > 0, "{max_error_m} m bring nothing");
            }
        }
        // Integers at both ends of their range must neither overflow nor become voids.
        let whole = whole_metres(300, -32_767.0, 32_767.0);
        let allowed = BuildOptions { max_error_m, ..BuildOptions::default() };
        let store = build_typed(&Typed::new(whole.clone(), "int16"), &allowed);
        let (stored, wanted) = levels(&store, &MemoryPyramid::new(&whole, Prefilter::Subsample), 0);
        let worst = stored.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(f64::from(worst) <= max_error_m, "{worst}");
    }
    let wrong = BuildOptions { max_error_m: -1.0, ..BuildOptions::default() };
    let dir = tempfile::tempdir().unwrap();
    let source = GridSource::new(rough);
    assert!(build(&source, &dir.path().join("t.zarr"), &wrong, &Progress::default()).is_err());
}

#[test]
fn figures_of_tiles_are_those_of_their_samples() {
    let grid = holed(common::terrain("procedural:mountains?width=1100&height=790"));
    let store = open(in_memory(&grid, &BuildOptions::default()));
    let memory = MemoryPyramid::new(&grid, Prefilter::Subsample);
    let lattice: Lattice = memory.lattice();
    for level in 0..=store.top() {
        let last = lattice.last_at(level);
        let [across, down] = store.tiles(level);
        let mut worst = vec![0.0_f32; (across * down) as usize];
        let tile_of = |x: i32, y: i32| ((last[1] - y) / 256 * across as i32 + x / 256) as usize;
        if level > 0 {
            // The naive way: every finer node, on whichever triangle of ours it lies.
            let fine = lattice.last_at(level - 1);
            for y in 0..=fine[1] {
                for x in 0..=fine[0] {
                    let odd = [x % 2 == 1 && x != fine[0], y % 2 == 1 && y != fine[1]].map(i32::from);
                    let low = [(x - odd[0] + 1) / 2, (y - odd[1] + 1) / 2];
                    let a = memory.sample(level, [low[0] + odd[0], low[1]]);
                    let b = memory.sample(level, [low[0], low[1] + odd[1]]);
                    let h = memory.sample(level - 1, [x, y]);
                    if a != VOID && b != VOID && h != VOID {
                        let tile = tile_of(low[0], low[1]);
                        worst[tile] = worst[tile].max(((a + b) * 0.5 - h).abs());
                    }
                }
            }
        }
        let mut found = vec![(f32::NAN, f32::NAN, 0.0_f64, 0_u32, 0_u32); (across * down) as usize];
        for y in 0..=last[1] {
            for x in 0..=last[0] {
                let one = &mut found[tile_of(x, y)];
                let h = memory.sample(level, [x, y]);
                if h == VOID {
                    one.4 += 1;
                } else {
                    *one = (one.0.min(h), one.1.max(h), one.2 + f64::from(h), one.3 + 1, one.4);
                }
            }
        }
        for row in 0..down {
            for column in 0..across {
                let stats = store.stats(TileKey { level, column, row });
                let (min, max, sum, count, voids) = found[(row * across + column) as usize];
                assert_eq!((stats.min_m, stats.max_m, stats.voids), (min, max, voids));
                let mean = sum / f64::from(count);
                assert!((f64::from(stats.mean_m) - mean).abs() < 1e-3, "{} {mean}", stats.mean_m);
                let wanted = worst[(row * across + column) as usize];
                assert_eq!(stats.error_m, wanted, "level {level} tile {column} {row}");
            }
        }
    }
}

#[test]
fn tiles_of_a_survey_join_without_a_seam() {
    // Four quarters that share their middle row and column, in an odd order, make the whole again.
    let whole = common::terrain("procedural:mountains?size=601");
    let cut = |at: [usize; 2], size: [usize; 2]| {
        let rows = (0..size[1]).flat_map(|y| {
            let from = (at[1] + y) * 601 + at[0];
            whole.heights_m[from..from + size[0]].to_vec()
        });
        let mut part = HeightGrid::new(size[0], size[1], rows.collect()).unwrap();
        part.spacing_m = whole.spacing_m;
        part.origin_m = [0, 1].map(|a| whole.origin_m[a] + at[a] as f64 * whole.spacing_m[a]);
        part.georeference.georeferenced = true;
        (format!("{at:?}"), GridSource::new(part))
    };
    let mut parts: BTreeMap<String, GridSource> = [
        cut([300, 200], [301, 401]),
        cut([0, 0], [301, 201]),
        cut([0, 200], [301, 401]),
        cut([300, 0], [301, 201]),
    ]
    .into();
    let mut part = common::terrain("procedural:plain?size=10");
    part.origin_m = [whole.spacing_m[0] * 0.5, 0.0];
    part.georeference.georeferenced = true;
    parts.insert("the odd one".into(), GridSource::new(part));
    let join = |names: &[&str]| {
        let parts = parts.clone();
        let names: Vec<String> = names.iter().map(|n| (*n).to_string()).collect();
        Mosaic::new(&names, Box::new(move |name| Ok(Box::new(parts[name].clone()))))
    };
    let four = ["[300, 200]", "[0, 0]", "[0, 200]", "[300, 0]"];
    let mosaic = join(&four).unwrap();
    assert_eq!((mosaic.header().width, mosaic.header().height), (601, 601));
    let mut all = vec![0.0; 601 * 601];
    mosaic.read([0, 0], [601, 601], &mut all).unwrap();
    assert_eq!(all, whole.heights_m);
    // A gap is void, not zero.
    let mosaic = join(&four[1..]).unwrap();
    mosaic.read([0, 0], [601, 601], &mut all).unwrap();
    assert!(all[600 * 601 + 600].is_nan());
    // What does not fit is refused by name.
    let error = join(&[four[0], "the odd one"]).err().expect("refused").to_string();
    assert!(error.contains("the odd one") && error.contains("cells"), "{error}");
}

#[test]
fn adjacent_srtm_tiles_become_one_store() {
    let (Some(west), Some(east)) = (common::data("srtm/N49W124.tif"), common::data("srtm/N49W123.tif"))
    else {
        return;
    };
    let opener = Box::new(|name: &str| open_raster(name, &ReadOptions::default()));
    let mosaic = Mosaic::new(&[east.clone(), west.clone()], opener).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path().join("t.zarr");
    build(&mosaic, &at, &BuildOptions::default(), &Progress::default()).unwrap();
    let store = Store::open(&at).unwrap();
    assert_eq!(store.lattice().last, [2400, 1200]);
    assert_eq!(store.manifest().dtype, Dtype::Int16);
    let grid = store.to_grid(1 << 28).unwrap();
    assert_eq!(grid.bounds().map(|v| (v * 1e6).round() / 1e6), [-124.0, 49.0, -122.0, 50.0]);
    for (name, offset) in [(&west, 0), (&east, 1200)] {
        let one = common::terrain(name);
        for y in 0..1201 {
            for x in 0..1201 {
                let (a, b) = (y * 1201 + x, y * 2401 + x + offset);
                let valid = one.valid.as_ref().is_none_or(|v| v[a]);
                // Where one tile has a void on the shared column, the other may know better.
                let shared = x == if offset == 0 { 1200 } else { 0 };
                let known = grid.valid.as_ref().is_none_or(|v| v[b]);
                assert!(known == valid || (shared && known), "{x} {y}");
                assert!(!valid || grid.heights_m[b] == one.heights_m[a], "{x} {y}");
            }
        }
    }
}

/// Bytes of a GeoTIFF with deflate and predictor 2 of the same samples, in strips of 8 kB as GDAL makes them.
fn deflated(heights: &[f32], width: usize, dtype: Dtype) -> u64 {
    use tiff::encoder::{Compression, Predictor, TiffEncoder, colortype, compression::DeflateLevel};
    let mut out = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut out)
        .unwrap()
        .with_compression(Compression::Deflate(DeflateLevel::Balanced))
        .with_predictor(Predictor::Horizontal);
    let size = [width, heights.len() / width].map(|v| u32::try_from(v).unwrap());
    let rows = u32::try_from((8192 / (width * dtype.bytes())).max(1)).unwrap();
    // Levels are rows from the south here; compression does not care.
    if dtype == Dtype::Int16 {
        let whole: Vec<i16> = heights.iter().map(|h| if *h == VOID { i16::MIN } else { *h as i16 }).collect();
        let mut image = encoder.new_image::<colortype::GrayI16>(size[0], size[1]).unwrap();
        image.rows_per_strip(rows).unwrap();
        image.write_data(&whole).unwrap();
    } else {
        // As integers of the same bits: predictor 2 works on those.
        let bits: Vec<u32> = heights.iter().map(|h| h.to_bits()).collect();
        let mut image = encoder.new_image::<colortype::Gray32>(size[0], size[1]).unwrap();
        image.rows_per_strip(rows).unwrap();
        image.write_data(&bits).unwrap();
    }
    out.into_inner().len() as u64
}

#[test]
fn stores_are_no_larger_than_deflated_geotiffs_of_the_same_samples() {
    let files = ["srtm/S33W071.tif", "srtm/N46E008.tif", "srtm/N49W124.tif", "etopo/etopo5_int16.tif"];
    let mut specs: Vec<String> = files.iter().filter_map(|f| common::data(f)).collect();
    specs.push("procedural:mountains?size=1500".into());
    for spec in specs {
        let source = open_raster(&spec, &ReadOptions::default()).unwrap();
        let dir = tempfile::tempdir().unwrap();
        let mut bytes = Vec::new();
        let mut reference = 0;
        for codec in [Codec::Blosc, Codec::Pcodec] {
            let at = dir.path().join(format!("{codec}.zarr"));
            let summary = build(source.as_ref(), &at, &options(codec), &Progress::default()).unwrap();
            // Deviations of blocks are no samples.
            let files = summary.manifest.files.iter();
            let beside: u64 = files.filter(|(f, _)| f.contains("/deviations/")).map(|(_, w)| w.bytes).sum();
            bytes.push((summary.bytes - beside) as f64);
            if codec == Codec::Blosc {
                let store = Store::open(&at).unwrap();
                for level in 0..=store.top() {
                    let last = store.lattice().last_at(level);
                    let mut heights = Vec::new();
                    store.read_rect(level, Rect { lo: [0, 0], hi: last }, &mut heights).unwrap();
                    reference += deflated(&heights, last[0] as usize + 1, store.manifest().dtype);
                }
            }
        }
        let share = |b: f64| b / reference as f64;
        eprintln!(
            "{spec}: blosc {:.3}, pcodec {:.3} of deflate + predictor 2",
            share(bytes[0]),
            share(bytes[1])
        );
        assert!(share(bytes[0]) <= 1.0 && share(bytes[1]) <= 0.8, "{spec}");
    }
}

#[test]
fn zarr_python_reads_the_same_samples() {
    let script = r"
import json, sys, numpy, zarr
group = zarr.open_group(sys.argv[1], mode='r')
out = {}
for level in range(int(sys.argv[2])):
    a = group[f'{level}/elevation']
    v = a[:]
    fill = a.fill_value
    void = numpy.isnan(v) if v.dtype.kind == 'f' else v == fill
    w = numpy.where(void, 0, v).astype('f8')
    rows, cols = numpy.indices(v.shape)
    weight = (rows * 31 + cols * 17) % 1009
    out[level] = [list(v.shape), int(void.sum()), float((w * weight).sum()), float(w[0, 0]), float(w[-1, -1])]
    assert group[f'{level}/tiles'].shape[2] == 5
layout = group.attrs['multiscales']['layout']
assert len(layout) == int(sys.argv[2]), layout
print(json.dumps(out))
";
    let python = std::env::var("TESSCLIP_PYTHON").unwrap_or_else(|_| "python3".into());
    let has = |module: &str| {
        let found = Command::new(&python).args(["-c", &format!("import {module}")]).output();
        found.is_ok_and(|o| o.status.success())
    };
    if !has("zarr") {
        assert!(std::env::var_os("CI").is_none(), "CI must have a foreign reader: pip install zarr pcodec");
        eprintln!(
            "SKIPPED: {python} has no zarr (pip install zarr pcodec, or name another with TESSCLIP_PYTHON)"
        );
        return;
    }
    let grid = holed(common::terrain("procedural:mountains?width=1100&height=700"));
    let whole = holed(whole_metres(530, -900.0, 4000.0));
    let dir = tempfile::tempdir().unwrap();
    for codec in [Codec::Blosc, Codec::Pcodec] {
        if codec == Codec::Pcodec && !has("pcodec") {
            eprintln!("SKIPPED: {python} has no pcodec");
            continue;
        }
        let at = dir.path().join(format!("{codec}.zarr"));
        let typed = dir.path().join(format!("{codec}-int.zarr"));
        built(&grid, &at, &options(codec));
        build(&Typed::new(whole.clone(), "int16"), &typed, &options(codec), &Progress::default()).unwrap();
        for (at, grid) in [(&at, &grid), (&typed, &whole)] {
            let store = Store::open(at).unwrap();
            let count = (store.top() + 1).to_string();
            let run = Command::new(&python).args(["-c", script]).arg(at).arg(&count).output().unwrap();
            assert!(run.status.success(), "{codec}: {}", String::from_utf8_lossy(&run.stderr));
            let theirs: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
            compare(&theirs, &store, &MemoryPyramid::new(grid, Prefilter::Subsample), at);
        }
    }
}

/// Sums of a foreign reader against ours.
fn compare(theirs: &serde_json::Value, store: &Store, memory: &MemoryPyramid, at: &Path) {
    for level in 0..=store.top() {
        let [shape, voids, sum, first, last] = [0, 1, 2, 3, 4].map(|k| &theirs[level.to_string()][k]);
        let end = store.lattice().last_at(level);
        assert_eq!(shape, &serde_json::json!([end[1] + 1, end[0] + 1]));
        let (mut our_voids, mut our_sum) = (0, 0.0);
        for row in 0..=end[1] {
            for column in 0..=end[0] {
                // Their rows count from the north.
                let h = memory.sample(level, [column, end[1] - row]);
                if h == VOID {
                    our_voids += 1;
                } else {
                    our_sum += f64::from(h) * f64::from((row * 31 + column * 17) % 1009);
                }
            }
        }
        let or_zero = |h: f32| if h == VOID { 0.0 } else { f64::from(h) };
        assert_eq!(voids.as_i64(), Some(our_voids), "{}", at.display());
        assert_eq!(first.as_f64(), Some(or_zero(memory.sample(level, [0, end[1]]))));
        assert_eq!(last.as_f64(), Some(or_zero(memory.sample(level, [end[0], 0]))));
        let difference = (sum.as_f64().unwrap() - our_sum).abs();
        assert!(difference <= 1e-9 * our_sum.abs() + 1e-6, "{}: {sum} {our_sum}", at.display());
    }
}
