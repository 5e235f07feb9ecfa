//! Pictures that say where they were taken from and how to take them again: text chunks of a PNG file.

use std::path::Path;

use super::args::write_whole;

/// Who wrote the picture, with its keyword.
pub const SOFTWARE: (&str, &str) = ("Software", concat!("tessclip ", env!("CARGO_PKG_VERSION")));
/// Keyword of the pose `x,y,z,yaw,pitch`, in the terrain's own units.
pub const CAMERA: &str = "tessclip:camera";
/// Keyword of the terrain as it was named.
pub const TERRAIN: &str = "tessclip:terrain";
/// Keyword of the command line that draws the picture.
pub const RENDER: &str = "tessclip:render";

/// Writes RGBA bytes as PNG with texts by keyword (1 to 79 characters of Latin 1).
pub fn write_png_with(path: &Path, rgba: &[u8], size: [u32; 2], text: &[(&str, &str)]) -> anyhow::Result<()> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Adaptive);
    for (keyword, text) in text {
        let (keyword, text) = ((*keyword).to_string(), (*text).to_string());
        // Readers take the text of a tEXt chunk for Latin 1; what lies beyond ASCII needs iTXt, which is UTF-8.
        if is_plain(&text) {
            encoder.add_text_chunk(keyword, text)?;
        } else {
            encoder.add_itxt_chunk(keyword, text)?;
        }
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgba)?;
    writer.finish()?;
    write_whole(path, &bytes)
}

/// Printable ASCII and line ends.
fn is_plain(text: &str) -> bool {
    text.chars().all(|c| c == '\n' || (' '..='~').contains(&c))
}

/// The command line that this process was started with.
pub fn own_line() -> String {
    let given = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned());
    shell_line(std::iter::once("tessclip".to_string()).chain(given))
}

/// Words as one line that a POSIX shell splits into the same words.
pub fn shell_line(words: impl Iterator<Item = String>) -> String {
    words.map(|word| quoted(&word)).collect::<Vec<_>>().join(" ")
}

/// A word in quotes where a shell needs them; of an option's `--name=value` only the value.
fn quoted(word: &str) -> String {
    let is_safe = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_safe) {
        return word.to_string();
    }
    let (name, value) = match word.split_once('=') {
        Some((name, value)) if name.starts_with("--") && name.chars().all(is_safe) => (name, value),
        _ => ("", word),
    };
    // Nothing but a quote itself means anything between quotes.
    let value = value.replace('\'', r"'\''");
    if name.is_empty() { format!("'{value}'") } else { format!("{name}='{value}'") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_only_where_a_shell_needs_it() {
        let line = |words: &[&str]| shell_line(words.iter().map(ToString::to_string));
        assert_eq!(
            line(&["tessclip", "--camera=-1,2.5,3,0,-90", "a/b.tif"]),
            "tessclip --camera=-1,2.5,3,0,-90 a/b.tif"
        );
        assert_eq!(line(&["procedural:plain?a=1&b=2"]), "'procedural:plain?a=1&b=2'");
        assert_eq!(line(&["--over=my file.tif", ""]), "--over='my file.tif' ''");
        assert_eq!(line(&["it's", "$HOME", "~", "a\nb"]), "'it'\\''s' '$HOME' '~' 'a\nb'");
        assert_eq!(line(&["--a b=c"]), "'--a b=c'");
    }

    #[test]
    fn texts_and_pixels_come_back_and_only_what_needs_it_is_utf_8() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let path = folder.path().join("a.png");
        let rgba = [1, 2, 3, 255, 4, 5, 6, 255];
        let texts = [SOFTWARE, (CAMERA, "1,2,3,4,5"), (TERRAIN, "Zürich \u{1f30d}.tif"), (RENDER, "a\nb")];
        write_png_with(&path, &rgba, [2, 1], &texts).expect("written");
        let file = std::io::BufReader::new(std::fs::File::open(&path).expect("a file"));
        let mut reader = png::Decoder::new(file).read_info().expect("a picture");
        let mut pixels = [0; 8];
        reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!(pixels, rgba);
        let info = reader.info();
        let plain: Vec<(&str, &str)> =
            info.uncompressed_latin1_text.iter().map(|t| (t.keyword.as_str(), t.text.as_str())).collect();
        assert_eq!(plain, [texts[0], texts[1], texts[3]]);
        let [utf_8] = &info.utf8_text[..] else { panic!("one text") };
        assert_eq!((utf_8.keyword.as_str(), utf_8.get_text().expect("text").as_str()), texts[2]);
    }
}
