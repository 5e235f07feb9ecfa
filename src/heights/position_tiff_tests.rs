//! Tests of the reader of positions, against files written here.

use std::fs::File;
use std::io::{Seek, Write};
use std::path::PathBuf;

use tiff::encoder::colortype::{ColorType, Gray32Float, RGB8, RGB32Float, RGB64Float};
use tiff::encoder::{Compression, TiffEncoder, TiffValue};
use tiff::tags::Tag;

use super::{HeightError, PositionGrid, is_position_file};

/// x, y, z of the nodes of a file in its own order: y falls from row to row.
fn samples(width: u32, height: u32) -> Vec<[f64; 3]> {
    let node = |i: u32| {
        let (col, row) = (f64::from(i % width), f64::from(i / width));
        [10.0 * col - 3.0, -20.0 * row, 0.5 * col * row]
    };
    (0..width * height).map(node).collect()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Writes chunky strips of 3 rows.
fn write<C: ColorType>(
    path: &PathBuf,
    size: [u32; 2],
    data: &[C::Inner],
    nodata: Option<&str>,
    how: Compression,
) where
    [C::Inner]: TiffValue,
{
    let mut encoder = TiffEncoder::new(File::create(path).unwrap()).unwrap().with_compression(how);
    let mut image = encoder.new_image::<C>(size[0], size[1]).unwrap();
    image.rows_per_strip(3).unwrap();
    if let Some(text) = nodata {
        image.encoder().write_tag(Tag::GdalNodata, text).unwrap();
    }
    image.write_data(data).unwrap();
}

/// A little-endian TIFF from tag, type and values; `data` goes before the directory, at 8.
fn raw(path: &PathBuf, data: &[u8], tags: &[(u16, u16, Vec<u32>)]) {
    let mut extra = Vec::new();
    let directory = 8 + data.len() as u32;
    let extra_at = directory + 2 + 12 * tags.len() as u32 + 4;
    let mut file = File::create(path).unwrap();
    file.write_all(b"II*\0").unwrap();
    file.write_all(&directory.to_le_bytes()).unwrap();
    file.write_all(data).unwrap();
    file.write_all(&(tags.len() as u16).to_le_bytes()).unwrap();
    for (tag, kind, values) in tags {
        let mut bytes: Vec<u8> = match kind {
            3 => values.iter().flat_map(|&v| (v as u16).to_le_bytes()).collect(),
            _ => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        };
        if bytes.len() > 4 {
            let at = extra_at + extra.len() as u32;
            extra.append(&mut bytes);
            bytes = at.to_le_bytes().to_vec();
        }
        bytes.resize(4, 0);
        file.write_all(&[tag.to_le_bytes(), kind.to_le_bytes()].concat()).unwrap();
        file.write_all(&(values.len() as u32).to_le_bytes()).unwrap();
        file.write_all(&bytes).unwrap();
    }
    file.write_all(&[0; 4]).unwrap();
    file.write_all(&extra).unwrap();
}

fn assert_is_flipped(grid: &PositionGrid, width: u32, height: u32) {
    assert_eq!((grid.width, grid.height), (width as usize, height as usize));
    let expected = samples(width, height);
    for (r, row) in expected.chunks(width as usize).rev().enumerate() {
        assert_eq!(&grid.xyz_m[r * grid.width..(r + 1) * grid.width], row, "row {r}");
    }
    assert_eq!(grid.valid, None);
}

#[test]
fn written_positions_come_back() {
    let folder = folder();
    let path = folder.path().join("p.tif");
    let f64s = samples(5, 7).concat();
    let f32s: Vec<f32> = f64s.iter().map(|&v| v as f32).collect();
    for how in [Compression::Uncompressed, Compression::Lzw, Compression::Deflate(Default::default())] {
        write::<RGB32Float>(&path, [5, 7], &f32s, None, how);
        assert!(is_position_file(&path));
        assert_is_flipped(&PositionGrid::read(&path).unwrap(), 5, 7);
        write::<RGB64Float>(&path, [5, 7], &f64s, None, how);
        assert!(is_position_file(&path));
        assert_is_flipped(&PositionGrid::read(&path).unwrap(), 5, 7);
    }
}

/// Tags of a 5 x 7 image of 32-bit floats in tiles of 16 x 16 or strips of 4 rows.
fn layout(planar: u32, tiled: bool, offsets: Vec<u32>, counts: Vec<u32>) -> Vec<(u16, u16, Vec<u32>)> {
    let mut tags = vec![
        (256, 3, vec![5]),
        (257, 3, vec![7]),
        (258, 3, vec![32; 3]),
        (259, 3, vec![1]),
        (262, 3, vec![1]),
        (277, 3, vec![3]),
        (284, 3, vec![planar]),
        (338, 3, vec![0; 2]),
        (339, 3, vec![3; 3]),
    ];
    if tiled {
        tags.extend([(322, 3, vec![16]), (323, 3, vec![16]), (324, 4, offsets), (325, 4, counts)]);
    } else {
        tags.extend([(273, 4, offsets), (278, 3, vec![4]), (279, 4, counts)]);
    }
    tags.sort_by_key(|t: &(u16, u16, Vec<u32>)| t.0);
    tags
}

fn bytes(values: impl Iterator<Item = f64>) -> Vec<u8> {
    values.flat_map(|v| (v as f32).to_le_bytes()).collect()
}

#[test]
fn planes_and_tiles_come_back() {
    let folder = folder();
    let path = folder.path().join("p.tif");
    let nodes = samples(5, 7);
    // One tile of 16 x 16, the image in its corner.
    let tile = |band: Option<usize>| {
        let pixels = (0..256).map(|i| (i % 16, i / 16));
        let node = |(c, r): (usize, usize)| if c < 5 && r < 7 { nodes[r * 5 + c] } else { [-1.0; 3] };
        bytes(pixels.flat_map(|at| match band {
            Some(k) => vec![node(at)[k]],
            None => node(at).to_vec(),
        }))
    };
    raw(&path, &tile(None), &layout(1, true, vec![8], vec![3072]));
    assert_is_flipped(&PositionGrid::read(&path).unwrap(), 5, 7);
    let planes = [0, 1, 2].map(|k| tile(Some(k))).concat();
    raw(&path, &planes, &layout(2, true, vec![8, 1032, 2056], vec![1024; 3]));
    assert_is_flipped(&PositionGrid::read(&path).unwrap(), 5, 7);
    // Strips of 4 and 3 rows for each band.
    let planes = [0, 1, 2].map(|k: usize| bytes(nodes.iter().map(|p| p[k]))).concat();
    let offsets = vec![8, 88, 148, 228, 288, 368];
    raw(&path, &planes, &layout(2, false, offsets.clone(), [80, 60].repeat(3)));
    assert!(is_position_file(&path));
    assert_is_flipped(&PositionGrid::read(&path).unwrap(), 5, 7);
    // A strip of one band left out: its nodes are void, whatever the other bands say.
    raw(&path, &planes, &layout(2, false, offsets.clone(), vec![80, 60, 80, 60, 80, 0]));
    let grid = PositionGrid::read(&path).unwrap();
    assert_eq!(grid.void_count(), 15);
    assert!(grid.valid.unwrap()[..15].iter().all(|v| !v));
    // Strips of the last band missing from the table.
    raw(&path, &planes, &layout(2, false, offsets[..4].to_vec(), [80, 60].repeat(2)));
    assert!(matches!(PositionGrid::read(&path), Err(HeightError::Malformed { .. })));
}

#[test]
fn nodata_and_nan_are_void() {
    let folder = folder();
    let path = folder.path().join("p.tif");
    let mut data: Vec<f32> = samples(4, 4).concat().iter().map(|&v| v as f32).collect();
    data[2] = f32::NAN;
    data[3 * 15 + 1] = -9999.0;
    write::<RGB32Float>(&path, [4, 4], &data, Some("-9999"), Compression::Uncompressed);
    let grid = PositionGrid::read(&path).unwrap();
    let valid = grid.valid.as_ref().unwrap();
    // The first pixel of the file is the first of the last row.
    assert!(!valid[12] && !valid[3] && grid.void_count() == 2);
    data[2] = -3.4e38;
    write::<RGB32Float>(&path, [4, 4], &data, None, Compression::Uncompressed);
    assert!(matches!(PositionGrid::read(&path), Err(HeightError::FarPosition { column: 0, row: 3, .. })));
    write::<RGB32Float>(&path, [4, 4], &data, Some("none"), Compression::Uncompressed);
    assert!(matches!(PositionGrid::read(&path), Err(HeightError::Malformed { .. })));
}

#[test]
fn other_files_are_refused() {
    let folder = folder();
    let path = folder.path().join("p.tif");
    let error = || {
        let e = PositionGrid::read(&path).unwrap_err();
        assert!(!e.to_string().contains('\n'), "{e}");
        e
    };
    assert!(!is_position_file(&path));
    assert!(matches!(error(), HeightError::NotFound { .. }));
    File::create(&path).unwrap();
    assert!(matches!(error(), HeightError::Empty { .. }));
    write::<Gray32Float>(&path, [4, 4], &[0.0; 16], None, Compression::Uncompressed);
    assert!(!is_position_file(&path));
    assert!(matches!(error(), HeightError::NotPositions { .. }));
    write::<RGB8>(&path, [4, 4], &[0; 48], None, Compression::Uncompressed);
    assert!(!is_position_file(&path));
    assert!(matches!(error(), HeightError::NotPositions { .. }));
    write::<RGB32Float>(&path, [1, 4], &[0.0; 12], None, Compression::Uncompressed);
    assert!(matches!(error(), HeightError::TooSmall { .. }));
    std::fs::write(&path, b"not a tiff at all").unwrap();
    assert!(!is_position_file(&path));
    assert!(matches!(error(), HeightError::Malformed { .. }));
    assert!(matches!(PositionGrid::read(folder.path()), Err(HeightError::NotAFile { .. })));
}

#[test]
fn a_huge_declared_size_is_refused_before_memory_is_taken() {
    let folder = folder();
    let path = folder.path().join("p.tif");
    let mut tags = layout(1, false, vec![8], vec![0]);
    for tag in tags.iter_mut().filter(|t| t.0 == 256 || t.0 == 257) {
        (tag.1, tag.2) = (4, vec![2_000_000_000]);
    }
    raw(&path, &[0; 16], &tags);
    assert!(is_position_file(&path));
    assert!(matches!(PositionGrid::read(&path), Err(HeightError::TooLarge { .. })));
}

#[test]
fn every_truncation_and_flipped_byte_is_an_error_or_a_grid() {
    let folder = folder();
    let path = folder.path().join("p.tif");
    write::<RGB64Float>(&path, [4, 4], &samples(4, 4).concat(), None, Compression::Lzw);
    let whole = std::fs::read(&path).unwrap();
    let mut file = File::options().write(true).open(&path).unwrap();
    for i in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[i] ^= 0xff;
        file.rewind().unwrap();
        file.write_all(&bytes).unwrap();
        let _ = (is_position_file(&path), PositionGrid::read(&path));
    }
    file.rewind().unwrap();
    file.write_all(&whole).unwrap();
    assert!(PositionGrid::read(&path).is_ok());
    for length in (0..whole.len()).rev() {
        file.set_len(length as u64).unwrap();
        // The last values may be padding; everything that is needed lies before them.
        assert!(PositionGrid::read(&path).is_err() || length + 16 > whole.len(), "{length} bytes pass");
    }
}
