//! The viewer as a window among others: sizes, scales, covers, files dropped on it, a lost device, how it ends.
#![cfg(all(feature = "viewer", target_os = "linux"))]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

#[path = "common/display.rs"]
mod display;
#[path = "common/drop.rs"]
mod drop;
#[path = "common/pictures.rs"]
mod pictures;

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use display::{CAMERA, Display, SMALL, SOME, TERRAIN, Viewer, folder, numbers, open, run_line};
use pictures::{differ, pixels};

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_window_takes_any_size_and_a_hidden_or_idle_one_draws_nothing() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let mut viewer = open(&display, &out, &[SMALL]);
    let idle = viewer.rest();
    std::thread::sleep(Duration::from_millis(1500));
    assert!(viewer.drain().is_empty(), "an idle window does nothing");
    let later = viewer.ask("F2", "line");
    assert_eq!(later["frames"], idle["frames"], "and draws nothing");
    viewer.rest();

    for size in [[1, 1], [3, 700], [900, 2], [801, 455], [9000, 64]] {
        let event = viewer.resize(size[0], size[1]);
        let drawn = numbers(&event, "size");
        assert_eq!(drawn, [f64::from(size[0].min(8192)), f64::from(size[1])]);
        viewer.rest();
        let (shot, _) = pixels(&viewer.shoot(false));
        assert_eq!(shot, [size[0].min(8192), size[1]]);
    }
    viewer.resize(640, 360);
    viewer.rest();

    let mut kinds: Vec<String> =
        (0..4).map(|_| viewer.ask("F6", "vsync")["vsync"].as_str().expect("a kind").to_string()).collect();
    assert_eq!(kinds.last().map(String::as_str), Some("auto"), "once around: {kinds:?}");
    kinds.dedup();
    assert!(kinds.len() > 1, "{kinds:?}");
    viewer.key("F11");
    viewer.key("F11");
    viewer.rest();

    viewer.unmap();
    viewer.map();
    viewer.ask("F3", "idle");
    assert!(viewer.quit().success());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_covered_window_draws_nothing_while_a_path_goes_on() {
    let (display, out) = (Display::open([700, 400]), folder());
    let mut viewer = open(&display, &out, &[SMALL, "--path=circle"]);
    let mut frames = || viewer.ask("F2", "line")["frames"].as_u64().expect("a count");
    let before = frames();
    std::thread::sleep(SOME);
    assert!(frames() > before, "a replay draws");
    let cover = drop::cover(&display.name);
    std::thread::sleep(SOME);
    let hidden = frames();
    std::thread::sleep(SOME);
    assert_eq!(frames(), hidden, "nobody sees it");
    std::mem::drop(cover);
    std::thread::sleep(SOME);
    assert!(frames() > hidden, "and it goes on");
    assert!(viewer.quit().success());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn panels_leave_the_middle_free_at_both_scales_and_help_does_not() {
    let (display, out) = (Display::open([2600, 1500]), folder());
    for (scale, size) in [("1", "--size=1280x720"), ("2", "--size=2560x1440")] {
        let mut command = Viewer::command(&display, out.path(), &[TERRAIN, CAMERA, "--n=127", size]);
        command.env("WINIT_X11_SCALE_FACTOR", scale);
        let mut viewer = Viewer::run(&display, out.path(), command);
        viewer.rest();
        let (size, plain) = pixels(&viewer.shoot(false));
        let (_, panels) = pixels(&viewer.shoot(true));
        viewer.key("F1");
        viewer.rest();
        let (_, help) = pixels(&viewer.shoot(true));
        let changed = |other: &[[u8; 4]], middle: bool| {
            let inside = |k: usize| {
                let at = [k as u32 % size[0], k as u32 / size[0]];
                (0..2).all(|a| at[a] * 4 >= size[a] && at[a] * 4 < 3 * size[a])
            };
            let counted = plain.iter().zip(other).enumerate().filter(|(k, _)| inside(*k) == middle);
            counted.filter(|(_, (a, b))| a != b).count()
        };
        let all = (size[0] * size[1]) as usize;
        assert_eq!(changed(&panels, true), 0, "scale {scale}");
        assert!(changed(&panels, false) > all / 30, "scale {scale}: the panels are there");
        assert!(changed(&help, true) > all / 20, "scale {scale}: the help is there");
        assert!(viewer.quit().success());
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn files_dropped_on_it_are_opened_or_refused_and_the_old_terrain_stays() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let mut viewer = open(&display, &out, &[SMALL, "--beside=roam", "--exaggeration=2"]);
    viewer.rest();
    let scene = out.path().join("dunes.toml");
    let text = "[terrain]\nsource = 'procedural:dunes?size=513'\n[look]\ncolor = 'slope'\n\
                [camera]\npose = [5000.5, 2000, 900, 15, -12]\n";
    std::fs::write(&scene, text).expect("written");
    let junk = out.path().join("junk.tif");
    std::fs::write(&junk, "no picture").expect("written");
    let drop = |viewer: &mut Viewer, file: &Path| {
        viewer.drain();
        let (window, display) = viewer.handle();
        drop::drop_file(display, window, file);
    };
    drop(&mut viewer, &junk);
    let refused = viewer.wait("problem");
    assert!(refused["message"].as_str().is_some_and(|m| m.contains("junk.tif")), "{refused}");
    drop(&mut viewer, &scene);
    let opened = viewer.wait("opened");
    assert_eq!((opened["color"].as_str(), numbers(&opened, "pose")[0]), (Some("slope"), 5000.5), "{opened}");
    viewer.rest();
    let shot = viewer.shoot(false);
    let again = out.path().join("again.png");
    run_line(&format!("tessclip render {} --size 640x360 -o view.png", scene.display()), &again);
    assert_eq!(differ(&shot, &again), 0, "nothing of the old look is left");
    assert!(viewer.quit().success());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_lost_device_is_told_and_replaced() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let mut viewer = open(&display, &out, &[SMALL]);
    viewer.rest();
    let before = viewer.shoot(false);
    assert!(viewer.quit().success());
    let mut viewer = open(&display, &out, &[SMALL, "--lose-device-at=2"]);
    viewer.wait("device-lost");
    viewer.rest();
    let after = viewer.shoot(false);
    assert_eq!(differ(&before, &after), 0);
    assert!(viewer.quit().success());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn it_ends_by_itself_after_so_many_frames() {
    let (display, out) = (Display::open([1300, 800]), folder());
    let mut viewer = open(&display, &out, &[SMALL, "--frames=20", "--vsync=immediate", "--path=circle"]);
    let quit = viewer.wait("quit");
    assert!(quit["frames"].as_u64() >= Some(20) && quit["frame_ms_p50"].as_f64() > Some(0.0), "{quit}");
    assert!(viewer.ended().success());
}

#[test]
fn without_a_display_or_a_terrain_one_line_says_what_to_do() {
    let run = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tessclip"));
        command.args(args).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        let done = command.output().expect("runs");
        let words = String::from_utf8_lossy(&done.stderr).into_owned();
        let lines: Vec<String> =
            words.lines().filter(|l| !l.contains("XDG_RUNTIME_DIR")).map(String::from).collect();
        (done.status.code(), lines)
    };
    let (code, lines) = run(&["view", "procedural:plain?size=65"]);
    assert_eq!((code, lines.len()), (Some(2), 1), "{lines:?}");
    assert!(lines[0].contains("DISPLAY") && lines[0].contains("tessclip render"), "{lines:?}");
    let (code, lines) = run(&["view", "procedural:plain?size=65", "--path", "/no/such/path.csv"]);
    assert_eq!((code, lines.len()), (Some(2), 1), "{lines:?}");
    assert!(lines[0].contains("/no/such/path.csv"), "before a window is asked for: {lines:?}");
    let (code, lines) = run(&["view", "/no/such/terrain.tif"]);
    assert_eq!((code, lines.len()), (Some(2), 1), "{lines:?}");
    assert!(lines[0].contains("/no/such/terrain.tif"), "{lines:?}");
}
