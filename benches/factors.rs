//! What the choice of factors by error costs in a frame: frames that choose once and five times, in turn (A B B A).
//! The figures are what ARCHITECTURE.md quotes. Times never gate a test.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a bench, not a library"
)]

use std::time::Instant;

use glam::DVec3;
use tessclip::gpu::{Gpu, Offscreen};
use tessclip::heights::{ReadOptions, open_terrain};
use tessclip::{Camera, Factors, Prefilter, Renderer, Scene, Target, Terrain};

const SIZE: [u32; 2] = [1280, 720];
const MORE: u32 = 4;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() {
    // `cargo test` runs benches with --test: nothing is measured then.
    if std::env::args().any(|a| a == "--test") {
        return;
    }
    let gpu = Gpu::new().expect("an adapter");
    println!("{}; {} x {}", gpu.describe(), SIZE[0], SIZE[1]);
    let grid = open_terrain("procedural:mountains?size=4097", &ReadOptions::default()).unwrap();
    let terrain = Terrain::new(&grid, Prefilter::default());
    let begin = Instant::now();
    let mut first = Vec::new();
    let none = tessclip::clipmap::Rect { lo: [0, 0], hi: [0, 0] };
    assert!(terrain.source.read_deviations(0, none, &mut first));
    println!("measuring all deviations of 4097 x 4097 samples: {:.2} s", begin.elapsed().as_secs_f64());
    for (n, pixel_error, budget) in [
        (255, Some(2.0), None),
        (255, None, Some(100_000)),
        (511, Some(2.0), None),
        (511, None, Some(100_000)),
        (1023, None, Some(100_000)),
    ] {
        let factors = Factors::ByError { pixel_error, budget };
        let scene = Scene { n, factors, ..Scene::default() };
        let mut renderer =
            Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene).unwrap();
        let [low, high] = terrain.extent_m();
        let (x, y) = (f64::midpoint(low[0], high[0]), f64::midpoint(low[1], high[1]));
        let ground = terrain.ground_height_m(x, y).map_or(0.0, f64::from);
        let eye_m = DVec3::new(x, y, ground + 200.0);
        let camera = Camera { eye_m, yaw_deg: 30.0, pitch_deg: -8.0, fov_deg: 60.0, ..Camera::default() };
        let target = Offscreen::new(&gpu.device, SIZE).unwrap();
        let mut frame = |more: u32| {
            let begin = Instant::now();
            renderer.prepare(&camera, SIZE).unwrap();
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let target = Target { color: &target.color, depth: &target.depth, clear: true, area: None };
            renderer.record_choosing_more(&mut encoder, target, more);
            gpu.queue.submit([encoder.finish()]);
            gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
            begin.elapsed().as_secs_f64() * 1e3
        };
        frame(0);
        let (mut once, mut often, mut again) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..20 {
            once.push(frame(0));
            often.push(frame(MORE));
            often.push(frame(MORE));
            again.push(frame(0));
        }
        let noise = (median(again.clone()) / median(once.clone()) - 1.0).abs();
        once.append(&mut again);
        let (once, often) = (median(once), median(often));
        let cost = (often - once) / f64::from(MORE);
        let counters = renderer.read_counters().unwrap();
        println!(
            "n = {n}, {pixel_error:?} px, budget {budget:?}: {} triangles at {:.2} px, {} patches; frame {once:.2} ms, \
             choice {cost:.3} ms = {:.1} % (to reach: 5 %); A against A {:.1} %",
            counters.index_count / 3,
            counters.threshold_px,
            counters.patches_visible,
            100.0 * cost / once,
            100.0 * noise
        );
    }
}
