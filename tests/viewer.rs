//! The viewer in a real window under a virtual X server, driven by keys and mouse; looked at by its screenshots.
#![cfg(all(feature = "viewer", target_os = "linux"))]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

#[path = "common/display.rs"]
mod display;
#[path = "common/pictures.rs"]
mod pictures;

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use display::{CAMERA, Display, SMALL, SOME, TERRAIN, Viewer, folder, numbers, open, run_line};
use pictures::{differ, pixels, text};
use serde_json::Value;

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn it_flies_stays_out_of_the_ground_and_comes_to_rest() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let mut viewer = open(&display, &out, &[SMALL]);
    let start = viewer.rest();
    viewer.hold("w", SOME);
    let ahead = viewer.wait("rest");
    let (from, to) = (numbers(&start, "pose"), numbers(&ahead, "pose"));
    assert!(to[1] > from[1] + 1.0 && to[2] < from[2], "forward is north and down: {from:?} -> {to:?}");
    assert_eq!(from[3..], to[3..], "the view stays");

    for _ in 0..8 {
        viewer.key("equal");
    }
    viewer.hold("q", Duration::from_secs(2));
    let down = viewer.wait("rest");
    let above = down["above_m"].as_f64().expect("over ground");
    assert!(above > 0.3 && above < 40.0, "down to the ground and not into it: {above} m");

    viewer.ask("t", "follow");
    viewer.hold("w", SOME);
    let followed = viewer.wait("rest")["above_m"].as_f64().expect("over ground");
    assert!(followed > 0.3 && followed < 3.0 * above + 5.0, "{followed} m after {above} m");

    viewer.move_mouse(320, 180);
    viewer.mouse("click", 1);
    viewer.nudge_mouse(120, 0);
    std::thread::sleep(SOME);
    let turned = numbers(&viewer.ask("F2", "line"), "pose");
    assert!((turned[3] - from[3]).abs() > 3.0, "{turned:?}");
    viewer.key("Escape");
    viewer.nudge_mouse(80, 0);
    let still = viewer.ask("F2", "line");
    assert_eq!(numbers(&still, "pose")[3], turned[3], "a free mouse does not turn");
    assert!(viewer.quit().success());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn every_view_differs_and_its_line_draws_it_again() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let mut viewer = open(&display, &out, &[SMALL]);
    viewer.rest();
    let mut pictures: Vec<std::path::PathBuf> = Vec::new();
    let steps: [(&str, &[&str]); 14] = [
        ("shaded", &[]),
        ("levels", &["2"]),
        ("blocks", &["3"]),
        ("elevation", &["4"]),
        ("slope", &["5"]),
        ("error", &["6"]),
        ("wireframe", &["2", "x"]),
        ("bounds", &["x", "b"]),
        ("frozen", &["1", "c"]),
        ("unfrozen, exaggerated", &["c", "bracketright"]),
        ("sun", &["shift+Right", "shift+Up"]),
        ("view", &["shift+period", "f"]),
        ("by error", &["u"]),
        ("a rival beside", &["u", "v"]),
    ];
    for (name, keys) in steps {
        for key in keys {
            viewer.ask(key, "look");
            viewer.rest();
        }
        if name == "frozen" {
            // Out of the frozen view, where it is seen that nothing follows.
            viewer.hold("s", SOME);
            viewer.wait("rest");
            viewer.rest();
        }
        let shot = viewer.shoot(false);
        let line = viewer.ask("F2", "line")["line"].as_str().expect("a line").to_string();
        assert_eq!(text(&shot, "tessclip:render").as_deref(), Some(line.as_str()), "{name}");
        let again = out.path().join("again.png");
        run_line(&line, &again);
        let wrong = differ(&shot, &again);
        assert_eq!(wrong, 0, "{name}: {line}");
        if let Some(before) = pictures.last() {
            assert!(differ(before, &shot) > 640 * 360 / 200, "{name} looks like the view before it");
        }
        pictures.push(shot);
    }
    // The saved scene is the same picture as well.
    let saved = viewer.ask("F4", "saved");
    let again = out.path().join("scene.png");
    run_line(&format!("tessclip render {} -o view.png", saved["path"].as_str().expect("a path")), &again);
    assert_eq!(differ(pictures.last().expect("some"), &again), 0);
    assert!(viewer.quit().success());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn refills_are_coloured_while_it_flies() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let mut viewer = open(&display, &out, &[SMALL, "--color=refill", "--path=double-turn"]);
    let orange = |path: &Path| {
        let (_, all) = pixels(path);
        all.iter().filter(|p| p[0] > p[2].saturating_add(60)).count()
    };
    let mut seen = 0;
    for _ in 0..8 {
        let event = viewer.ask("F12", "screenshot");
        seen = seen.max(orange(Path::new(event["path"].as_str().expect("a path"))));
    }
    assert!(seen > 50, "no frame of a flight showed a strip");
    viewer.ask("p", "replayed");
    viewer.rest();
    let rest = viewer.shoot(false);
    assert_eq!(orange(&rest), 0, "nothing is refilled at rest");
    assert!(viewer.quit().success());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn what_is_recorded_is_replayed_and_flown() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let mut viewer = open(&display, &out, &[SMALL]);
    viewer.rest();
    viewer.ask("r", "recording");
    viewer.hold("w", SOME);
    viewer.hold("d", SOME);
    let end = numbers(&viewer.wait("rest"), "pose");
    let recorded = viewer.ask("r", "recorded");
    assert!(recorded["keys"].as_u64().expect("a count") > 4);
    let path = recorded["path"].as_str().expect("a path").to_string();
    let lines = std::fs::read_to_string(&path).expect("written");
    assert!(lines.starts_with("t,x,y,z,yaw,pitch\n"));
    let last: Vec<f64> =
        lines.lines().last().expect("lines").split(',').map(|v| v.parse().unwrap()).collect();
    assert_eq!(last[1..], end, "the path ends where the camera does");

    viewer.hold("s", SOME);
    viewer.wait("rest");
    viewer.ask("p", "replaying");
    assert_eq!(viewer.wait("replayed")["how"], "ended");
    let back = numbers(&viewer.rest(), "pose");
    assert!(back.iter().zip(&end).all(|(a, b)| (a - b).abs() < 1.0), "{back:?} is not {end:?}");
    assert!(viewer.quit().success());

    let report = out.path().join("report");
    let done = Command::new(env!("CARGO_BIN_EXE_tessclip"))
        .args(["fly", TERRAIN, "--n=127", SMALL, "--frames=12", "--quiet", "--path", &path, "--report"])
        .arg(&report)
        .output()
        .expect("runs");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(report.join("report.json").is_file());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_captured_mouse_leaves_panels_alone_and_a_deaf_script_loses_nothing() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let mut viewer = open(&display, &out, &["--size=1280x720"]);
    viewer.rest();
    viewer.move_mouse(640, 360);
    viewer.mouse("click", 1);
    for _ in 0..8 {
        // Into the corner of the panel with the switches.
        viewer.nudge_mouse(200, -60);
    }
    std::thread::sleep(Duration::from_millis(600));
    viewer.drain();
    viewer.mouse("click", 1);
    std::thread::sleep(Duration::from_millis(600));
    let looks = viewer.drain().iter().filter(|e| e["event"] == "look").count();
    assert_eq!(looks, 0, "nothing was pressed that cannot be seen");
    viewer.key("Escape");
    viewer.key("alt+2");
    std::thread::sleep(SOME);
    assert!(viewer.drain().iter().all(|e| e["event"] != "look"), "Alt is the window system's");

    let path = viewer.ask("r", "recording")["path"].as_str().expect("a path").to_string();
    viewer.hold("w", SOME);
    let ended = viewer.go_deaf_and_quit();
    assert!(ended.success());
    let lines = std::fs::read_to_string(path).expect("written").lines().count();
    assert!(lines > 5, "the recording is whole: {lines} lines");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_mouse_orbits_flies_to_what_is_clicked_and_coordinates_can_be_typed() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let mut viewer = open(&display, &out, &[SMALL]);
    let start = numbers(&viewer.rest(), "pose");
    viewer.move_mouse(320, 240);
    viewer.mouse("mousedown", 2);
    viewer.move_mouse(380, 250);
    viewer.move_mouse(400, 260);
    viewer.mouse("mouseup", 2);
    let orbited = numbers(&viewer.rest(), "pose");
    assert!(
        (orbited[0] - start[0]).abs() > 10.0 && (orbited[3] - start[3]).abs() > 3.0,
        "{start:?} {orbited:?}"
    );

    viewer.drain();
    viewer.move_mouse(330, 250);
    viewer.mouse("click", 1);
    viewer.mouse("click", 1);
    let near = viewer.wait("rest");
    let above = |event: &Value| event["above_m"].as_f64().expect("over ground");
    let there = numbers(&near, "pose");
    let moved = (there[0] - orbited[0]).hypot(there[1] - orbited[1]);
    assert!(moved > 100.0 && above(&near) > 0.3, "{orbited:?} -> {there:?}");

    viewer.rest();
    viewer.key("g");
    std::thread::sleep(SOME);
    viewer.type_text("6000.5, 5000, 2750");
    viewer.key("Return");
    let typed = numbers(&viewer.wait("rest"), "pose");
    assert_eq!(typed[..3], [6000.5, 5000.0, 2750.0]);

    viewer.rest();
    let home = numbers(&viewer.ask("Home", "rest"), "pose");
    assert!(home[2] > 5_000.0, "from where all is seen: {home:?}");
    assert!(viewer.quit().success());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_globe_is_flown_over_and_no_rival_is_asked_twice() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let args = ["procedural:planet?size=257", "--camera=10,40,300e3,20,-40", "--n=63", SMALL];
    let mut viewer = Viewer::open(&display, out.path(), &args);
    viewer.rest();
    viewer.hold("w", SOME);
    let pose = numbers(&viewer.wait("rest"), "pose");
    assert!(pose[1] > 40.1 && pose[0] > 10.0, "north-east in degrees: {pose:?}");
    viewer.rest();
    let shot = viewer.shoot(false);
    let line = viewer.ask("F2", "line")["line"].as_str().expect("a line").to_string();
    let again = out.path().join("again.png");
    run_line(&line, &again);
    assert_eq!(differ(&shot, &again), 0, "{line}");

    // Ours can stand beside itself there; the others say why not, one after the other.
    let mut told: Vec<String> = Vec::new();
    let mut stood = 0;
    for _ in 0..10 {
        viewer.key("n");
        std::thread::sleep(SOME);
        for event in viewer.drain() {
            match event["event"].as_str() {
                Some("problem") => told.push(event["message"].as_str().expect("words").to_string()),
                Some("look") => stood += u32::from(event["beside"].is_string()),
                _ => {}
            }
        }
    }
    told.sort();
    let all = told.len();
    told.dedup();
    assert_eq!(told.len(), all, "{told:?}");
    assert!(all >= 6 && stood >= 1, "{told:?}, {stood} stood");
    viewer.key("g");
    std::thread::sleep(SOME);
    viewer.type_text("47.5N 8.25E 250000");
    viewer.key("Return");
    let there = numbers(&viewer.wait("rest"), "pose");
    assert_eq!(there[..3], [8.25, 47.5, 250_000.0]);
    assert!(viewer.quit().success());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_store_streams_in_and_a_rest_is_recorded_as_one() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let store = out.path().join("mountains.zarr");
    let built = Command::new(env!("CARGO_BIN_EXE_tessclip"))
        .args(["build", "procedural:mountains?size=1025", "--quiet", "-o"])
        .arg(&store)
        .output()
        .expect("runs");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let store = store.to_str().expect("a path");
    let mut viewer = Viewer::open(&display, out.path(), &[store, CAMERA, "--n=127", SMALL]);
    viewer.rest();
    let shot = viewer.shoot(false);
    let again = out.path().join("again.png");
    run_line(viewer.ask("F2", "line")["line"].as_str().expect("a line"), &again);
    assert_eq!(differ(&shot, &again), 0, "at rest everything is there");

    viewer.move_mouse(320, 180);
    viewer.mouse("click", 1);
    viewer.ask("r", "recording");
    std::thread::sleep(Duration::from_secs(2));
    viewer.nudge_mouse(100, 0);
    std::thread::sleep(SOME);
    let path = viewer.ask("r", "recorded")["path"].as_str().expect("a path").to_string();
    let text = std::fs::read_to_string(path).expect("written");
    let yaw_and_time = |line: &str| {
        let v: Vec<f64> = line.split(',').map(|v| v.parse().expect("a number")).collect();
        (v[4], v[0])
    };
    let keys: Vec<(f64, f64)> = text.lines().skip(1).map(yaw_and_time).collect();
    let turns = keys.windows(2).find(|k| k[0].0 != k[1].0).expect("it turned");
    assert!(turns[1].1 - turns[0].1 < 0.5 && turns[0].1 > 1.5, "it stood first: {keys:?}");

    // The middle button orbits, also while the mouse is captured.
    let before = numbers(&viewer.ask("F2", "line"), "pose");
    viewer.mouse("mousedown", 2);
    viewer.nudge_mouse(60, 0);
    viewer.nudge_mouse(10, 0);
    std::thread::sleep(SOME);
    viewer.mouse("mouseup", 2);
    let after = numbers(&viewer.ask("F2", "line"), "pose");
    assert!((after[0] - before[0]).hypot(after[1] - before[1]) > 20.0, "{before:?} {after:?}");
    assert!(viewer.quit().success());
}
