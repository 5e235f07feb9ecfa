//! Pictures that the program wrote, as tests look at them.
#![allow(dead_code, reason = "each test file uses its own part")]

use std::path::Path;

/// Size and RGBA of a PNG file.
pub fn pixels(path: &Path) -> ([u32; 2], Vec<[u8; 4]>) {
    let picture = image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).to_rgba8();
    ([picture.width(), picture.height()], picture.pixels().map(|p| p.0).collect())
}

/// Pixels that differ.
pub fn differ(a: &Path, b: &Path) -> usize {
    let ((size_a, a), (size_b, b)) = (pixels(a), pixels(b));
    assert_eq!(size_a, size_b);
    a.iter().zip(&b).filter(|(a, b)| a != b).count()
}

/// What a picture says of itself.
pub fn text(path: &Path, keyword: &str) -> Option<String> {
    let file = std::io::BufReader::new(std::fs::File::open(path).expect("a file"));
    let reader = png::Decoder::new(file).read_info().expect("a picture");
    let all = &reader.info().uncompressed_latin1_text;
    all.iter().find(|t| t.keyword == keyword).map(|t| t.text.clone())
}
