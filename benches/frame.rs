//! Frame cost by part: culling and expansion, the whole frame, and the same triangles from static buffers.
//!
//! The paired figures (A B B A) are printed first: they are what ARCHITECTURE.md quotes. Times never gate
//! a test.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a bench, not a library"
)]

use std::time::Instant;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::DVec3;
use tessclip::gpu::{Gpu, Offscreen};
use tessclip::heights::{ReadOptions, open_terrain};
use tessclip::quads::{Patch, patches};
use tessclip::reference::{expand, patch_bounds, visible};
use tessclip::{Camera, Prefilter, Renderer, Scene, Target, Terrain};
use wgpu::util::DeviceExt as _;

const SIZE: [u32; 2] = [1280, 720];

struct Rig {
    gpu: Gpu,
    renderer: Renderer,
    target: Offscreen,
    camera: Camera,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
}

/// Near the ground in the middle of procedural mountains, 60 degrees, level view.
fn rig(gpu: &Gpu, terrain: &Terrain, n: u32, levels: u32) -> Rig {
    let scene = Scene { n, levels: Some(levels), ..Scene::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, &scene).unwrap();
    let [low, high] = terrain.extent_m();
    let (x, y) = (f64::midpoint(low[0], high[0]), f64::midpoint(low[1], high[1]));
    let ground = terrain.ground_height_m(x, y).map_or(0.0, f64::from);
    let camera = Camera {
        eye_m: DVec3::new(x, y, ground + 200.0),
        yaw_deg: 30.0,
        pitch_deg: -8.0,
        fov_deg: 60.0,
        ..Camera::default()
    };
    let target = Offscreen::new(&gpu.device, SIZE).unwrap();
    renderer.prepare(&camera, SIZE).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    renderer
        .record(&mut encoder, Target { color: &target.color, depth: &target.depth, clear: true, area: None });
    gpu.queue.submit([encoder.finish()]);
    let mesh = renderer.read_mesh().unwrap();
    let buffer = |label, contents: &[u8], usage| {
        gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents,
            usage,
        })
    };
    Rig {
        gpu: gpu.clone(),
        renderer,
        target,
        camera,
        vertices: buffer("static vertices", bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX),
        indices: buffer("static indices", bytemuck::cast_slice(&mesh.triangles), wgpu::BufferUsages::INDEX),
        index_count: mesh.counters.index_count,
    }
}

impl Rig {
    fn run(&mut self, record: impl FnOnce(&mut Self, &mut wgpu::CommandEncoder)) -> f64 {
        let begin = Instant::now();
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        record(self, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        begin.elapsed().as_secs_f64() * 1e3
    }

    fn whole(&mut self) -> f64 {
        self.run(|s, encoder| {
            s.renderer.prepare(&s.camera, SIZE).unwrap();
            let target = Target { color: &s.target.color, depth: &s.target.depth, clear: true, area: None };
            s.renderer.record(encoder, target);
        })
    }

    fn mesh_only(&mut self) -> f64 {
        self.run(|s, encoder| {
            s.renderer.prepare(&s.camera, SIZE).unwrap();
            s.renderer.record_mesh(encoder);
        })
    }

    /// The whole frame but culling and expansion: the mesh of the frame before is drawn again.
    fn draw_only(&mut self) -> f64 {
        self.run(|s, encoder| {
            s.renderer.prepare(&s.camera, SIZE).unwrap();
            let target = Target { color: &s.target.color, depth: &s.target.depth, clear: true, area: None };
            s.renderer.record_draw_again(encoder, target);
        })
    }

    fn ready_made(&mut self) -> f64 {
        self.run(|s, encoder| {
            let target = Target { color: &s.target.color, depth: &s.target.depth, clear: true, area: None };
            s.renderer.record_static(encoder, target, &s.vertices, &s.indices, s.index_count);
        })
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Triangles of the patches of which at least one triangle reaches into the frustum.
fn triangles_really_seen(rig: &Rig) -> u32 {
    let placement = rig.renderer.placement().unwrap();
    let frustum = rig.renderer.frustum().unwrap();
    let source = rig.renderer.source().as_ref();
    let reaches = |patch: &Patch| {
        if !patch_bounds(placement, source, patch).is_some_and(|b| visible(frustum, &b)) {
            return false;
        }
        let mesh = expand(placement, source, patch);
        mesh.triangles.iter().any(|t| {
            let corners: Vec<[f32; 3]> = t.iter().map(|ix| mesh.vertices[*ix as usize].position).collect();
            clipped_is_not_empty(&corners, &frustum.planes)
        })
    };
    patches(&placement.windows).iter().filter(|(_, p)| reaches(p)).map(|(_, p)| p.triangle_count()).sum()
}

/// Sutherland-Hodgman against all planes.
fn clipped_is_not_empty(corners: &[[f32; 3]], planes: &[[f32; 4]]) -> bool {
    let mut polygon: Vec<DVec3> =
        corners.iter().map(|c| DVec3::new(c[0].into(), c[1].into(), c[2].into())).collect();
    for p in planes {
        let distance = |v: DVec3| DVec3::new(p[0].into(), p[1].into(), p[2].into()).dot(v) + f64::from(p[3]);
        let mut out = Vec::new();
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            let (da, db) = (distance(a), distance(b));
            if da >= 0.0 {
                out.push(a);
            }
            if (da >= 0.0) != (db >= 0.0) {
                out.push(a + (b - a) * (da / (da - db)));
            }
        }
        if out.is_empty() {
            return false;
        }
        polygon = out;
    }
    true
}

/// The targets of the planar pipeline, in one run.
fn paired(gpu: &Gpu, terrain: &Terrain) {
    let mut rig = rig(gpu, terrain, 255, 7);
    let (mut whole, mut again) = (Vec::new(), Vec::new());
    let (mut draw, mut ready, mut alone) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..20 {
        whole.push(rig.whole());
        draw.push(rig.draw_only());
        ready.push(rig.ready_made());
        alone.push(rig.mesh_only());
        ready.push(rig.ready_made());
        draw.push(rig.draw_only());
        again.push(rig.whole());
    }
    let warm = median((0..20).map(|_| rig.mesh_only()).collect());
    let noise = (median(again.clone()) / median(whole.clone()) - 1.0).abs();
    whole.append(&mut again);
    let (whole, draw, ready, alone) = (median(whole), median(draw), median(ready), median(alone));
    let drawn = rig.index_count / 3;
    let seen = triangles_really_seen(&rig);
    println!("{}; n = 255, 7 levels, {} x {}, 60 degrees", gpu.describe(), SIZE[0], SIZE[1]);
    println!(
        "frame {whole:.2} ms, without culling and expansion {draw:.2} ms, ready-made mesh {ready:.2} ms"
    );
    println!(
        "(1) culling and expansion in the frame: {:.1} % (to reach: 10 %)",
        100.0 * (whole - draw) / whole
    );
    println!("    submitted alone: {warm:.2} ms in a row, {alone:.2} ms after a draw has emptied the caches");
    println!(
        "(2) triangles: {drawn} drawn, {seen} in patches really seen: {:.3} (to reach: 1.35)",
        f64::from(drawn) / f64::from(seen)
    );
    println!("(3) frame / ready-made: {:.3} (to reach: 1.10)", whole / ready);
    println!("A against A: {:.1} %", 100.0 * noise);
    let all: u32 =
        patches(&rig.renderer.placement().unwrap().windows).iter().map(|(_, p)| p.triangle_count()).sum();
    println!("without culling: {all} triangles");
}

fn benches(c: &mut Criterion) {
    let gpu = Gpu::new().expect("an adapter");
    let grid = open_terrain("procedural:mountains?size=4097", &ReadOptions::default()).unwrap();
    let terrain = Terrain::new(&grid, Prefilter::default());
    paired(&gpu, &terrain);
    let mut group = c.benchmark_group("frame");
    group.sample_size(10);
    for n in [63, 127, 255, 511] {
        let mut rig = rig(&gpu, &terrain, n, 7);
        group.bench_function(BenchmarkId::new("cull and expand", n), |b| b.iter(|| rig.mesh_only()));
        group.bench_function(BenchmarkId::new("whole", n), |b| b.iter(|| rig.whole()));
        group.bench_function(BenchmarkId::new("ready-made mesh", n), |b| b.iter(|| rig.ready_made()));
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
