//! Every look of the viewer as one line of `render`: it changes what it should, and nothing else.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use std::path::Path;

use assert_cmd::Command;
use tempfile::TempDir;

/// What no terrain shows.
const MAGENTA: [u8; 4] = [255, 0, 255, 255];
const SIZE: [usize; 2] = [160, 90];
/// Small enough to be all in view, with sky around.
const TERRAIN: &str = "procedural:mountains?seed=3&size=257";
const LOOK: [&str; 7] = [TERRAIN, "--n", "127", "--background", "ff00ff", "--no-fog", "--size"];

fn render(args: &[&str]) -> assert_cmd::assert::Assert {
    Command::cargo_bin("tessclip").expect("built").arg("render").args(args).assert()
}

/// A drawn picture.
struct Picture {
    width: usize,
    pixels: Vec<[u8; 4]>,
}

impl Picture {
    /// What `render` draws with exactly these arguments.
    fn of(args: &[&str]) -> Self {
        let folder = TempDir::new().expect("a folder");
        let at = folder.path().join("a.png");
        render(&[args, &["-o", at.to_str().expect("text")]].concat()).success();
        Self::read(&at)
    }

    /// The usual terrain and look, and these arguments.
    fn with(args: &[&str]) -> Self {
        Self::of(&[&LOOK[..], &["160x90"], args].concat())
    }

    fn read(at: &Path) -> Self {
        let image = image::open(at).expect("a picture").to_rgba8();
        let pixels = image.pixels().map(|p| p.0).collect();
        Self { width: image.width() as usize, pixels }
    }

    /// Columns `from` to `to`, the latter excluded.
    fn columns(&self, from: usize, to: usize) -> Vec<[u8; 4]> {
        self.pixels.chunks(self.width).flat_map(|row| row[from..to].to_vec()).collect()
    }

    /// Which pixels show the terrain.
    fn covered(&self) -> Vec<bool> {
        self.pixels.iter().map(|p| *p != MAGENTA).collect()
    }
}

fn differing(a: &[[u8; 4]], b: &[[u8; 4]]) -> usize {
    differing_by_more_than(0, a, b)
}

/// Pixels of which a channel differs by more than `tolerance`.
fn differing_by_more_than(tolerance: u8, a: &[[u8; 4]], b: &[[u8; 4]]) -> usize {
    assert_eq!(a.len(), b.len());
    let far = |p: &[u8; 4], q: &[u8; 4]| p.iter().zip(q).any(|(x, y)| x.abs_diff(*y) > tolerance);
    a.iter().zip(b).filter(|(p, q)| far(p, q)).count()
}

/// Exit code 2 and one line that holds all the words.
fn refused(args: &[&str], words: &[&str]) {
    let folder = TempDir::new().expect("a folder");
    let at = folder.path().join("a.png");
    let out = render(&[args, &["-o", at.to_str().expect("text")]].concat()).code(2);
    let text = String::from_utf8_lossy(&out.get_output().stderr).to_string();
    let lines: Vec<&str> = text.lines().filter(|l| l.starts_with("tessclip: error")).collect();
    assert_eq!(lines.len(), 1, "{text}");
    for word in words {
        assert!(lines[0].contains(word), "'{word}' is not in: {text}");
    }
    assert!(!at.exists());
}

#[test]
fn values_that_do_not_suit_are_refused() {
    let plain = "procedural:plain?size=65";
    for sun in ["10", "10,91", "10,-90.5", "nan,3", "1,2,3"] {
        refused(&[plain, &format!("--sun={sun}")], &["--sun", sun, "-90 to 90"]);
    }
    refused(&[plain, "--color", "eror"], &["eror", "--color"]);
    refused(&[plain, "--bounds=maybe"], &["maybe", "--bounds"]);
    refused(&[plain, "--beside", "raom"], &["raom", "--beside", "roam"]);
    refused(&[plain, "--beside", "roam", "--size", "1x9"], &["--beside", "2 pixels"]);
    refused(&[plain, "--freeze", "1,2"], &["freeze", "2 numbers"]);
    refused(&[plain, "--freeze", "1,2,x,4,5"], &["freeze", "'x'"]);
    refused(&["procedural:planet?size=257", "--freeze", "0,91,1,0,0"], &["freeze", "latitude"]);
    refused(&[plain, "--from", "1,2,3,4,5"], &["--from", "--color refill"]);
    refused(&[plain, "--color", "refill", "--from", "1"], &["--from", "1 numbers"]);
    refused(&[plain, "--color", "error", "--n", "63"], &["63"]);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_sun_and_colourings_change_colours_where_the_terrain_is_and_nothing_else() {
    common::gpu();
    let plain = Picture::with(&[]);
    let covered = plain.covered();
    let ground = covered.iter().filter(|c| **c).count();
    assert!(ground > SIZE[0] * SIZE[1] / 10 && ground < SIZE[0] * SIZE[1], "{ground} pixels of ground");
    assert!(Picture::with(&["--sun=315,35"]).pixels == plain.pixels);
    assert!(Picture::with(&["--sun", "-45,35"]).pixels == plain.pixels);
    let mut seen = vec![plain.pixels];
    for args in [["--sun", "90,10"], ["--sun", "90,60"], ["--color", "error"], ["--color", "refill"]] {
        let other = Picture::with(&args);
        let moved = other.covered().iter().zip(&covered).filter(|(a, b)| a != b).count();
        // For errors windows are whole blocks: coarser levels begin elsewhere, and outlines with them.
        let most = if args[1] == "error" { ground / 20 } else { 0 };
        assert!(moved <= most, "{args:?}: {moved} pixels of outline");
        for known in &seen {
            let changed = differing(&other.pixels, known);
            assert!(changed > ground / 4, "{args:?}: {changed} of {ground} pixels");
        }
        seen.push(other.pixels);
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn bounds_are_lines_over_the_picture() {
    common::gpu();
    let plain = Picture::with(&["--bounds=false"]);
    let boxes = Picture::with(&["--bounds"]);
    let changed = differing(&plain.pixels, &boxes.pixels);
    assert!(changed > 100 && changed < plain.pixels.len() * 3 / 4, "{changed} pixels changed");
    // Boxes rise above the ground: some of their lines stand before the sky, and none hides it away.
    let (ground, with_boxes) = (plain.covered(), boxes.covered());
    assert!(ground.iter().zip(&with_boxes).all(|(a, b)| *b || !*a));
    assert!(ground.iter().zip(&with_boxes).any(|(a, b)| *b && !*a));
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn refill_shows_what_the_frame_before_did_not_have() {
    common::gpu();
    // In the middle, where the finest window has room to move on all sides.
    let camera = ["--color", "refill", "--keep-fine-levels", "--camera", "3900,3900,5500,0,-60"];
    let from = |pose: &str| Picture::with(&[&camera[..], &["--from", pose]].concat());
    let first = Picture::with(&camera);
    // From the same place nothing is left to refill; from elsewhere a part is.
    let again = from("3900,3900,5500,0,-60");
    let moved = from("3900,3300,5500,0,-60");
    assert!(first.covered() == again.covered() && first.covered() == moved.covered());
    let ground = first.covered().iter().filter(|c| **c).count();
    let all = differing(&first.pixels, &again.pixels);
    let part = differing(&moved.pixels, &again.pixels);
    assert!(all > ground / 2, "{all} of {ground} pixels");
    assert!(part > 0 && part < all, "{part} of {all} pixels");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn frozen_windows_and_culling_stay_while_the_camera_moves() {
    common::gpu();
    let above = ["--camera", "3840,3840,9000,0,-90", "--keep-fine-levels"];
    let plain = Picture::with(&above);
    let with = |pose: &str| Picture::with(&[&above[..], &["--freeze", pose]].concat());
    assert!(with("3840,3840,9000,0,-90").pixels == plain.pixels);
    // Frozen from the middle to the north: what lies south of it was never made.
    let frozen = with("3840,3840,2500,0,-20");
    let rows = |picture: &Picture, rows: std::ops::Range<usize>| {
        let covered = picture.covered();
        covered[rows.start * SIZE[0]..rows.end * SIZE[0]].iter().filter(|c| **c).count()
    };
    let (north, south) = (0..SIZE[1] / 2, SIZE[1] / 2..SIZE[1]);
    assert!(rows(&frozen, north.clone()) > rows(&plain, north) / 4);
    assert!(rows(&frozen, south.clone()) < rows(&plain, south) / 2);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_left_half_beside_a_rival_is_a_picture_of_half_the_width() {
    common::gpu();
    let sized = |size: &'static str, more: &[&str]| Picture::of(&[&LOOK[..], &[size], more].concat());
    let alone = sized("80x90", &[]);
    for method in ["tessellated", "geomipmap", "classic", "brute-force"] {
        let both = sized("161x90", &["--beside", method]);
        assert!(both.width == 161 && both.columns(0, 80) == alone.pixels, "{method}");
        let right = both.columns(80, 161);
        let ground = right.iter().filter(|p| **p != MAGENTA).count();
        let ours = alone.covered().iter().filter(|c| **c).count();
        assert!(ground.abs_diff(ours) < ours / 10, "{method}: {ground} pixels of ground, {ours} of ours");
    }
    // Ours beside ours is twice the same picture, but for what the viewport's offset rounds.
    let both = sized("160x90", &["--beside", "tessellated"]);
    let wrong = differing_by_more_than(4, &both.columns(80, 160), &alone.pixels);
    assert!(wrong < alone.pixels.len() / 100, "{wrong} pixels");
    // Only ours has edges.
    let edges = sized("160x90", &["--beside", "geomipmap", "--wireframe"]);
    let plain = sized("160x90", &["--beside", "geomipmap"]);
    assert!(edges.columns(80, 160) == plain.columns(80, 160));
    assert!(differing(&edges.columns(0, 80), &plain.columns(0, 80)) > 100);
    // Ours frozen, the rival not.
    let frozen = sized("160x90", &["--beside", "geomipmap", "--freeze", "0,0,2000,200,0"]);
    assert!(frozen.columns(80, 160) == plain.columns(80, 160));
    assert!(differing(&frozen.columns(0, 80), &plain.columns(0, 80)) > 100);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn what_a_rival_cannot_draw_is_said() {
    common::gpu();
    let folder = TempDir::new().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("text").to_string();
    refused(&[TERRAIN, "--base", "wgs84", "--beside", "classic"], &["beside classic", "--base plane"]);
    // One void in a square degree.
    let mut samples = vec![[0_u8, 100]; 1201 * 1201];
    samples[777] = [0x80, 0];
    let dem = path("N46E008.hgt");
    std::fs::write(&dem, samples.concat()).expect("written");
    let voids = [dem.as_str(), "--base", "plane", "--beside", "roam"];
    refused(&voids, &["beside roam", "--nodata fill"]);
    let store = path("t.zarr");
    let build = ["-q", "build", TERRAIN, "-o", store.as_str()];
    Command::cargo_bin("tessclip").expect("built").args(build).assert().success();
    refused(&[store.as_str(), "--beside", "tessellated"], &["beside tessellated", "streamed store"]);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_scene_file_says_what_the_options_say() {
    common::gpu();
    let folder = TempDir::new().expect("a folder");
    let at = folder.path().join("scene.toml");
    let text = format!(
        "[terrain]\nsource = '{TERRAIN}'\n[clipmap]\nn = 127\n\
         [look]\ncolor = 'error'\nbounds = true\nfog = false\nbackground = 'ff00ff'\nsun = [-100, 50]\n\
         beside = 'geomipmap'\n[camera]\npose = [3840, 0, 5000, 0, -40]\nfreeze = [3840, 1000, 3000, 10, -30]\n\
         size = '160x90'\n"
    );
    std::fs::write(&at, text).expect("written");
    let options = [
        "--color=error",
        "--bounds",
        "--sun=260,50",
        "--beside=geomipmap",
        "--camera=3840,0,5000,0,-40",
        "--freeze=3840,1000,3000,10,-30",
    ];
    let (file, said) = (Picture::of(&[at.to_str().expect("text")]), Picture::with(&options));
    assert!(file.pixels == said.pixels, "{} pixels differ", differing(&file.pixels, &said.pixels));
    // Each of them matters: none was left out of both.
    for left_out in options {
        let rest: Vec<&str> = options.into_iter().filter(|option| *option != left_out).collect();
        assert!(Picture::with(&rest).pixels != said.pixels, "{left_out} changes nothing");
    }
    // The command line goes before the file.
    let over = [at.to_str().expect("text"), "--beside=roam", "--bounds=false", "--sun", "0,90"];
    let again = [&options[..], &["--beside=roam", "--bounds=false", "--sun=0,90"]].concat();
    let again: Vec<&str> = again
        .into_iter()
        .filter(|o| !["--bounds", "--sun=260,50", "--beside=geomipmap"].contains(o))
        .collect();
    assert!(Picture::of(&over).pixels == Picture::with(&again).pixels);
}

/// The texts of a picture by their keywords.
fn texts(at: &Path) -> Vec<(String, String)> {
    let file = std::io::BufReader::new(std::fs::File::open(at).expect("a file"));
    let reader = png::Decoder::new(file).read_info().expect("a picture");
    let info = reader.info();
    let plain = info.uncompressed_latin1_text.iter().map(|t| (t.keyword.clone(), t.text.clone()));
    plain.chain(info.utf8_text.iter().map(|t| (t.keyword.clone(), t.get_text().expect("text")))).collect()
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_picture_says_where_it_was_taken_and_asked_for_how() {
    common::gpu();
    let folder = TempDir::new().expect("a folder");
    let [a, b] =
        ["ä 1.png", "b.png"].map(|name| folder.path().join(name).to_str().expect("text").to_string());
    let software = ("Software".to_string(), format!("tessclip {}", env!("CARGO_PKG_VERSION")));
    let of = |texts: &[(String, String)], key: &str| {
        texts.iter().find(|(known, _)| known == key).map(|(_, text)| text.clone())
    };
    // By default the pose alone: equal pictures are equal files, whatever they were called.
    let args = [TERRAIN, "--n", "31", "--size", "32x18", "--camera=-100,0.25,3000,0,-30"];
    for to in [a.as_str(), b.as_str()] {
        render(&[&args[..], &["-o", to]].concat()).success();
    }
    assert!(std::fs::read(&a).expect("a file") == std::fs::read(&b).expect("a file"));
    let camera = ("tessclip:camera".to_string(), "-100,0.25,3000,0,-30".to_string());
    assert_eq!(texts(Path::new(&a)), [software, camera]);
    render(&[&args[..], &["--metadata", "-o", a.as_str()]].concat()).success();
    let said = texts(Path::new(&a));
    assert_eq!(of(&said, "tessclip:terrain").as_deref(), Some(TERRAIN));
    let line = format!(
        "tessclip render '{TERRAIN}' --n 31 --size 32x18 --camera=-100,0.25,3000,0,-30 --metadata -o '{a}'"
    );
    assert_eq!(of(&said, "tessclip:render"), Some(line));
    // The pose that is taken where none is given draws the same picture.
    render(&[&args[..5], &["-o", b.as_str()]].concat()).success();
    let pose = of(&texts(Path::new(&b)), "tessclip:camera").expect("a pose");
    render(&[&args[..5], &["--camera", pose.as_str(), "-o", a.as_str()]].concat()).success();
    let [whole, again] = [&b, &a].map(|name| Picture::read(Path::new(name)).pixels);
    let wrong = differing_by_more_than(4, &whole, &again);
    assert!(wrong < whole.len() / 50, "{wrong} pixels after the pose {pose}");
}
