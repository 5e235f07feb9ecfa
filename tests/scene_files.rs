//! Scene files: every example is understood, every mistake is refused in one line that says where.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

use std::path::Path;

use assert_cmd::Command;
use tempfile::TempDir;

fn tessclip(args: &[&str]) -> assert_cmd::assert::Assert {
    Command::cargo_bin("tessclip").expect("built").args(args).assert()
}

/// The plan of a scene, as JSON.
fn plan(args: &[&str]) -> serde_json::Value {
    let out = tessclip(&[&["plan", "--json"], args].concat()).success();
    serde_json::from_slice(&out.get_output().stdout).expect("json")
}

/// A scene file beside nothing else.
struct File {
    dir: TempDir,
}

impl File {
    fn new(text: &str) -> Self {
        let dir = TempDir::new().expect("a folder");
        std::fs::write(dir.path().join("scene.toml"), text).expect("written");
        Self { dir }
    }

    fn path(&self) -> String {
        self.dir.path().join("scene.toml").to_str().expect("text").to_string()
    }
}

/// The error of a scene file: exit code 2, one line with all the words.
fn refused(text: &str, words: &[&str]) {
    let file = File::new(text);
    let out = tessclip(&["plan", &file.path()]).code(2);
    let said = String::from_utf8_lossy(&out.get_output().stderr).to_string();
    let said = said.trim_end();
    assert!(said.starts_with("tessclip: error:") && !said.contains('\n'), "{said}");
    for word in words.iter().chain(&["scene.toml"]) {
        assert!(said.contains(word), "'{word}' is not in: {said}");
    }
}

#[test]
fn every_example_is_understood_and_they_cover_all_bases() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
    let mut bases = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let text = std::fs::read_to_string(&path).expect("text");
        assert!(text.starts_with("# "), "{}: begins with no comment", path.display());
        let plan = plan(&[path.to_str().expect("text")]);
        bases.push(plan["base"].as_str().expect("a base").to_string());
    }
    bases.sort();
    let wanted = [
        "cylinder:7000",
        "cylinder:9000,inside",
        "moon",
        "plane",
        "sampled",
        "torus:10000,3500",
        "wgs84",
        "wgs84",
    ];
    assert_eq!(bases, wanted);
}

const ALL: &str = "
[terrain]
source = 'procedural:mountains?size=300'
base = 'plane'
over = []
exaggeration = 2
spacing = 10.0
z_scale = 1.5
z_offset = -3
nodata = 'fill'
prefilter = 'low-pass'
[clipmap]
n = 63
levels = 2
morph = true
cull = false
drop_fine_levels = false
[look]
color = 'elevation'
wireframe = true
bounds = false
fog = false
background = 'ff8000'
sun = [-10, 80.5]
beside = 'geomipmap'
[camera]
pose = [1, 2.5, 3e3, -4, -90]
freeze = [0, 0, 1e3, 0, -45]
fov = 45
size = '64x36'
";

fn constant(plan: &serde_json::Value, pass: &str, name: &str) -> Option<f64> {
    let pass = plan["passes"].as_array()?.iter().find(|p| p["pass"] == pass)?;
    pass["constants"].as_array()?.iter().find(|c| c["name"] == name)?["value"].as_f64()
}

#[test]
fn the_command_line_goes_before_the_file() {
    let file = File::new(ALL);
    let path = file.path();
    let said = plan(&[&path]);
    assert_eq!((said["n"].as_u64(), said["levels"].as_u64()), (Some(63), Some(2)));
    assert_eq!(constant(&said, "cull_quads", "MORPH"), Some(1.0));
    assert_eq!(constant(&said, "cull_quads", "CULL"), Some(0.0));
    assert_eq!(constant(&said, "draw_terrain", "COLOR_MODE"), Some(3.0));
    assert_eq!(said["passes"].as_array().map(Vec::len), Some(5));
    let args = ["--n", "31", "--morph=false", "--no-cull=false", "--color", "slope", "--wireframe=false"];
    let over = plan(&[&[path.as_str()], &args[..]].concat());
    assert_eq!((over["n"].as_u64(), over["levels"].as_u64()), (Some(31), Some(2)));
    assert_eq!(constant(&over, "cull_quads", "MORPH"), Some(0.0));
    assert_eq!(constant(&over, "cull_quads", "CULL"), Some(1.0));
    assert_eq!(constant(&over, "draw_terrain", "COLOR_MODE"), Some(4.0));
    assert_eq!(over["passes"].as_array().map(Vec::len), Some(6));
    assert_eq!(plan(&[&path, "--base", "wgs84", "--prefilter", "subsample"])["base"], "wgs84");
}

#[test]
fn bounds_and_colourings_are_asked_for_by_file_and_command_line_alike() {
    let passes = |args: &[&str]| -> Vec<String> {
        let plan = plan(args);
        let names = plan["passes"].as_array().expect("passes").iter();
        names.map(|p| p["pass"].as_str().expect("a name").to_string()).collect()
    };
    let color = |args: &[&str]| constant(&plan(args), "draw_terrain", "COLOR_MODE").expect("a number");
    let with = |look: &str| File::new(&format!("[terrain]\nsource = 'procedural:plain'\n[look]\n{look}\n"));
    let plain = ["procedural:plain"];
    let boxes = with("bounds = true");
    assert!(!passes(&plain).contains(&"draw_bounds".into()));
    assert!(passes(&[plain[0], "--bounds"]).contains(&"draw_bounds".into()));
    assert_eq!(passes(&[&boxes.path()]), passes(&[plain[0], "--bounds"]));
    assert_eq!(passes(&[&boxes.path(), "--bounds=false"]), passes(&plain));
    let mut colors = vec![color(&plain)];
    for name in ["levels", "blocks", "elevation", "slope", "error", "refill"] {
        let said = color(&[plain[0], "--color", name]);
        assert_eq!(color(&[&with(&format!("color = '{name}'")).path()]), said, "{name}");
        assert!(!colors.contains(&said), "{name}: {said} in {colors:?}");
        colors.push(said);
    }
}

#[test]
fn a_plan_is_readable_as_a_table() {
    let out = tessclip(&["plan", "procedural:mountains", "--color", "elevation", "--no-cull"]).success();
    let text = String::from_utf8_lossy(&out.get_output().stdout).to_string();
    for word in ["passes (5, 19 bindings)", "base is a plane: no position texture", "MB saved", "host's"] {
        assert!(text.contains(word), "'{word}' is not in: {text}");
    }
    assert!(!text.contains("\n  bound_blocks"));
}

#[test]
fn paths_are_relative_to_the_scene_file_and_info_reads_its_terrain() {
    let file = File::new("[terrain]\nsource = 'dem.png'\nspacing = 7.5\n");
    let samples: Vec<u8> = (0..70_u16 * 50).flat_map(|v| (v % 97).to_ne_bytes()).collect();
    let dem = file.dir.path().join("dem.png");
    image::save_buffer(dem, &samples, 70, 50, image::ColorType::L16).expect("written");
    assert_eq!(plan(&[&file.path()])["base"], "plane");
    let out = tessclip(&["info", &file.path(), "--json"]).success();
    let info: serde_json::Value = serde_json::from_slice(&out.get_output().stdout).expect("json");
    assert_eq!((info["width"].as_u64(), info["spacing_m"][0].as_f64()), (Some(70), Some(7.5)));
    let out = tessclip(&["info", &file.path(), "--spacing", "9", "--json"]).success();
    let info: serde_json::Value = serde_json::from_slice(&out.get_output().stdout).expect("json");
    assert_eq!(info["spacing_m"][0], 9.0);
}

#[test]
fn a_name_that_is_not_known_is_refused_with_the_nearest() {
    let source = "[terrain]\nsource = 'procedural:plain'\n";
    refused(
        &format!("{source}exagerration = 2\n"),
        &["line 3", "terrain.exagerration", "`terrain.exaggeration`"],
    );
    refused(&format!("{source}[look]\ncolour = 'slope'\n"), &["line 4", "look.colour", "`look.color`"]);
    // A key of another table.
    refused(&format!("{source}\n[clipmap]\nfog = true\n"), &["line 5", "clipmap.fog", "`look.fog`"]);
    refused(&format!("{source}[cammera]\n"), &["line 3", "unknown table", "cammera", "`camera`"]);
    // A key outside any table.
    refused(&format!("exaggeratio = 3\n{source}"), &["line 1", "`terrain.exaggeration`"]);
}

#[test]
fn values_that_do_not_suit_are_refused() {
    let with = |rest: &str| format!("[terrain]\nsource = 'procedural:plain'\n{rest}\n");
    refused(&with("exaggeration = 'high'"), &["line 3", "terrain.exaggeration", "give a number"]);
    refused(&with("exaggeration = nan"), &["line 3", "finite"]);
    refused(&with("base = 'plain'"), &["line 3", "terrain.base", "plain", "plane"]);
    refused(&with("nodata = 'fil'"), &["line 3", "`fil`", "`fill`"]);
    refused(&with("over = 'a.tif'"), &["line 3", "list in brackets"]);
    refused(&with("[clipmap]\nn = -3"), &["line 4", "clipmap.n", "not negative"]);
    refused(&with("[clipmap]\nn = 6.5"), &["line 4", "whole number"]);
    refused(&with("[clipmap]\nmorph = 1"), &["line 4", "true or false"]);
    refused(&with("[look]\ncolor = 'slop'"), &["line 4", "`slop`", "`slope`"]);
    refused(&with("[look]\nsun = [1, 2, 3]"), &["line 4", "2 numbers, not 3"]);
    refused(&with("[look]\nsun = [1, 90.5]"), &["line 4", "look.sun", "-90 to 90"]);
    refused(&with("[look]\nbounds = 1"), &["line 4", "look.bounds", "true or false"]);
    refused(&with("[look]\nbeside = 'raom'"), &["line 4", "look.beside", "`raom`", "roam"]);
    refused(&with("[look]\nbackground = 'red'"), &["line 4", "six hexadecimal"]);
    refused(&with("[camera]\npose = [1, 2]"), &["line 4", "5 numbers, not 2"]);
    refused(&with("[camera]\nfreeze = [1, 2, 3, 4]"), &["line 4", "camera.freeze", "5 numbers, not 4"]);
    refused(&with("[camera]\nsize = [640, 360]"), &["line 4", "camera.size", "text in quotes"]);
    refused(&with("[camera]\nsize = '640'"), &["line 4", "1280x720"]);
}

#[test]
fn files_that_are_no_scenes_are_refused() {
    refused("[terrain\n", &["line 1", "not TOML"]);
    refused("[terrain]\nsource = 'a'\nsource = 'b'\n", &["line 3", "duplicate"]);
    refused("terrain = 3\n", &["line 1", "[terrain]"]);
    refused("[look]\nfog = true\n", &["source in [terrain]"]);
    refused("[terrain]\nsource = ''\n", &["line 2", "terrain.source"]);
    refused("[terrain]\nsource = 'other.toml'\n", &["line 2", "other.toml"]);
    let out = tessclip(&["plan", "/no/such/scene.toml"]).code(2);
    let said = String::from_utf8_lossy(&out.get_output().stderr).to_string();
    assert!(said.contains("/no/such/scene.toml") && said.trim_end().lines().count() == 1, "{said}");
}
