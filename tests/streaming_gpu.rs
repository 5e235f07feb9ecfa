//! Streamed terrain on the GPU: whole at every moment, and in the end the same mesh as from memory.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use std::time::Duration;

use common::stores::{Double, in_memory, open};
use glam::DVec3;
use tessclip::gpu::{Gpu, GpuMesh, Offscreen};
use tessclip::heights::HeightGrid;
use tessclip::measure::invariants::{draw, gpu_faults};
use tessclip::measure::{Mesh, enclosed_pixels, sees_below};
use tessclip::pyramid::store::{BuildOptions, Store};
use tessclip::stream::{StreamOptions, TileSource};
use tessclip::{Camera, Factors, Prefilter, Renderer, Scene, Terrain};

const LONG: Duration = Duration::from_secs(60);

fn grid() -> HeightGrid {
    common::terrain("procedural:mountains?width=2049&height=1700")
}

fn streamed(store: Store, options: StreamOptions) -> Terrain {
    Terrain::streamed(TileSource::new(std::sync::Arc::new(store), options).unwrap())
}

fn scene() -> Scene {
    // The rule that drops fine levels goes by the highest ground around where samples are streamed.
    Scene { n: 63, cull: false, drop_fine_levels: false, fog: false, ..Scene::default() }
}

fn renderer(gpu: &Gpu, terrain: &Terrain, scene: &Scene) -> Renderer {
    Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, scene).unwrap()
}

fn camera(grid: &HeightGrid, u: f64, v: f64) -> Camera {
    let at = [u * (grid.width - 1) as f64, v * (grid.height - 1) as f64];
    let ix = (at[1] as usize) * grid.width + at[0] as usize;
    let ground = f64::from(grid.heights_m[ix]);
    let eye_m = DVec3::new(at[0] * grid.spacing_m[0], at[1] * grid.spacing_m[1], ground + 150.0);
    Camera { eye_m, yaw_deg: 40.0, pitch_deg: -12.0, fov_deg: 60.0, ..Camera::default() }
}

fn same(a: &GpuMesh, b: &GpuMesh) -> bool {
    a.anchor_m == b.anchor_m
        && a.vertices == b.vertices
        && a.triangles == b.triangles
        && a.patches == b.patches
}

/// Draws until all is there.
fn complete(gpu: &Gpu, renderer: &mut Renderer, target: &Offscreen, camera: &Camera) {
    assert!(renderer.wait_complete(camera, LONG).unwrap());
    for _ in 0..400 {
        draw(gpu, renderer, target, camera).unwrap();
        if renderer.is_complete() {
            return;
        }
    }
    panic!("the view does not come to rest");
}

/// Normals of every seventh patch against the CPU twin's, morphed or not.
fn normals_are_the_twins(mesh: &GpuMesh, renderer: &Renderer) {
    let (placement, source) = (renderer.placement().unwrap(), renderer.source().as_ref());
    let mut compared = 0;
    for record in mesh.patches.iter().step_by(7) {
        let patch = record.patch();
        let twin = tessclip::reference::expand(placement, source, &patch);
        for (k, base) in twin.base.iter().enumerate() {
            let got =
                tessclip::reference::unpack_normal(mesh.vertices[record.first_vertex as usize + k].packed);
            let wanted = placement.normal(source, patch.level, *base);
            let dot: f32 = got.iter().zip(wanted).map(|(a, b)| a * b).sum();
            let angle = f64::from(dot.clamp(-1.0, 1.0)).acos().to_degrees();
            assert!(angle < 0.1, "level {} at {base:?}: {got:?} {wanted:?}", patch.level);
            compared += 1;
        }
    }
    assert!(compared > 500);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "needs a GPU")]
fn once_all_is_there_the_mesh_is_that_of_the_pyramid_in_memory() {
    let gpu = common::gpu();
    let grid = grid();
    let target = Offscreen::new(&gpu.device, [160, 90]).unwrap();
    let memory = Terrain::new(&grid, Prefilter::Subsample);
    let stored = streamed(open(in_memory(&grid, &BuildOptions::default())), StreamOptions::default());
    for morph in [false, true] {
        let scene = Scene { morph, ..scene() };
        let mut from_memory = renderer(&gpu, &memory, &scene);
        let mut from_store = renderer(&gpu, &stored, &scene);
        // Whatever way it came there: by a jump, over other places, back again.
        for (u, v) in [(0.5, 0.5), (0.1, 0.9), (0.13, 0.88), (1.0, 0.0), (0.5, 0.5)] {
            let camera = camera(&grid, u, v);
            draw(&gpu, &mut from_memory, &target, &camera).unwrap();
            complete(&gpu, &mut from_store, &target, &camera);
            let (a, b) = (from_memory.read_mesh().unwrap(), from_store.read_mesh().unwrap());
            assert!(a.triangles.len() > 4_000);
            assert_eq!(a.patches.len(), b.patches.len(), "at {u} {v}, morph {morph}");
            let differ = a.vertices.iter().zip(&b.vertices).filter(|(p, q)| p != q).count();
            assert!(same(&a, &b), "at {u} {v}, morph {morph}: {differ} of {} vertices", a.vertices.len());
            normals_are_the_twins(&b, &from_store);
            from_store.forget_stream();
        }
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "needs a GPU")]
fn once_all_is_there_factors_by_error_are_those_of_the_pyramid_in_memory() {
    let gpu = common::gpu();
    let grid = grid();
    let target = Offscreen::new(&gpu.device, [160, 90]).unwrap();
    let memory = Terrain::new(&grid, Prefilter::Subsample);
    let stored = streamed(open(in_memory(&grid, &BuildOptions::default())), StreamOptions::default());
    let factors = Factors::ByError { pixel_error: Some(1.0), budget: None };
    let scene = Scene { n: 127, factors, ..scene() };
    let mut from_memory = renderer(&gpu, &memory, &scene);
    let mut from_store = renderer(&gpu, &stored, &scene);
    let mut before: Option<GpuMesh> = None;
    // Windows move away and back: blocks that come again are graded again.
    for (u, v) in [(0.5, 0.5), (0.1, 0.9), (0.13, 0.88), (1.0, 0.0), (0.5, 0.5)] {
        let camera = camera(&grid, u, v);
        draw(&gpu, &mut from_memory, &target, &camera).unwrap();
        complete(&gpu, &mut from_store, &target, &camera);
        let (a, b) = (from_memory.read_mesh().unwrap(), from_store.read_mesh().unwrap());
        assert!(a.nodes.len() > 5 && a.triangles.len() > 200, "{} {}", a.nodes.len(), a.triangles.len());
        let differ = a.nodes.iter().zip(&b.nodes).filter(|(p, q)| p != q).count();
        assert!(a.nodes == b.nodes, "at {u} {v}: {differ} of {} and {}", a.nodes.len(), b.nodes.len());
        assert!(a.anchor_m == b.anchor_m && a.triangles == b.triangles, "at {u} {v}");
        assert!(a.vertices == b.vertices, "at {u} {v}");
        // Another view's nodes are others.
        assert!(before.is_none_or(|old| old.nodes != b.nodes), "at {u} {v}");
        before = Some(b);
        from_store.forget_stream();
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "needs a GPU")]
fn while_tiles_arrive_every_mesh_conforms_and_no_background_shows() {
    let gpu = common::gpu();
    let grid = grid();
    let target = Offscreen::new(&gpu.device, [320, 180]).unwrap();
    let files = in_memory(&grid, &BuildOptions::default());
    for morph in [false, true] {
        for cache_tiles in [1, 6, 200] {
            let double = Double { jitter: Duration::from_millis(12), ..Double::of(files.clone()) };
            let (_, store) = double.open();
            let options =
                StreamOptions { cache_bytes: cache_tiles * 262_144, loaders: 3, ..StreamOptions::default() };
            let terrain = streamed(store, options);
            let scene = Scene { morph, background: [1.0, 0.0, 1.0], ..scene() };
            let mut renderer = renderer(&gpu, &terrain, &scene);
            let (mut late, mut whole) = (0, 0);
            for k in 0..60 {
                // A fast flight with a jump now and then, towards the border and over it.
                let t = f64::from(k) / 60.0;
                let jump = f64::from(k / 20) * 0.31;
                let camera = camera(&grid, (0.1 + t * 0.8 + jump).fract(), (0.2 + 0.7 * t + jump).fract());
                draw(&gpu, &mut renderer, &target, &camera).unwrap();
                let counted = if renderer.is_complete() { &mut whole } else { &mut late };
                *counted += 1;
                let mesh = renderer.read_mesh().unwrap();
                let faults = gpu_faults(&mesh, renderer.placement().unwrap(), &terrain);
                assert!(
                    faults.open_edges == 0
                        && faults.misoriented == 0
                        && faults.not_finite == 0
                        && faults.area_error < 1e-6,
                    "frame {k}, cache of {cache_tiles}: {faults:?}"
                );
                let picture = target.read_rgba(&gpu.device, &gpu.queue).unwrap();
                let suspects = enclosed_pixels(&picture, target.size, [255, 0, 255]);
                let mesh = Mesh::from_gpu(&mesh);
                for p in suspects {
                    assert!(!sees_below(&mesh, camera.eye_m, camera.ray(p, target.size)), "frame {k}: crack");
                }
                let c = renderer.stream_counters().unwrap();
                assert!(c.resident_bytes_max <= c.limit_bytes, "{c:?}");
            }
            eprintln!("morph {morph}, cache of {cache_tiles} tiles: {late} frames late, {whole} whole");
            assert!(late > 0, "nothing was ever missing: the test shows nothing");
        }
    }
}

/// Greatest turn of a normal between two meshes at vertices both have, degrees.
fn turn_deg(a: &GpuMesh, b: &GpuMesh) -> f64 {
    let key = |v: &tessclip::reference::Vertex| [v.position[0].to_bits(), v.position[1].to_bits()];
    let normal =
        |v: &tessclip::reference::Vertex| tessclip::reference::unpack_normal(v.packed).map(f64::from);
    let old: std::collections::HashMap<_, _> = b.vertices.iter().map(|v| (key(v), normal(v))).collect();
    let turns = a.vertices.iter().filter_map(|v| {
        let (p, q) = (normal(v), old.get(&key(v))?);
        let dot: f64 = p.iter().zip(q).map(|(x, y)| x * y).sum();
        Some(dot.clamp(-1.0, 1.0).acos().to_degrees())
    });
    turns.fold(0.0, f64::max)
}

/// Greatest vertical distance between two meshes over the ground both cover, sampled at the vertices of one.
fn step_m(a: &GpuMesh, b: &GpuMesh) -> f64 {
    let (a, b) = (Mesh::from_gpu(a), Mesh::from_gpu(b));
    let cell = 30.0 * 16.0;
    let mut buckets: std::collections::HashMap<[i64; 2], Vec<[usize; 3]>> = std::collections::HashMap::new();
    for t in &b.triangles {
        let p = t.map(|ix| b.vertices[ix as usize]);
        let low = [0, 1].map(|k| (p.iter().map(|v| v[k]).fold(f64::MAX, f64::min) / cell).floor() as i64);
        let high = [0, 1].map(|k| (p.iter().map(|v| v[k]).fold(f64::MIN, f64::max) / cell).floor() as i64);
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                buckets.entry([x, y]).or_default().push(t.map(|ix| ix as usize));
            }
        }
    }
    let mut worst = 0.0_f64;
    for p in &a.vertices {
        let key = [0, 1].map(|k| (p[k] / cell).floor() as i64);
        for t in buckets.get(&key).into_iter().flatten() {
            let [u, v, w] = t.map(|ix| b.vertices[ix]);
            let area = (v[0] - u[0]) * (w[1] - u[1]) - (v[1] - u[1]) * (w[0] - u[0]);
            let s = ((p[0] - u[0]) * (w[1] - u[1]) - (p[1] - u[1]) * (w[0] - u[0])) / area;
            let r = ((v[0] - u[0]) * (p[1] - u[1]) - (v[1] - u[1]) * (p[0] - u[0])) / area;
            if s >= 0.0 && r >= 0.0 && s + r <= 1.0 {
                worst = worst.max((u[2] + s * (v[2] - u[2]) + r * (w[2] - u[2]) - p[2]).abs());
                break;
            }
        }
    }
    worst
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "needs a GPU")]
fn levels_return_without_a_pop_where_geomorph_is_on() {
    let gpu = common::gpu();
    let grid = grid();
    let target = Offscreen::new(&gpu.device, [64, 36]).unwrap();
    let files = in_memory(&grid, &BuildOptions::default());
    let camera = camera(&grid, 0.5, 0.5);
    let (mut worst, mut turned) = ([0.0_f64; 2], [0.0_f64; 2]);
    let mut returned = 0;
    for morph in [false, true] {
        let double = Double { delay: Duration::from_millis(25), ..Double::of(files.clone()) };
        let (_, store) = double.open();
        let terrain = streamed(store, StreamOptions { loaders: 1, ..StreamOptions::default() });
        let mut renderer = renderer(&gpu, &terrain, &Scene { morph, ..scene() });
        let mut before: Option<(u32, GpuMesh)> = None;
        for _ in 0..2_000 {
            draw(&gpu, &mut renderer, &target, &camera).unwrap();
            let drawn = renderer.shape().levels() - renderer.windows().unwrap().charts[0].finest;
            let mesh = renderer.read_mesh().unwrap();
            if let Some((levels, old)) = &before {
                // The camera stands still: whatever changes in one frame is seen to pop.
                worst[usize::from(morph)] = worst[usize::from(morph)].max(step_m(&mesh, old));
                turned[usize::from(morph)] = turned[usize::from(morph)].max(turn_deg(&mesh, old));
                returned += u32::from(drawn > *levels);
            }
            if renderer.is_complete() && before.is_some() {
                break;
            }
            before = Some((drawn, mesh));
        }
        assert!(renderer.is_complete());
    }
    eprintln!("greatest step in one frame: {:.1} m without geomorph, {:.1} m with it", worst[0], worst[1]);
    eprintln!("greatest turn of a normal: {:.1} degrees without, {:.1} with it", turned[0], turned[1]);
    // Slopes are blended evenly; the angles between them are not quite even.
    assert!(turned[1] <= turned[0] / 6.0 && turned[0] > 10.0, "{turned:?}");
    assert!(returned >= 4, "no level returned");
    // A sixteenth of the way a frame.
    assert!(worst[1] <= worst[0] / 12.0 && worst[0] > 50.0, "{worst:?}");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "needs a GPU")]
fn a_device_lost_in_flight_is_replaced_and_the_picture_is_the_same() {
    let gpu = common::gpu();
    let grid = grid();
    let terrain = streamed(open(in_memory(&grid, &BuildOptions::default())), StreamOptions::default());
    let camera = camera(&grid, 0.4, 0.6);
    let picture = |gpu: &Gpu| {
        let target = Offscreen::new(&gpu.device, [160, 90]).unwrap();
        let mut renderer = renderer(gpu, &terrain, &scene());
        complete(gpu, &mut renderer, &target, &camera);
        (target.read_rgba(&gpu.device, &gpu.queue).unwrap(), renderer)
    };
    let (before, mut lost) = picture(&gpu);
    gpu.device.destroy();
    // The host notices: reading back fails with words, nothing panics.
    let target = Offscreen::new(&gpu.device, [160, 90]);
    if let Ok(target) = target {
        let _ = draw(&gpu, &mut lost, &target, &camera);
    }
    assert!(lost.read_counters().is_err());
    assert!(gpu.is_lost());
    drop(lost);
    let again = common::gpu();
    assert!(picture(&again).0 == before, "the same terrain on a new device");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "needs a GPU")]
fn pictures_of_one_pixel_and_views_too_large_for_the_cache_are_told() {
    let gpu = common::gpu();
    let grid = grid();
    let store = open(in_memory(&grid, &BuildOptions::default()));
    let terrain = streamed(store, StreamOptions { cache_bytes: 262_144, ..StreamOptions::default() });
    let mut renderer = renderer(&gpu, &terrain, &scene());
    let target = Offscreen::new(&gpu.device, [1, 1]).unwrap();
    let camera = camera(&grid, 0.5, 0.5);
    draw(&gpu, &mut renderer, &target, &camera).unwrap();
    assert_eq!(target.read_rgba(&gpu.device, &gpu.queue).unwrap().len(), 4);
    let error = renderer.wait_complete(&camera, LONG).unwrap_err().to_string();
    assert!(error.contains("--cache-mb"), "{error}");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "needs a GPU")]
fn the_upload_budget_of_a_frame_is_kept() {
    let gpu = common::gpu();
    let grid = grid();
    let store = open(in_memory(&grid, &BuildOptions::default()));
    let budget = 3 * 63 * 63 * 4;
    let terrain =
        streamed(store, StreamOptions { upload_bytes_per_frame: budget, ..StreamOptions::default() });
    let mut renderer = renderer(&gpu, &terrain, &scene());
    let target = Offscreen::new(&gpu.device, [64, 36]).unwrap();
    let camera = camera(&grid, 0.5, 0.5);
    assert!(renderer.wait_complete(&camera, LONG).unwrap());
    let mut frames = 0;
    while !renderer.is_complete() {
        let upload = renderer.prepare(&camera, target.size).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        renderer.record_mesh(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        assert!(upload.height_bytes <= budget, "{} bytes", upload.height_bytes);
        frames += 1;
        assert!(frames < 50);
    }
    assert!(frames >= 2, "all went in one frame");
}

/// Resident memory of this process, bytes.
#[cfg(target_os = "linux")]
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with("VmRSS:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
}

#[cfg(target_os = "linux")]
#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "needs a GPU")]
fn twenty_thousand_frames_leave_memory_flat() {
    let gpu = common::gpu();
    let grid = grid();
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path().join("t.zarr");
    common::stores::built(&grid, &at, &BuildOptions::default());
    let options = StreamOptions { cache_bytes: 20 * 262_144, loaders: 2, ..StreamOptions::default() };
    let terrain = Terrain::streamed(TileSource::open(&at, options).unwrap());
    let scene = Scene { n: 31, cull: true, background: [1.0, 0.0, 1.0], ..scene() };
    let mut renderer = renderer(&gpu, &terrain, &scene);
    let target = Offscreen::new(&gpu.device, [64, 36]).unwrap();
    let (gpu_bytes, mut settled) = (renderer.gpu_bytes(), 0);
    let (mut x, mut y, mut heading, mut looked) = (0.5_f64, 0.5_f64, 0.0_f64, 0);
    let mut state = 7_u64;
    let mut chance = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let frames = 20_000;
    for k in 0..frames {
        heading += (chance() - 0.5) * 0.4;
        (x, y) = (x + heading.sin() * 0.002, y + heading.cos() * 0.002);
        if k % 250 == 249 || !(0.0..=1.0).contains(&x) || !(0.0..=1.0).contains(&y) {
            (x, y) = (chance(), chance());
        }
        let camera = camera(&grid, x, y);
        draw(&gpu, &mut renderer, &target, &camera).unwrap();
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        if k % 500 == 499 {
            let picture = target.read_rgba(&gpu.device, &gpu.queue).unwrap();
            let suspects = enclosed_pixels(&picture, target.size, [255, 0, 255]);
            let mesh = Mesh::from_gpu(&renderer.read_mesh().unwrap());
            let below = |p: &&[u32; 2]| sees_below(&mesh, camera.eye_m, camera.ray(**p, target.size));
            assert_eq!(suspects.iter().filter(below).count(), 0, "cracks in frame {k}");
            looked += 1;
        }
        if k == frames / 4 {
            settled = resident();
        }
    }
    let c = renderer.stream_counters().unwrap();
    let grown = resident().saturating_sub(settled);
    eprintln!(
        "{looked} pictures without a crack, {:.1} MB grown over 15,000 frames, {c:?}",
        grown as f64 / 1e6
    );
    assert_eq!(renderer.gpu_bytes(), gpu_bytes);
    assert!(c.resident_bytes_max <= c.limit_bytes && c.evicted > 1_000);
    assert!(grown < 8_000_000, "{grown} bytes");
}
