//! What can be looked at besides the terrain itself: errors, refills, bounds, frozen culling, parts of a target;
//! and that a renderer at work takes changes without sending anything again.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use glam::DVec3;
use tessclip::gpu::{Gpu, GpuMesh, Offscreen};
use tessclip::measure::invariants::draw;
use tessclip::surface::Ellipsoid;
use tessclip::{Camera, ColorMode, Factors, Prefilter, Renderer, Scene, Target, Terrain};

const SIZE: [u32; 2] = [320, 180];

fn mountains(size: u32) -> Terrain {
    Terrain::new(&common::terrain(&format!("procedural:mountains?size={size}")), Prefilter::Subsample)
}

/// A camera a share of the way across, so high above the ground, to the north and down.
fn over(terrain: &Terrain, share: [f64; 2], above_m: f64) -> Camera {
    let [low, high] = terrain.extent_m();
    let [x, y] = [0, 1].map(|a| low[a] + (high[a] - low[a]) * share[a]);
    let ground = f64::from(terrain.ground_height_m(x, y).unwrap_or(0.0));
    Camera { eye_m: DVec3::new(x, y, ground + above_m), pitch_deg: -20.0, ..Camera::default() }
}

fn renderer(gpu: &Gpu, terrain: &Terrain, scene: &Scene) -> (Renderer, Offscreen) {
    let target = Offscreen::new(&gpu.device, SIZE).expect("fits");
    let made = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, scene);
    (made.expect("a renderer"), target)
}

fn picture(gpu: &Gpu, renderer: &mut Renderer, target: &Offscreen, camera: &Camera) -> Vec<[u8; 4]> {
    draw(gpu, renderer, target, camera).expect("drawn");
    let bytes = target.read_rgba(&gpu.device, &gpu.queue).expect("read");
    bytes.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect()
}

fn marks(mesh: &GpuMesh) -> Vec<u32> {
    mesh.vertices.iter().map(|v| v.packed >> 24).collect()
}

/// Share of the vertices that are marked.
fn marked_share(mesh: &GpuMesh) -> f64 {
    let all = marks(mesh);
    all.iter().filter(|m| **m > 0).count() as f64 / all.len() as f64
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn refills_are_marked_vertex_by_vertex() {
    let gpu = common::gpu();
    let terrain = mountains(513);
    let scene = Scene { n: 63, color: ColorMode::Refill, cull: false, ..Scene::default() };
    let (mut renderer, target) = renderer(&gpu, &terrain, &scene);
    let a = over(&terrain, [0.4, 0.5], 300.0);
    draw(&gpu, &mut renderer, &target, &a).expect("drawn");
    assert!(
        marks(&renderer.read_mesh().expect("read")).iter().all(|m| *m == 255),
        "the first frame brings all"
    );
    draw(&gpu, &mut renderer, &target, &a).expect("drawn");
    assert!(marks(&renderer.read_mesh().expect("read")).iter().all(|m| *m == 0), "nothing moved");

    let before = renderer.windows().expect("placed").charts[0].clone();
    let b = Camera { eye_m: a.eye_m + DVec3::new(14.0, 22.0, 0.0) * terrain.spacing_m[0], ..a };
    draw(&gpu, &mut renderer, &target, &b).expect("drawn");
    let after = renderer.windows().expect("placed").charts[0].clone();
    let mesh = renderer.read_mesh().expect("read");
    let mut counts = [0, 0];
    let mut at = 0;
    for patch in mesh.drawn() {
        for base in patch.bases(after.lattice) {
            let owner = after.owner(patch.level, base);
            let node = after.lattice.node(owner, base);
            let held = before.window(owner);
            let new = (0..2).any(|a| node[a] < held.lo[a] || node[a] > held.hi[a]);
            assert_eq!(
                mesh.vertices[at].packed >> 24,
                if new { 255 } else { 0 },
                "level {owner} node {node:?}"
            );
            counts[usize::from(new)] += 1;
            at += 1;
        }
    }
    assert!(counts[1] > 200 && counts[0] > counts[1], "{counts:?}");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn refills_are_marked_on_a_globe_as_well() {
    let gpu = common::gpu();
    let grid = common::terrain("procedural:planet?size=513");
    let terrain = Terrain::globe(vec![grid], Ellipsoid::WGS84).expect("a globe");
    let scene = Scene { n: 63, color: ColorMode::Refill, ..Scene::default() };
    let (mut renderer, target) = renderer(&gpu, &terrain, &scene);
    let at = |lon: f64| terrain.camera([lon, 30.0, 900e3, 0.0, -60.0], 60.0);
    let shares = [10.0, 10.0, 12.0].map(|lon| {
        draw(&gpu, &mut renderer, &target, &at(lon)).expect("drawn");
        marked_share(&renderer.read_mesh().expect("read"))
    });
    assert_eq!(shares[..2], [1.0, 0.0]);
    assert!(shares[2] > 0.001 && shares[2] < 0.5, "{shares:?}");
}

/// Most pixels that a mark stands for.
fn pixels_of(mark: u32) -> f64 {
    f64::from(mark as f32 / 31.75 - 4.0).exp2()
}

/// Pixels between a drawn and a true point, both seen.
fn apart_px(terrain: &Terrain, camera: &Camera, pair: [DVec3; 2]) -> Option<f64> {
    let half = SIZE.map(|v| f64::from(v) * 0.5);
    let aspect = half[0] / half[1];
    let near = (0.05 * terrain.spacing_m[0]).clamp(1e-4, 0.05);
    let clip = camera.clip_from_anchor(pair[0], aspect, near);
    let [a, b] = pair.map(|p| clip * (p - pair[0]).extend(1.0));
    let ndc = [a, b].map(|p| [p.x / p.w, p.y / p.w]);
    let inside = a.w > near && b.w > near && ndc.iter().flatten().all(|v| v.abs() <= 1.0);
    inside.then(|| ((ndc[0][0] - ndc[1][0]) * half[0]).hypot((ndc[0][1] - ndc[1][1]) * half[1]))
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn marks_of_errors_bound_what_is_measured_and_not_by_far() {
    let gpu = common::gpu();
    let terrain = mountains(1025);
    let by_error = Factors::ByError { pixel_error: Some(1.0), budget: None };
    for factors in [Factors::Uniform, by_error] {
        let scene = Scene { n: 127, color: ColorMode::Error, factors, ..Scene::default() };
        let (mut renderer, target) = renderer(&gpu, &terrain, &scene);
        let camera = over(&terrain, [0.5, 0.2], 400.0);
        draw(&gpu, &mut renderer, &target, &camera).expect("drawn");
        let mesh = renderer.read_mesh().expect("read");
        let drawn = renderer.drawn().expect("read");
        let lattice = renderer.windows().expect("placed").charts[0].lattice;
        let mut at = 0;
        let (mut points, mut ratios) = (0, Vec::new());
        for patch in mesh.drawn() {
            let mark = mesh.vertices[at].packed >> 24;
            at += patch.vertex_count() as usize;
            assert!(mark < 255, "every deviation is known");
            let [lo, hi] = [patch.rect.lo, patch.rect.hi].map(|node| lattice.base(patch.level, node));
            let step = |a: usize| ((hi[a] - lo[a]) / 9).max(1) as usize;
            let mut worst = 0.0_f64;
            for y in (lo[1] + 1..hi[1]).step_by(step(1)) {
                for x in (lo[0] + 1..hi[0]).step_by(step(0)) {
                    let world = |v: i32, a: usize| terrain.origin_m[a] + f64::from(v) * terrain.spacing_m[a];
                    let p = DVec3::new(world(x, 0), world(y, 1), 0.0);
                    let (Some(seen), Some(truth)) = (drawn.at(p), terrain.surface_at(p)) else {
                        panic!("{p} lies on the data");
                    };
                    if let Some(px) = apart_px(&terrain, &camera, [truth.point_m, seen.point_m]) {
                        worst = worst.max(px);
                        points += 1;
                    }
                }
            }
            // Under the scale all is 0; over it all is the last mark, which is no bound.
            if mark < 254 {
                assert!(worst <= pixels_of(mark) * 1.001 + 1e-3, "{worst} px under mark {mark}: {patch:?}");
            }
            if worst > 0.2 {
                ratios.push(pixels_of(mark) / worst);
            }
        }
        assert!(points > 3_000, "{points}");
        ratios.sort_by(f64::total_cmp);
        let median = ratios[ratios.len() / 2];
        eprintln!("{factors:?}: {} patches with errors, bound / measured {median:.2}", ratios.len());
        assert!(ratios.len() > 20 && median < 6.0, "{median}");
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn errors_can_be_coloured_on_every_base() {
    let gpu = common::gpu();
    let grid = common::terrain("procedural:planet?size=2049");
    let globe = Terrain::globe(vec![grid], Ellipsoid::WGS84).expect("a globe");
    let mountains = common::terrain("procedural:mountains?size=513");
    let patch =
        Terrain::on(&mountains, "sphere:100000".parse().unwrap(), Prefilter::Subsample).expect("fits");
    let over_land = globe.camera([10.0, 30.0, 60e3, 0.0, -30.0], 60.0);
    let over_patch = patch.overview(60.0);
    for (terrain, n, camera) in [(globe, 511, over_land), (patch, 127, over_patch)] {
        let scene = Scene { n, color: ColorMode::Error, ..Scene::default() };
        let (mut renderer, target) = renderer(&gpu, &terrain, &scene);
        let seen = picture(&gpu, &mut renderer, &target, &camera);
        let marks = marks(&renderer.read_mesh().expect("read"));
        let kinds: std::collections::BTreeSet<u32> = marks.into_iter().collect();
        assert!(kinds.len() > 2 && !kinds.contains(&255), "{kinds:?}");
        assert!(seen.iter().collect::<std::collections::BTreeSet<_>>().len() > 15);
    }
    let small = Scene { n: 63, color: ColorMode::Error, ..Scene::default() };
    assert!(small.shape(&self::mountains(257)).is_err(), "whole blocks need larger windows");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn bounds_are_lines_over_the_same_picture() {
    let gpu = common::gpu();
    let grid = common::terrain("procedural:planet?size=513");
    let globe = Terrain::globe(vec![grid], Ellipsoid::WGS84).expect("a globe");
    // Okabe and Ito's colours as bytes, as shaders/shared/shading.wgsl has them.
    let palette = [
        [230, 159, 0],
        [86, 180, 233],
        [0, 158, 115],
        [240, 228, 66],
        [0, 114, 178],
        [213, 94, 0],
        [204, 121, 167],
    ];
    for (terrain, n) in [(mountains(513), 63), (globe, 63)] {
        let camera = match terrain.curved {
            Some(_) => terrain.overview(60.0),
            None => over(&terrain, [0.5, 0.2], 500.0),
        };
        let plain = Scene { n, ..Scene::default() };
        let boxed = Scene { bounds: true, ..plain.clone() };
        let (mut without, target) = renderer(&gpu, &terrain, &plain);
        let before = picture(&gpu, &mut without, &target, &camera);
        let depth = target.read_depth(&gpu.device, &gpu.queue).expect("read");
        let (mut with, target) = renderer(&gpu, &terrain, &boxed);
        let after = picture(&gpu, &mut with, &target, &camera);
        assert_eq!(depth, target.read_depth(&gpu.device, &gpu.queue).expect("read"), "lines hide nothing");
        let lines: Vec<_> = before.iter().zip(&after).filter(|(a, b)| a != b).map(|(_, b)| *b).collect();
        let known = |p: &[u8; 4]| {
            let near = |c: &[u8; 3]| (0..3).all(|a| p[a].abs_diff(c[a]) <= 2);
            palette.iter().any(near) || near(&[170, 170, 170])
        };
        assert!(lines.len() > 1_000, "{}", lines.len());
        assert!(lines.iter().all(known), "{:?}", lines.iter().find(|p| !known(p)));
        let triangles = |r: &Renderer| r.read_counters().expect("read").index_count;
        assert_eq!(triangles(&with), triangles(&without));
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn frozen_windows_and_culling_stay_while_the_camera_flies_on() {
    let gpu = common::gpu();
    let grid = common::terrain("procedural:planet?size=513");
    let globe = Terrain::globe(vec![grid], Ellipsoid::WGS84).expect("a globe");
    for terrain in [mountains(513), globe] {
        let (a, b) = match terrain.curved {
            Some(_) => {
                let at = |lon: f64, h: f64| terrain.camera([lon, 20.0, h, 20.0, -50.0], 60.0);
                (at(10.0, 900e3), at(14.0, 3_000e3))
            }
            None => (over(&terrain, [0.5, 0.3], 300.0), over(&terrain, [0.3, 0.1], 2_500.0)),
        };
        for cull in [true, false] {
            let scene = Scene { n: 63, cull, bounds: true, ..Scene::default() };
            let (mut renderer, target) = renderer(&gpu, &terrain, &scene);
            let own = picture(&gpu, &mut renderer, &target, &a);
            let mesh = renderer.read_mesh().expect("read");
            renderer.freeze(Some(a)).expect("can be drawn with");
            assert!(picture(&gpu, &mut renderer, &target, &a) == own, "looking from where it froze");
            let from_b = picture(&gpu, &mut renderer, &target, &b);
            let frozen = renderer.read_mesh().expect("read");
            assert_eq!(
                bytemuck::cast_slice::<_, u8>(&frozen.vertices),
                bytemuck::cast_slice::<_, u8>(&mesh.vertices)
            );
            assert_eq!((frozen.triangles, frozen.anchor_m), (mesh.triangles, mesh.anchor_m));
            assert!(from_b != own);
            renderer.freeze(None).expect("always");
            assert!(picture(&gpu, &mut renderer, &target, &a) == own, "following again");
            assert!(
                picture(&gpu, &mut renderer, &target, &b) != from_b,
                "other levels, and nothing culled away"
            );
            assert!(renderer.freeze(Some(Camera { fov_deg: f64::NAN, ..a })).is_err());
        }
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn a_part_of_a_target_shows_the_same_picture_and_leaves_the_rest() {
    let gpu = common::gpu();
    let terrain = mountains(257);
    let scene = Scene { n: 63, background: [1.0, 0.0, 1.0], fog: false, ..Scene::default() };
    let camera = over(&terrain, [0.5, 0.2], 300.0);
    let small = Offscreen::new(&gpu.device, [100, 60]).expect("fits");
    let (mut renderer, target) = renderer(&gpu, &terrain, &scene);
    let alone = picture(&gpu, &mut renderer, &small, &camera);
    let area = [30, 20, 100, 60];
    renderer.prepare(&camera, [100, 60]).expect("prepared");
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let (color, depth) = (&target.color, &target.depth);
    renderer.record(&mut encoder, Target { color, depth, clear: true, area: Some(area) });
    gpu.queue.submit([encoder.finish()]);
    let bytes = target.read_rgba(&gpu.device, &gpu.queue).expect("read");
    let mut inside = Vec::new();
    for (k, p) in bytes.chunks_exact(4).enumerate() {
        let [x, y] = [k as u32 % SIZE[0], k as u32 / SIZE[0]];
        if (30..130).contains(&x) && (20..80).contains(&y) {
            inside.push([p[0], p[1], p[2], p[3]]);
        } else {
            assert_eq!(p, [255, 0, 255, 255], "{x},{y}");
        }
    }
    // Where edges fall between pixels may round otherwise, the offset being another one.
    let differ = inside.iter().zip(&alone).filter(|(a, b)| a != b).count();
    assert!(differ * 200 < inside.len(), "{differ} of {}", inside.len());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn a_restyled_renderer_draws_as_a_new_one_and_sends_nothing() {
    let gpu = common::gpu();
    let terrain = mountains(513);
    let plain = Scene { n: 127, ..Scene::default() };
    let (mut renderer_at_work, target) = renderer(&gpu, &terrain, &plain);
    let camera = over(&terrain, [0.5, 0.2], 300.0);
    draw(&gpu, &mut renderer_at_work, &target, &camera).expect("drawn");
    for scene in [
        Scene { color: ColorMode::Slope, ..plain.clone() },
        Scene { color: ColorMode::Levels, wireframe: true, ..plain.clone() },
        Scene { fog: false, sun_deg: [90.0, 20.0], ..plain.clone() },
        Scene { background: [0.1, 0.2, 0.3], ..plain.clone() },
        plain.clone(),
    ] {
        assert!(renderer_at_work.restyle(&scene), "{scene:?}");
        let upload = renderer_at_work.prepare(&camera, SIZE).expect("prepared");
        assert_eq!((upload.height_bytes, upload.control_bytes, upload.factor_bytes), (0, 0, 0));
        let restyled = picture(&gpu, &mut renderer_at_work, &target, &camera);
        let (mut new, target) = renderer(&gpu, &terrain, &scene);
        assert!(restyled == picture(&gpu, &mut new, &target, &camera), "{scene:?}");
        assert_eq!(renderer_at_work.plan().passes, new.plan().passes);
    }
    for scene in [
        Scene { color: ColorMode::Error, ..plain.clone() },
        Scene { color: ColorMode::Refill, ..plain.clone() },
        Scene { color: ColorMode::Elevation, ..plain.clone() },
        Scene { n: 63, ..plain.clone() },
        Scene { morph: true, ..plain.clone() },
        Scene { bounds: true, ..plain.clone() },
        Scene { factors: Factors::ByError { pixel_error: Some(1.0), budget: None }, ..plain.clone() },
    ] {
        assert!(!renderer_at_work.restyle(&scene), "{scene:?}");
    }
    let kept = picture(&gpu, &mut renderer_at_work, &target, &camera);
    let (mut new, target) = renderer(&gpu, &terrain, &plain);
    assert!(kept == picture(&gpu, &mut new, &target, &camera), "a refusal changes nothing");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn watched_figures_come_without_waiting_and_are_those_read_back() {
    let gpu = common::gpu();
    let terrain = mountains(513);
    for factors in [Factors::Uniform, Factors::ByError { pixel_error: Some(0.5), budget: Some(9_000) }] {
        let scene = Scene { n: 127, factors, ..Scene::default() };
        let (mut renderer, target) = renderer(&gpu, &terrain, &scene);
        let camera = over(&terrain, [0.5, 0.2], 300.0);
        draw(&gpu, &mut renderer, &target, &camera).expect("drawn");
        assert!(renderer.watched().is_none(), "nobody asked");
        renderer.watch();
        for _ in 0..3 {
            draw(&gpu, &mut renderer, &target, &camera).expect("drawn");
        }
        let read = renderer.read_counters().expect("read");
        let drawn = renderer.drawn().expect("read");
        let watched = renderer.watched().expect("came back by now");
        assert_eq!(watched.counters, read);
        let surface = watched.surface.as_ref().expect("told");
        let p = camera.eye_m + DVec3::new(0.0, 700.0, 0.0);
        assert_eq!(surface.at(p), drawn.at(p));
        assert!(surface.at(p).is_some());
    }
}
