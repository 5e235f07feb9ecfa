//! Flies large stores, cold, at all speeds and along all paths, and flies with readers that are slow.
//!
//! `cargo bench --bench stress` makes a store of 16,385 x 16,385 samples under target/stress (three minutes and
//! a gigabyte, once); with TESSCLIP_STRESS_65K=1 one of 65,537 x 65,537 besides (ten minutes, 4.5 GB). A folder
//! with stores m16k.zarr and d65k.zarr may be named in TESSCLIP_STRESS_STORES. Times never gate a test.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a bench, not a library"
)]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use tessclip::gpu::{Gpu, Offscreen};
use tessclip::measure::FrameStatistics;
use tessclip::pyramid::store::{Folder, ReadAt, Store};
use tessclip::stream::{StreamOptions, TileSource};
use tessclip::{Camera, Renderer, Scene, Target, Terrain};

const STORES: [(&str, &str, &str); 2] = [
    ("m16k.zarr", "procedural:mountains?size=16385", "0"),
    ("d65k.zarr", "procedural:dunes?size=65537", "0.25"),
];

fn main() {
    let folder = std::env::var_os("TESSCLIP_STRESS_STORES")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("target/stress"), PathBuf::from);
    std::fs::create_dir_all(&folder).unwrap();
    let large = std::env::var_os("TESSCLIP_STRESS_65K").is_some();
    for (name, recipe, max_error) in STORES.iter().take(if large { 2 } else { 1 }) {
        let store = folder.join(name);
        if !store.exists() {
            let args = ["build", recipe, "--max-error", max_error, "-o"];
            let program = env!("CARGO_BIN_EXE_tessclip");
            assert!(Command::new(program).args(args).arg(&store).status().unwrap().success());
        }
        println!("{name}");
        flights(&store);
        slow_readers(&store);
    }
}

/// A flight in a process of its own, so that its cache is cold; the run of its report.
fn fly(store: &Path, more: &[&str]) -> serde_json::Value {
    let report = std::env::temp_dir().join(format!("tessclip-stress-{}", std::process::id()));
    let fixed = ["-q", "fly", "--size", "640x360", "--n", "127", "--levels", "7", "--report"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_tessclip"));
    let out = command.args(fixed).arg(&report).arg(store).args(more).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let text = std::fs::read_to_string(report.join("report.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    std::fs::remove_dir_all(&report).unwrap();
    json["runs"][0].clone()
}

fn flights(store: &Path) {
    let mut rows = Vec::new();
    let mut add = |path: &'static str, speed: &'static str, frames: &str| {
        let mut args = vec!["--path", path, "--frames", frames];
        if speed != "0" {
            args.extend(["--speed", speed]);
        }
        let run = fly(store, &args);
        rows.push((path, speed, run.clone()));
        run
    };
    // Standing still before, between and after: the spread is the noise of the machine.
    add("still", "0", "1000");
    for speed in ["0.1", "1", "4"] {
        add("straight", speed, "1000");
    }
    add("still", "0", "1000");
    for speed in ["16", "64"] {
        add("straight", speed, "1000");
    }
    add("still", "0", "1000");
    for path in ["double-turn", "circle", "random-walk", "follow", "orbit-to-ground"] {
        add(path, "8", "1000");
    }
    add("spin", "0", "1000");
    let teleport = add("teleport", "0", "1800");
    add("still", "0", "1000");
    let mean = |run: &serde_json::Value| run["frame_ms"]["mean"].as_f64().unwrap();
    let mut still: Vec<f64> = rows.iter().filter(|r| r.0 == "still").map(|r| mean(&r.2)).collect();
    still.sort_by(f64::total_cmp);
    let middle = 0.5 * (still[1] + still[2]);
    println!(
        "| path | windows/s | mean ms | / still | r99 | max / median | heights / bound | late frames | worst wait ms | cache MB |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for (path, speed, run) in &rows {
        row(run, path, speed, middle);
    }
    println!("standing still four times: mean {:.2} to {:.2} ms", still[0], still[3]);
    let t = &teleport["teleport_to_complete_ms"];
    println!(
        "teleport to complete picture: median {} ms, max {} ms, {} jumps",
        t["p50"], t["max"], t["count"]
    );
    let walk = ["--path", "random-walk", "--frames", "400", "--speed", "32", "--cracks", "40"];
    println!("random walk at 32 windows/s: {}", fly(store, &walk)["cracks"]);
    let run = fly(store, &["--path", "straight", "--frames", "600", "--speed", "8", "--hz", "30"]);
    println!("open loop at 30 Hz: {} of 600 deadlines missed", run["open_loop"]["deadline_misses"]);
}

fn row(run: &serde_json::Value, path: &str, speed: &str, still_ms: f64) {
    let frame = &run["frame_ms"];
    let of =
        |v: &serde_json::Value, digits: usize| v.as_f64().map_or("-".into(), |v| format!("{v:.digits$}"));
    let mean = frame["mean"].as_f64().unwrap();
    let bound = run["upload"]["height_bytes_bound"].as_f64().unwrap();
    let share = run["upload"]["height_bytes"].as_f64().unwrap() / bound.max(1.0);
    println!(
        "| {path} | {speed} | {mean:.2} | {:.3} | {} | {} | {share:.3} | {} | {} | {:.0} |",
        mean / still_ms,
        of(&frame["r99"], 2),
        of(&frame["rmax"], 2),
        run["stream"]["late_frames"],
        of(&run["stream"]["need_to_drawn_ms"]["max"], 0),
        run["stream"]["cache_bytes_max"].as_f64().unwrap_or(0.0) / 1e6,
    );
}

/// A folder whose reads take time.
struct Slow {
    folder: Folder,
    delay: Duration,
}

impl ReadAt for Slow {
    fn size(&self, file: &str) -> std::io::Result<Option<u64>> {
        self.folder.size(file)
    }

    fn read(&self, file: &str, offset: u64, length: usize) -> std::io::Result<Vec<u8>> {
        if file.contains("/elevation/c/") {
            std::thread::sleep(self.delay);
        }
        self.folder.read(file, offset, length)
    }
}

/// p99 of frames with slow readers beside that without delay, in turn.
fn slow_readers(store: &Path) {
    let gpu = Gpu::new().unwrap();
    let fast = delayed(&gpu, store, 0);
    println!("reader delay 0: p50 {:.2} p99 {:.2} ms, {} of 1000 frames late", fast.0, fast.1, fast.2);
    for delay_ms in [10, 100, 1_000, 5_000] {
        let before = delayed(&gpu, store, 0);
        let slow = delayed(&gpu, store, delay_ms);
        println!(
            "reader delay {delay_ms} ms: p50 {:.2} p99 {:.2} ms, {} of 1000 frames late; p99 / without delay {:.2} (without / without {:.2})",
            slow.0,
            slow.1,
            slow.2,
            slow.1 / before.1,
            before.1 / fast.1,
        );
    }
}

fn delayed(gpu: &Gpu, store: &Path, delay_ms: u64) -> (f64, f64, u32) {
    let slow = Slow { folder: Folder { root: store.into() }, delay: Duration::from_millis(delay_ms) };
    let store = Store::open_from(Arc::new(slow), "slow").unwrap();
    let terrain = Terrain::streamed(TileSource::new(Arc::new(store), StreamOptions::default()).unwrap());
    let scene = Scene { n: 127, levels: Some(7), ..Scene::default() };
    let size = [640, 360];
    let target = Offscreen::new(&gpu.device, size).unwrap();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene).unwrap();
    let [low, high] = terrain.extent_m();
    let top = f64::from(terrain.source.height_range().unwrap()[1]);
    let window_m = 126.0 * terrain.spacing_m[1];
    let mut times = Vec::new();
    let mut late = 0;
    for k in 0..1_000 {
        // Eight windows a second of 60 frames.
        let y = low[1] + 0.1 * (high[1] - low[1]) + f64::from(k) / 60.0 * 8.0 * window_m;
        let eye_m = DVec3::new(0.5 * (low[0] + high[0]), y.min(high[1]), top + 300.0);
        let camera = Camera { eye_m, yaw_deg: 0.0, pitch_deg: -12.0, fov_deg: 60.0, ..Camera::default() };
        let begin = Instant::now();
        let upload = renderer.prepare(&camera, size).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        renderer.record(
            &mut encoder,
            Target { color: &target.color, depth: &target.depth, clear: true, area: None },
        );
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        times.push(begin.elapsed().as_secs_f64() * 1e3);
        late += u32::from(upload.levels_missing > 0);
    }
    let s = FrameStatistics::of(&times);
    (s.p50.unwrap(), s.p99.unwrap(), late)
}
