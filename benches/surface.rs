//! What 3D positions cost: the same triangles on a plane from heights and through the curved path, frames in
//! turn (A B B A); and what a shift of a level uploads on curved surfaces. Times never gate a test.
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
use tessclip::scene::Curved;
use tessclip::{Camera, Prefilter, Renderer, Scene, Target, Terrain};

const SIZE: [u32; 2] = [1280, 720];

struct Rig<'a> {
    gpu: &'a Gpu,
    renderer: Renderer,
    target: Offscreen,
    camera: Camera,
}

impl Rig<'_> {
    fn frame(&mut self) -> f64 {
        let begin = Instant::now();
        self.renderer.prepare(&self.camera, SIZE).unwrap();
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let target = Target { color: &self.target.color, depth: &self.target.depth, clear: true, area: None };
        self.renderer.record(&mut encoder, target);
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        begin.elapsed().as_secs_f64() * 1e3
    }

    /// Culling and expansion alone.
    fn mesh(&mut self) -> f64 {
        let begin = Instant::now();
        self.renderer.prepare(&self.camera, SIZE).unwrap();
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.renderer.record_mesh(&mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        begin.elapsed().as_secs_f64() * 1e3
    }

    fn triangles(&self) -> u32 {
        self.renderer.read_counters().unwrap().index_count / 3
    }
}

fn rig<'a>(gpu: &'a Gpu, terrain: &Terrain, camera: Camera, scene: &Scene) -> Rig<'a> {
    let renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, scene).unwrap();
    let mut rig = Rig { gpu, renderer, target: Offscreen::new(&gpu.device, SIZE).unwrap(), camera };
    rig.frame();
    rig
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Medians of both, and of A against A.
fn paired(a: &mut Rig, b: &mut Rig, rounds: usize) -> (f64, f64, f64) {
    let (mut first, mut second, mut again) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..rounds {
        first.push(a.frame());
        second.push(b.frame());
        second.push(b.frame());
        again.push(a.frame());
    }
    let noise = (median(first.clone()) / median(again.clone()) - 1.0).abs();
    first.append(&mut again);
    (median(first), median(second), noise)
}

fn cost(gpu: &Gpu) {
    let grid = open_terrain("procedural:mountains?size=4097", &ReadOptions::default()).unwrap();
    let plane = Terrain::new(&grid, Prefilter::Subsample);
    let curved = Terrain::from_curved(Curved::flat(&grid, DVec3::ZERO), grid.spacing_m);
    let [low, high] = plane.extent_m();
    let (x, y) = (f64::midpoint(low[0], high[0]), f64::midpoint(low[1], high[1]));
    let ground = plane.ground_height_m(x, y).map_or(0.0, f64::from);
    let camera = Camera {
        eye_m: DVec3::new(x, y, ground + 200.0),
        yaw_deg: 30.0,
        pitch_deg: -8.0,
        ..Camera::default()
    };
    // Without fog: the curved path has another density, and the pictures should be the same.
    let scene = Scene { levels: Some(7), fog: false, ..Scene::default() };
    let all = Scene { cull: false, ..scene.clone() };
    let (mut a, mut b) = (rig(gpu, &plane, camera, &all), rig(gpu, &curved, camera, &all));
    let (heights, positions, noise) = paired(&mut a, &mut b, 8);
    let (mesh_a, mesh_b) =
        (median((0..9).map(|_| a.mesh()).collect()), median((0..9).map(|_| b.mesh()).collect()));
    println!("nothing culled, culling and expansion alone: {mesh_a:.2} and {mesh_b:.2} ms");
    println!(
        "nothing culled, {} and {} triangles: {heights:.2} and {positions:.2} ms: {:.3} (to reach: 1.25); A against A {:.1} %",
        a.triangles(),
        b.triangles(),
        positions / heights,
        100.0 * noise
    );
    let (mut a, mut b) = (rig(gpu, &plane, camera, &scene), rig(gpu, &curved, camera, &scene));
    let (heights, positions, noise) = paired(&mut a, &mut b, 15);
    println!("{}; n = 255, 7 levels, {} x {}", gpu.describe(), SIZE[0], SIZE[1]);
    println!("triangles: {} from heights, {} from positions", a.triangles(), b.triangles());
    println!(
        "frame: {heights:.2} ms from heights on a plane, {positions:.2} ms through 3D positions: {:.3} (to reach: 1.25); A against A {:.1} %",
        positions / heights,
        100.0 * noise
    );
    println!(
        "GPU memory: {:.1} MB and {:.1} MB",
        a.renderer.gpu_bytes() as f64 / 1e6,
        b.renderer.gpu_bytes() as f64 / 1e6
    );
}

/// Bytes a fresh sample costs while a camera crosses the terrain, all control data and records included.
fn upload(gpu: &Gpu, name: &str, terrain: &Terrain, poses: impl Iterator<Item = [f64; 5]>) {
    let scene = Scene { drop_fine_levels: false, ..Scene::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, &scene).unwrap();
    let target = Offscreen::new(&gpu.device, [64, 64]).unwrap();
    let (mut samples, mut heights, mut records, mut control) = (0, 0, 0, 0);
    for (k, pose) in poses.enumerate() {
        let sent = renderer.prepare(&terrain.camera(pose, 60.0), SIZE).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        renderer.record(
            &mut encoder,
            Target { color: &target.color, depth: &target.depth, clear: true, area: None },
        );
        gpu.queue.submit([encoder.finish()]);
        if k > 0 {
            samples += sent.height_bytes / sent.sample_bytes.max(1);
            heights += sent.height_bytes;
            records += sent.surface_bytes;
            control += sent.control_bytes;
        }
    }
    let each = |bytes: u64| bytes as f64 / samples as f64;
    println!(
        "{name}: {samples} samples, {:.2} bytes each ({:.2} heights, {:.2} records, {:.2} control): {:.3} of 16 (to reach: 0.25)",
        each(heights + records + control),
        each(heights),
        each(records),
        each(control),
        each(heights + records + control) / 16.0
    );
}

fn main() {
    let gpu = Gpu::new().expect("an adapter");
    cost(&gpu);
    for size in [1025, 1537] {
        let recipe = format!("procedural:planet?size={size}");
        let planet = open_terrain(&recipe, &ReadOptions::default()).unwrap();
        let globe = Terrain::globe(vec![planet], tessclip::surface::Ellipsoid::WGS84).unwrap();
        let name = format!("planet of cells of {:.0} km", globe.spacing_m[0] / 1e3);
        upload(&gpu, &name, &globe, (0..200).map(|k| [10.0 + 0.2 * f64::from(k), 20.0, 5e4, 90.0, -20.0]));
    }
    let grid = open_terrain("procedural:mountains?size=2049", &ReadOptions::default()).unwrap();
    let mut whole = grid.clone();
    for h in &mut whole.heights_m {
        *h = h.round();
    }
    for (name, grid) in [("region on an ellipsoid, whole metres", &whole), ("the same, fractions", &grid)] {
        let terrain = Terrain::on(grid, "wgs84".parse().unwrap(), Prefilter::Subsample).unwrap();
        upload(
            &gpu,
            name,
            &terrain,
            (0..400).map(|k| [15e3 + 70.0 * f64::from(k), 20e3 + 40.0 * f64::from(k), 3e3, 0.0, -20.0]),
        );
    }
}
