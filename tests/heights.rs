//! The elevation layer against hand-made files and, where present, the shared test data.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use proptest::prelude::*;
use tessclip::heights::{
    HeightError, HeightGrid, NodataPolicy, Procedural, ProceduralKind, ReadOptions, open_file, open_terrain,
};
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

fn shared_data() -> Option<PathBuf> {
    let dir = std::env::var_os("TESSCLIP_DATA")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")), PathBuf::from);
    if dir.is_dir() {
        return Some(dir);
    }
    eprintln!("SKIPPED: shared data absent");
    None
}

fn read(path: &Path) -> HeightGrid {
    open_file(path, &ReadOptions::default()).unwrap()
}

/// Height at a row counted from the north, as the catalogue counts.
fn north(grid: &HeightGrid, row: usize, col: usize) -> f32 {
    grid.heights_m[(grid.height - 1 - row) * grid.width + col]
}

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b}");
}

// ---- hand-made files ----

/// A 3 x 2 int16 GeoTIFF; row 0 of the file is 1 2 3, row 1 is 4 5 -9 with -9 void.
fn tiny_tiff(dir: &Path, keys: &[u16], scale: &[f64]) -> PathBuf {
    let path = dir.join("tiny.tif");
    let mut encoder = TiffEncoder::new(fs::File::create(&path).unwrap()).unwrap();
    let mut image = encoder.new_image::<colortype::GrayI16>(3, 2).unwrap();
    let directory = image.encoder();
    if !scale.is_empty() {
        directory.write_tag(Tag::ModelPixelScaleTag, scale).unwrap();
        let tie = [0.0, 0.0, 0.0, 100.0, 50.0, 0.0];
        directory.write_tag(Tag::ModelTiepointTag, &tie[..]).unwrap();
    }
    directory.write_tag(Tag::GeoKeyDirectoryTag, keys).unwrap();
    directory.write_tag(Tag::GdalNodata, "-9").unwrap();
    image.write_data(&[1, 2, 3, 4, 5, -9]).unwrap();
    path
}

const UTM: [u16; 12] = [1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32611];

#[test]
fn tiny_tiff_is_flipped_placed_and_masked() {
    let dir = tempfile::tempdir().unwrap();
    let grid = read(&tiny_tiff(dir.path(), &UTM, &[10.0, 20.0, 0.0]));
    assert_eq!(grid.heights_m, [4.0, 5.0, 0.0, 1.0, 2.0, 3.0]);
    assert_eq!(grid.valid.as_deref(), Some(&[true, true, false, true, true, true][..]));
    assert_eq!((grid.dtype, grid.format), ("int16", "GeoTIFF"));
    assert_eq!(grid.georeference.crs.as_deref(), Some("EPSG:32611"));
    assert_eq!(grid.spacing_m, [10.0, 20.0]);
    assert_eq!(grid.origin_m, [105.0, 20.0]);
    assert_eq!(grid.bounds(), [105.0, 20.0, 125.0, 40.0]);
    assert_eq!(grid.min_max_mean(), Some((1.0, 5.0, 3.0)));
    assert_eq!(grid.void_count(), 1);
    let filled = grid.with_nodata(NodataPolicy::Fill);
    assert_eq!(filled.valid, None);
    assert!((1.0..=5.0).contains(&filled.heights_m[2]));
}

#[test]
fn feet_points_and_z_options() {
    let dir = tempfile::tempdir().unwrap();
    let keys = [1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 2, 3076, 0, 1, 9002, 4099, 0, 1, 9002];
    let path = tiny_tiff(dir.path(), &keys, &[10.0, 10.0, 0.0]);
    let options = ReadOptions { z_scale: Some(2.0), z_offset: Some(100.0), ..ReadOptions::default() };
    let grid = open_file(&path, &options).unwrap();
    close(grid.spacing_m[0], 3.048, 1e-12);
    close(grid.origin_m[0], 30.48, 1e-9);
    close(grid.origin_m[1], 12.192, 1e-9);
    close(f64::from(grid.heights_m[0]), 4.0 * 0.6096 + 100.0, 1e-4);
    assert!(grid.georeference.pixel_is_point);
}

#[test]
fn spacing_is_for_files_without_one() {
    let dir = tempfile::tempdir().unwrap();
    let spaced = ReadOptions { spacing_m: Some(7.0), ..ReadOptions::default() };
    let placed = tiny_tiff(dir.path(), &UTM, &[10.0, 20.0, 0.0]);
    let refused = open_file(&placed, &spaced);
    assert!(matches!(refused, Err(HeightError::AlreadyGeoreferenced { .. })));
    let bare = tiny_tiff(dir.path(), &UTM, &[]);
    let grid = open_file(&bare, &spaced).unwrap();
    assert!(!grid.georeference.georeferenced);
    assert_eq!((grid.spacing_m, grid.origin_m), ([7.0; 2], [0.0; 2]));
    assert_eq!(read(&bare).spacing_m, [1.0; 2]);
    let small = ReadOptions { max_samples: 5, ..ReadOptions::default() };
    assert!(matches!(open_file(&bare, &small), Err(HeightError::TooLarge { .. })));
}

#[test]
fn hand_made_hgt() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("S01W072.hgt");
    let bytes: Vec<u8> = [1_i16, 2, -32768, 4].iter().flat_map(|v| v.to_be_bytes()).collect();
    fs::write(&path, &bytes).unwrap();
    let grid = read(&path);
    assert_eq!(grid.heights_m, [0.0, 4.0, 1.0, 2.0]);
    assert_eq!(grid.void_count(), 1);
    assert_eq!(grid.bounds(), [-72.0, -1.0, -71.0, 0.0]);
    let native = grid.world_to_native(grid.origin_m);
    close(native[0], -72.0, 1e-12);
    close(grid.native_to_world([-72.0, -1.0])[1], grid.origin_m[1], 1e-9);
    let misnamed = dir.path().join("tile.hgt");
    fs::write(&misnamed, &bytes).unwrap();
    let bad = |p: &Path| open_file(p, &ReadOptions::default()).unwrap_err();
    assert!(matches!(bad(&misnamed), HeightError::HgtName { .. }));
    fs::write(&path, &bytes[..6]).unwrap();
    assert!(matches!(bad(&path), HeightError::HgtSize { .. }));
    fs::write(&path, &bytes[..2]).unwrap();
    assert!(matches!(bad(&path), HeightError::TooSmall { .. }));
}

#[test]
fn hand_made_png() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("grey.png");
    let image = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(2, 2, vec![1, 2, 3, 60000]);
    image.unwrap().save(&path).unwrap();
    let grid = read(&path);
    assert_eq!(grid.heights_m, [3.0, 60000.0, 1.0, 2.0]);
    assert_eq!((grid.dtype, grid.valid), ("uint16", None));
    image::RgbImage::new(2, 2).save(&path).unwrap();
    let error = open_file(&path, &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("8-bit RGB is an image, not elevation"));
}

#[test]
fn things_that_are_no_terrain() {
    let dir = tempfile::tempdir().unwrap();
    let options = ReadOptions::default();
    let bad = |p: &Path| open_file(p, &options).unwrap_err();
    assert!(matches!(bad(&dir.path().join("none.tif")), HeightError::NotFound { .. }));
    assert!(matches!(bad(dir.path()), HeightError::NotAFile { .. }));
    let path = dir.path().join("a.xyz");
    fs::write(&path, "").unwrap();
    assert!(matches!(bad(&path), HeightError::Empty { .. }));
    fs::write(&path, "hello").unwrap();
    assert!(matches!(bad(&path), HeightError::UnknownFormat { .. }));
    for (spec, word) in [
        ("procedural:hills", "mountains, dunes, plain"),
        ("procedural:plain?colour=1", "seed, size"),
        ("procedural:plain?size=1", "at least 2"),
        ("procedural:plain?spacing=-3", "positive"),
        ("procedural:plain?size=100000", "limit of 268435456"),
    ] {
        let error = open_terrain(spec, &options).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
    assert!(HeightGrid::new(2, 2, vec![0.0; 3]).is_err());
    assert!(HeightGrid::new(1, 3, vec![0.0; 3]).is_err());
    assert_eq!(HeightGrid::new(2, 2, vec![f32::NAN; 4]).unwrap().min_max_mean(), None);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn a_damaged_tiff_never_panics(
        hits in proptest::collection::vec((0_usize..400, any::<u8>()), 1..6),
        keep in 8_usize..400,
    ) {
        let dir = tempfile::tempdir().unwrap();
        let path = tiny_tiff(dir.path(), &UTM, &[10.0, 20.0, 0.0]);
        let mut bytes = fs::read(&path).unwrap();
        for (at, value) in hits {
            let at = at % bytes.len();
            bytes[at] = value;
        }
        if keep % 3 == 0 {
            bytes.truncate(keep);
        }
        fs::write(&path, &bytes).unwrap();
        let _ = open_file(&path, &ReadOptions { max_samples: 1 << 16, ..ReadOptions::default() });
    }

    #[test]
    fn filling_keeps_valid_samples_and_the_range(
        (width, heights) in (2_usize..20, 2_usize..20).prop_flat_map(|(w, h)| {
            let height = prop_oneof![-500.0_f32..500.0, Just(f32::NAN)];
            (Just(w), proptest::collection::vec(height, w * h))
        }),
    ) {
        let grid = HeightGrid::new(width, heights.len() / width, heights.clone()).unwrap();
        let range = grid.min_max_mean();
        let filled = grid.with_nodata(NodataPolicy::Fill);
        prop_assert!(filled.valid.is_none());
        for (before, after) in heights.iter().zip(&filled.heights_m) {
            if before.is_finite() {
                prop_assert_eq!(before.to_bits(), after.to_bits());
            }
            match range {
                Some((low, high, _)) => prop_assert!((low..=high).contains(after)),
                None => prop_assert_eq!(*after, 0.0),
            }
        }
    }
}

// ---- procedural ----

#[test]
fn procedural_samples_stand_alone() {
    for kind in ProceduralKind::ALL {
        let recipe = Procedural { width: 65, height: 40, ..Procedural::new(kind) };
        let grid = recipe.to_grid().unwrap();
        assert_eq!(grid.heights_m, recipe.to_grid().unwrap().heights_m);
        let wider = Procedural { width: 90, height: 55, ..recipe.clone() };
        for j in 0..40 {
            for i in 0..65 {
                let h = recipe.height_m(i, j);
                assert_eq!(h.to_bits(), grid.heights_m[(j * 65 + i) as usize].to_bits());
                // The cliff stands in the middle of the grid, wherever that is.
                if kind != ProceduralKind::Cliff {
                    assert_eq!(h.to_bits(), wider.height_m(i, j).to_bits());
                }
            }
        }
        for far in [i64::MIN, -1, i64::MAX] {
            assert!(recipe.height_m(far, far).is_finite());
        }
    }
}

#[test]
fn procedural_shapes() {
    let open = |spec: &str| open_terrain(spec, &ReadOptions::default()).unwrap();
    let range = |spec: &str| open(spec).min_max_mean().unwrap();
    assert_eq!(range("procedural:plain?size=33"), (0.0, 0.0, 0.0));
    assert_eq!(range("procedural:cliff?size=32"), (0.0, 1000.0, 500.0));
    assert_eq!(range("procedural:checkerboard?size=32&amp=7"), (-7.0, 7.0, 0.0));
    let (low, high, mean) = range("procedural:spikes?size=256");
    assert_eq!((low, high), (0.0, 1000.0));
    assert!((0.2..4.0).contains(&mean), "{mean}");
    let (low, high, mean) = range("procedural:dunes?width=300&height=200&seed=9");
    assert!(low >= 0.0 && (30.0..160.0).contains(&high), "{low} {high} {mean}");
    for seed in 1..4 {
        let spec = format!("procedural:mountains?size=400&spacing=80&seed={seed}");
        let (low, high, mean) = range(&spec);
        eprintln!("{spec}: {low} {high} {mean}");
        assert!((0.0..300.0).contains(&low) && (2000.0..4000.0).contains(&high));
        assert!((400.0..1800.0).contains(&mean));
    }
}

// ---- shared data ----

#[test]
fn srtm_tiles() {
    let Some(dir) = shared_data() else { return };
    let corners = |name: &str, values: [f32; 5], (top, row, col): (f32, usize, usize), voids: u64| {
        let grid = read(&dir.join("srtm").join(name));
        assert_eq!((grid.width, grid.height, grid.dtype), (1201, 1201, "int16"));
        let found = [(0, 0), (0, 1200), (1200, 0), (1200, 1200), (600, 600)];
        assert_eq!(found.map(|(r, c)| north(&grid, r, c)), values, "{name}");
        assert_eq!(north(&grid, row, col), top);
        assert_eq!(grid.min_max_mean().unwrap().1, top);
        assert_eq!(grid.void_count(), voids);
        assert_eq!(grid.georeference.crs.as_deref(), Some("EPSG:4326"));
        grid
    };
    let andes = corners("S33W071.tif", [1146.0, 4779.0, 1162.0, 4618.0, 1559.0], (6929.0, 784, 1187), 0);
    assert_eq!(andes.min_max_mean().unwrap().0, 250.0);
    for (found, wanted) in andes.bounds().into_iter().zip([-71.0, -33.0, -70.0, -32.0]) {
        close(found, wanted, 1e-9);
    }
    close(andes.spacing_m[1], 92.4, 0.2);
    close(andes.spacing_m[0], 78.2, 0.2);
    let alps = [932.0, 2820.0, 2567.0, 272.0, 1473.0];
    let alps = corners("N46E008.tif", alps, (4173.0, 556, 151), 103_743);
    let (before, voids) = (alps.heights_m.clone(), alps.valid.clone().unwrap());
    let filled = alps.with_nodata(NodataPolicy::Fill);
    for ((a, b), ok) in before.iter().zip(&filled.heights_m).zip(voids) {
        assert!(if ok { a == b } else { (187.0..=4173.0).contains(b) });
    }
    let west = [17.0, 1541.0, 342.0, 0.0, 61.0];
    let west = corners("N49W124.tif", west, (2630.0, 180, 1188), 25_620);
    let east = [1541.0, 895.0, 0.0, 765.0, 544.0];
    let east = corners("N49W123.tif", east, (2674.0, 43, 358), 34_926);
    for row in 0..1201 {
        assert_eq!(north(&west, row, 1200), north(&east, row, 0));
    }
    close(west.bounds()[2], east.bounds()[0], 1e-9);
    let raw = read(&dir.join("srtm/N44W072.hgt"));
    let (low, high, _) = raw.min_max_mean().unwrap();
    assert_eq!((low, high, raw.void_count()), (115.0, 1908.0, 0));
    assert_eq!(raw.bounds(), [-72.0, 44.0, -71.0, 45.0]);
}

#[test]
fn puget_sound_and_etopo() {
    let Some(dir) = shared_data() else { return };
    let options = ReadOptions { spacing_m: Some(160.0), z_scale: Some(0.1), ..ReadOptions::default() };
    let sound = dir.join("puget-sound/ps_height_1k.png");
    let (low, high, _) = read(&sound).min_max_mean().unwrap();
    assert_eq!((low, high), (0.0, 43798.0));
    let scaled = open_file(&sound, &options).unwrap();
    close(f64::from(scaled.min_max_mean().unwrap().1), 4379.8, 1e-3);
    assert_eq!((scaled.width, scaled.spacing_m), (1025, [160.0; 2]));

    let earth = read(&dir.join("etopo/etopo5_int16.tif"));
    assert_eq!((earth.width, earth.height), (4320, 2161));
    let at = |lat: f64, lon: f64| {
        let col = ((lon + 180.0) * 12.0).round() as usize;
        let row = ((90.0 - lat) * 12.0).round() as usize;
        north(&earth, row, col)
    };
    assert_eq!(at(28.0, 86.9167), 6096.0);
    assert_eq!(at(11.33, 142.2), -9905.0);
    assert_eq!(at(19.5, -155.58), 1524.0);
    assert_eq!((at(-90.0, 0.0), at(90.0, 0.0)), (2810.0, -4290.0));
    let (low, high, _) = earth.min_max_mean().unwrap();
    assert_eq!((low, high), (-10376.0, 7833.0));
    close(earth.bounds()[1], -90.0, 1e-9);
}

#[test]
fn section_a_decodes_exactly() {
    let Some(dir) = shared_data() else { return };
    let text = fs::read_to_string(dir.join("geotiff-variants/EXPECTED_byte_20x20.txt")).unwrap();
    let expected: Vec<f32> = text.split_whitespace().map(|v| v.parse().unwrap()).collect();
    let manifest = fs::read_to_string(dir.join("manifest.tsv")).unwrap();
    let (mut exact, mut refused) = (0, Vec::new());
    for line in manifest.lines().filter(|l| l.contains("gdalchecksum=4672")) {
        let name = line.split('\t').next().unwrap();
        let known = ["geotiff-variants/", "formats/png/"];
        if !known.iter().any(|k| name.starts_with(k)) {
            continue;
        }
        match open_file(&dir.join(name), &ReadOptions::default()) {
            Ok(grid) => {
                let rows = (0..20).flat_map(|r| (0..20).map(move |c| (r, c)));
                let found: Vec<f32> = rows.map(|(r, c)| north(&grid, r, c)).collect();
                assert_eq!(found, expected, "{name}");
                assert_eq!(grid.valid, None, "{name}");
                exact += 1;
            }
            Err(e) => {
                let unsupported = matches!(e, HeightError::Unsupported { .. });
                assert!(unsupported || matches!(e, HeightError::Rotated { .. }), "{e}");
                refused.push(e.to_string());
            }
        }
    }
    eprintln!("section A: {exact} exact; refused:\n{}", refused.join("\n"));
    assert!(exact >= 35, "only {exact}");
}

#[test]
fn section_b_ramps() {
    let Some(dir) = shared_data() else { return };
    let mut count = 0;
    for entry in fs::read_dir(dir.join("geotiff-variants/image-tiff/seq")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.starts_with("seq-1c-") || name.contains("palette") {
            continue;
        }
        let grid = read(&path);
        for i in 0..256 {
            let found = f64::from(north(&grid, i / 16, i % 16));
            let wanted = match grid.dtype {
                "float32" | "float64" => i as f64 / 255.0,
                "int16" | "int32" => i as f64 - 128.0,
                _ => i as f64,
            };
            close(found, wanted, 1e-6);
        }
        count += 1;
    }
    assert!(count >= 20, "only {count}");
}

#[test]
fn georeference_and_nodata_variants() {
    let Some(dir) = shared_data() else { return };
    let open = |name: &str| read(&dir.join("geotiff-variants").join(name));
    assert_eq!(open("byte.tif").bounds(), [440_750.0, 3_750_150.0, 441_890.0, 3_751_290.0]);
    assert_eq!(open("byte_point.tif").bounds()[0], 440_720.0);
    let feet = open("epsg_2853_with_us_feet.tif");
    close(feet.spacing_m[0], 0.25 * 1200.0 / 3937.0, 1e-12);
    close(feet.origin_m[0], 11_882_500.125 * 1200.0 / 3937.0, 1e-6);
    assert!(!open("byte_nogeoref.tif").georeference.georeferenced);
    let voids = |name: &str| open(name).void_count();
    assert_eq!(voids("nan32_nodata.tif"), 10);
    assert_eq!(voids("nan64.tif"), 50);
    assert_eq!(voids("float32_almost_nodata_max_float32.tif"), 1);
    assert_eq!(voids("float_raster_with_nodata.tif"), 58);
    assert_eq!(voids("all-nodata.tif"), 175_725);
    assert_eq!(voids("nodata_byte.tif"), 20);
    let sparse = open("cog_sparse_strile_arrays_zeroified_when_possible.tif");
    assert_eq!(sparse.valid, None);
    assert_eq!(sparse.min_max_mean().unwrap().1, 255.0);
    assert_eq!(voids("cog/cog_int16.tif"), 3_414_419);
    assert_eq!(voids("cog/cog_nodata_nan.tif"), 154_085);
    let (low, high, _) = open("cog/cog_int16.tif").min_max_mean().unwrap();
    assert_eq!((low, high), (69.0, 201.0));
}

#[test]
fn no_file_panics_or_hangs() {
    let Some(dir) = shared_data() else { return };
    let mut todo = ["malformed", "geotiff-variants", "formats", "terrain-rgb"].map(|d| dir.join(d)).to_vec();
    let (mut good, mut bad) = (0, 0);
    while let Some(path) = todo.pop() {
        if path.is_dir() {
            todo.extend(fs::read_dir(&path).unwrap().map(|e| e.unwrap().path()));
            continue;
        }
        let start = Instant::now();
        let read = || open_file(&path, &ReadOptions::default());
        match catch_unwind(AssertUnwindSafe(read)) {
            Ok(Ok(grid)) => {
                assert_eq!(grid.heights_m.len(), grid.width * grid.height);
                assert!(grid.heights_m.iter().all(|h| h.is_finite()));
                eprintln!("ok    {} {}x{}", path.display(), grid.width, grid.height);
                good += 1;
            }
            Ok(Err(e)) => {
                let line = e.to_string();
                assert!(!line.contains('\n') && line.len() < 500, "{line}");
                eprintln!("error {line}");
                bad += 1;
            }
            Err(_) => panic!("{} panics", path.display()),
        }
        assert!(start.elapsed() < Duration::from_secs(20), "{}", path.display());
    }
    eprintln!("{good} read, {bad} refused");
    assert!(good > 50 && bad > 30);
}
