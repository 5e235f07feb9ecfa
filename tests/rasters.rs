//! Rasters read by rectangles give what the same sources give whole, bit for bit.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rayon::prelude::*;
use tessclip::heights::{
    GridSource, HeightError, HeightGrid, ProceduralKind, RasterSource, ReadOptions, open_raster, open_terrain,
};
use tiff::encoder::colortype::{self, ColorType};
use tiff::encoder::compression::DeflateLevel;
use tiff::encoder::{Compression, Predictor, TiffEncoder, TiffValue};
use tiff::tags::Tag;

fn shared_data() -> Option<PathBuf> {
    let dir = std::env::var_os("TESSCLIP_DATA")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")), PathBuf::from);
    if dir.is_dir() {
        return Some(dir);
    }
    eprintln!("not run: no ../shared/data");
    None
}

/// Whatever limits memory must not matter to what is read by rectangles.
fn tight() -> ReadOptions {
    ReadOptions { max_samples: 1, ..ReadOptions::default() }
}

fn open(spec: &str, options: &ReadOptions) -> Box<dyn RasterSource> {
    open_raster(spec, options).unwrap_or_else(|e| panic!("{spec}: {e}"))
}

fn failure(spec: &str) -> HeightError {
    open_raster(spec, &ReadOptions::default()).err().expect(spec)
}

fn read(source: &dyn RasterSource, at: [u64; 2], size: [usize; 2]) -> Result<Vec<f32>, HeightError> {
    let mut out = vec![12_345.0; size[0] * size[1]];
    source.read(at, size, &mut out).map(|()| out)
}

/// Reads everything in rectangles of `step` on all cores, bands from north to south, and compares.
fn same(spec: &str, source: &dyn RasterSource, whole: &HeightGrid, step: [usize; 2]) {
    let header = source.header();
    assert_eq!([header.width, header.height], [whole.width as u64, whole.height as u64], "{spec}");
    assert_eq!((header.spacing_m, header.origin_m), (whole.spacing_m, whole.origin_m), "{spec}");
    assert_eq!((header.dtype, header.format), (whole.dtype, whole.format), "{spec}");
    assert_eq!(format!("{:?}", header.georeference), format!("{:?}", whole.georeference), "{spec}");
    assert!(source.band_rows() >= 1, "{spec}");
    let (width, height) = (whole.width, whole.height);
    let rows = (0..height).step_by(step[1]).rev();
    let corners: Vec<_> =
        rows.flat_map(|row| (0..width).step_by(step[0]).map(move |col| [col, row])).collect();
    corners.par_iter().for_each(|&[col, row]| {
        let size = [step[0].min(width - col), step[1].min(height - row)];
        let found = read(source, [col as u64, row as u64], size).unwrap_or_else(|e| panic!("{spec}: {e}"));
        for (i, h) in found.into_iter().enumerate() {
            let at = (row + i / size[0]) * width + col + i % size[0];
            let valid = whole.valid.as_ref().is_none_or(|v| v[at]);
            assert_eq!(!h.is_nan(), valid, "{spec}: {col} {row} {i}");
            assert!(!valid || h.to_bits() == whole.heights_m[at].to_bits(), "{spec}: {col} {row} {i}: {h}");
        }
    });
}

fn same_as_whole(spec: &str, options: &ReadOptions) {
    let whole = open_terrain(spec, options).unwrap();
    let source = open(spec, &ReadOptions { max_samples: 1, ..options.clone() });
    same(spec, source.as_ref(), &whole, [37, 29]);
}

// ---- made ----

#[test]
fn procedural_rectangles() {
    let scaled = ReadOptions { z_scale: Some(0.3), z_offset: Some(-7.0), ..ReadOptions::default() };
    for options in [ReadOptions::default(), scaled] {
        for kind in ProceduralKind::ALL {
            same_as_whole(&format!("procedural:{}?width=150&height=67&spacing=25", kind.name()), &options);
        }
        same_as_whole("procedural:planet?size=65&seed=3", &options);
        assert_eq!(open("procedural:planet", &options).header().raw, options.z_scale.is_none());
    }
}

#[test]
fn procedural_rasters_of_any_size() {
    let start = Instant::now();
    for spec in
        ["procedural:mountains?size=65537", "procedural:dunes?size=131073", "procedural:planet?size=131073"]
    {
        let source = open(spec, &ReadOptions::default());
        let (width, height) = (source.header().width, source.header().height);
        assert!(width >= 65_537 && height >= 65_537);
        let corner = read(source.as_ref(), [width - 5, height - 3], [5, 3]).unwrap();
        assert!(corner.iter().all(|h| h.is_finite()));
    }
    assert!(start.elapsed() < Duration::from_secs(5));
    let error = failure("procedural:plain?width=3000000000&height=2");
    assert!(matches!(error, HeightError::SideTooLong { .. }), "{error}");
    assert!(matches!(failure("procedural:planet?size=2000000000"), HeightError::SideTooLong { .. }));
    assert!(matches!(failure("procedural:hills"), HeightError::UnknownProcedural { .. }));
}

#[test]
fn grids_and_rectangles_outside_of_them() {
    let heights = (0..60).map(|i| if i % 7 == 3 { f32::NAN } else { i as f32 }).collect();
    let grid = HeightGrid::new(10, 6, heights).unwrap();
    let source = GridSource::new(grid.clone());
    same("memory", &source, &grid, [4, 5]);
    assert!(source.header().raw && source.grid().void_count() > 0);
    for (at, size) in [([7, 0], [4, 1]), ([0, 6], [1, 1]), ([u64::MAX, 0], [2, 2])] {
        assert!(matches!(read(&source, at, size), Err(HeightError::Rectangle { .. })));
    }
    let short = source.read([0, 0], [3, 3], &mut [0.0; 8]);
    assert!(matches!(short, Err(HeightError::Rectangle { .. })));
    assert!(read(&source, [10, 6], [0, 0]).is_ok());
}

// ---- hand-made files ----

/// An int16 TIFF of one strip that claims a compression and a number of bytes.
fn bare(path: &Path, big_endian: bool, size: [u32; 2], [compression, bytes]: [u32; 2], samples: &[i16]) {
    let two = |v: u16| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
    let four = |v: u32| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
    let [width, height] = size;
    let tags = [
        (256, width),
        (257, height),
        (258, 16),
        (259, compression),
        (262, 1),
        (273, 134),
        (277, 1),
        (278, height),
        (279, bytes),
        (339, 2),
    ];
    let mut file = if big_endian { b"MM".to_vec() } else { b"II".to_vec() };
    file.extend(two(42));
    file.extend(four(8));
    file.extend(two(10));
    for (tag, value) in tags {
        file.extend(two(tag));
        file.extend(two(4));
        file.extend(four(1));
        file.extend(four(value));
    }
    file.extend(four(0));
    file.extend(samples.iter().flat_map(|&s| two(s as u16)));
    fs::write(path, file).unwrap();
}

#[test]
fn bare_tiffs_and_their_ends() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bare.tif");
    let spec = path.to_str().unwrap();
    let samples: Vec<i16> = (0..77 * 41).map(|i| (i * 31 % 999) as i16 - 400).collect();
    for big_endian in [false, true] {
        bare(&path, big_endian, [77, 41], [1, 77 * 41 * 2], &samples);
        same_as_whole(spec, &ReadOptions::default());
        same_as_whole(spec, &ReadOptions { z_scale: Some(0.1), ..ReadOptions::default() });
        assert!(matches!(open_terrain(spec, &tight()), Err(HeightError::TooLarge { .. })));
    }
    // Cut off within a strip, and within one that does not say how long it is.
    let cut = &samples[..samples.len() - 5];
    bare(&path, false, [77, 41], [1, 77 * 41 * 2], cut);
    assert!(matches!(failure(spec), HeightError::Malformed { .. }));
    bare(&path, false, [77, 41], [1, 2], cut);
    assert!(open_terrain(spec, &ReadOptions::default()).is_err());
    let source = open(spec, &ReadOptions::default());
    assert!(read(source.as_ref(), [0, 1], [77, 40]).is_ok());
    let south = read(source.as_ref(), [70, 0], [7, 2]).unwrap_err();
    assert!(matches!(south, HeightError::Malformed { .. }) && south.to_string().lines().count() == 1);
    // Of a strip that is left out nothing is read, however large it is.
    bare(&path, false, [100_000, 100_000], [1, 0], &[]);
    let source = open(spec, &tight());
    assert_eq!(read(source.as_ref(), [99_990, 5], [10, 2]).unwrap(), [0.0; 20]);
    bare(&path, false, [100_000, 100_000], [8, 0], &[]);
    let error = failure(spec).to_string();
    assert!(error.contains("over 128 MiB"), "{error}");
}

fn strips<C: ColorType>(path: &Path, size: [u32; 2], rows: u32, compression: Compression, data: &[C::Inner])
where
    [C::Inner]: TiffValue,
{
    let predictor = if compression == Compression::Lzw { Predictor::Horizontal } else { Predictor::None };
    let file = fs::File::create(path).unwrap();
    let mut encoder = TiffEncoder::new(file).unwrap().with_compression(compression).with_predictor(predictor);
    let mut image = encoder.new_image::<C>(size[0], size[1]).unwrap();
    image.rows_per_strip(rows).unwrap();
    image.encoder().write_tag(Tag::GdalNodata, "7").unwrap();
    image.write_data(data).unwrap();
}

#[test]
fn every_sample_type_in_strips() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("strips.tif");
    let spec = path.to_str().unwrap();
    let options = ReadOptions::default();
    macro_rules! check {
        ($($color:ident $sample:ty),*) => {$(
            let samples: Vec<$sample> = (0..90_usize * 50).map(|i| (i * 37 % 101) as $sample).collect();
            for compression in [
                Compression::Uncompressed,
                Compression::Deflate(DeflateLevel::Fast),
                Compression::Packbits,
            ] {
                strips::<colortype::$color>(&path, [90, 50], 7, compression, &samples);
                same_as_whole(spec, &options);
                assert!(open_terrain(spec, &options).unwrap().void_count() > 0);
            }
        )*};
    }
    check!(
        Gray8 u8, GrayI8 i8, Gray16 u16, GrayI16 i16, Gray32 u32, GrayI32 i32, Gray64 u64, GrayI64 i64,
        Gray32Float f32, Gray64Float f64
    );
    let samples: Vec<u16> = (0..90 * 50).map(|i| (i * i % 60_013) as u16).collect();
    for rows in [1, 50] {
        strips::<colortype::Gray16>(&path, [90, 50], rows, Compression::Lzw, &samples);
        same_as_whole(spec, &options);
    }
}

#[test]
fn hgt_and_png_files() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("S01W072.hgt");
    let sample = |i: i32| if i % 11 == 5 { i16::MIN } else { (i % 3000) as i16 - 700 };
    let bytes: Vec<u8> = (0..91 * 91).flat_map(|i| sample(i).to_be_bytes()).collect();
    fs::write(&path, &bytes).unwrap();
    same_as_whole(path.to_str().unwrap(), &ReadOptions::default());

    let path = dir.path().join("grey.png");
    let spec = path.to_str().unwrap();
    let grey: Vec<u16> = (0..83 * 61).map(|i| (i * 7919 % 65_521) as u16).collect();
    let image = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(83, 61, grey);
    image.unwrap().save(&path).unwrap();
    same_as_whole(spec, &ReadOptions::default());
    let held = open(spec, &ReadOptions::default());
    assert!(held.header().raw);
    same(spec, held.as_ref(), &open_terrain(spec, &ReadOptions::default()).unwrap(), [37, 29]);
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    for options in [ReadOptions::default(), tight()] {
        let error = open_raster(spec, &options).err().unwrap();
        assert!(matches!(error, HeightError::Malformed { .. }), "{error}");
    }
}

// ---- shared data ----

#[test]
fn every_readable_file_of_the_shared_data() {
    let Some(dir) = shared_data() else { return };
    let options = ReadOptions::default();
    let (mut todo, mut count, mut refused) = (vec![dir], 0, 0);
    while let Some(path) = todo.pop() {
        if path.is_dir() {
            todo.extend(fs::read_dir(&path).unwrap().map(|e| e.unwrap().path()));
            continue;
        }
        let Some(spec) = path.to_str() else { continue };
        if let Ok(whole) = open_terrain(spec, &options) {
            let large = whole.heights_m.len() > 1 << 20;
            let step = if large { [337, 229] } else { [37, 29] };
            for options in [options.clone(), tight()] {
                same(spec, open(spec, &options).as_ref(), &whole, step);
            }
            count += 1;
            continue;
        }
        // Damage is found when it is opened or where it is read, and never by a panic.
        refused += 1;
        let Ok(source) = open_raster(spec, &options) else { continue };
        let size = [source.header().width, source.header().height].map(|n| n.min(1024) as usize);
        match read(source.as_ref(), [0, 0], size) {
            Ok(_) => eprintln!("{spec}: refused whole, read by rectangles"),
            Err(e) => assert_eq!(e.to_string().lines().count(), 1, "{e}"),
        }
    }
    eprintln!("{count} files equal, {refused} refused");
    assert!(count > 50, "only {count}");
}
