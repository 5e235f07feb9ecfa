//! Every rival draws the terrain it was given: all of it, with heights from the data, without cracks; and what
//! is read back is what was drawn.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use std::collections::HashMap;

use glam::DVec3;
use tessclip::gpu::{Gpu, Offscreen};
use tessclip::heights::HeightGrid;
use tessclip::measure::error::{DrawnHeights, ErrorReport, ErrorSums, TrueView};
use tessclip::measure::{Mesh, check_mesh};
use tessclip::rivals::{CrackPolicy, Detail, DrawnMesh, Lab, Method, Rival};
use tessclip::{Camera, Prefilter, Scene, Target, Terrain};

const SIZE: [u32; 2] = [480, 270];

fn detail() -> Detail {
    Detail { n: 31, pixel_error: 2.0, error_n: 127, ..Detail::default() }
}

/// Magenta background, no fog: what no terrain shows.
fn scene(cull: bool) -> Scene {
    Scene { cull, fog: false, background: [1.0, 0.0, 1.0], ..Scene::default() }
}

fn lab(gpu: &Gpu, terrain: &Terrain, cull: bool) -> Lab {
    Lab::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, &scene(cull))
}

fn draw(gpu: &Gpu, rival: &mut dyn Rival, camera: &Camera, target: &Offscreen) {
    rival.prepare(camera, SIZE).expect("a frame");
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    rival
        .record(&mut encoder, Target { color: &target.color, depth: &target.depth, clear: true, area: None });
    gpu.queue.submit([encoder.finish()]);
}

/// Over the middle, near a corner, outside looking in, high above, and from below the rim.
fn cameras(terrain: &Terrain) -> Vec<Camera> {
    let [low, high] = terrain.extent_m();
    let [w, h] = [0, 1].map(|a| high[a] - low[a]);
    let stand = |u: f64, v: f64, above: f64, yaw_deg: f64, pitch_deg: f64| {
        let (x, y) = (low[0] + u * w, low[1] + v * h);
        let ground = terrain.ground_height_m(x, y).map_or(0.0, f64::from);
        let eye_m = DVec3::new(x, y, ground + above);
        Camera { eye_m, yaw_deg, pitch_deg, fov_deg: 60.0, ..Camera::default() }
    };
    vec![
        stand(0.5, 0.5, 30.0, 40.0, -3.0),
        stand(0.03, 0.04, 120.0, 45.0, -10.0),
        stand(-0.2, 0.5, 600.0, 90.0, -15.0),
        stand(0.4, 0.6, 0.6 * w, 200.0, -80.0),
        terrain.overview(60.0),
    ]
}

fn odd_terrain() -> Terrain {
    Terrain::new(&common::terrain("procedural:mountains?width=331&height=262&seed=3"), Prefilter::default())
}

/// Welded by the bits of the positions, triangles without area in plan left out.
fn welded(mesh: &DrawnMesh) -> Mesh {
    let mut out = Mesh::default();
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|ix| mesh.positions[ix as usize].map(f64::from));
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area.abs() < 1e-6 {
            continue;
        }
        out.triangles.push(t.map(|ix| {
            let p = mesh.positions[ix as usize];
            *known.entry(p.map(|v| (v + 0.0).to_bits())).or_insert_with(|| {
                out.vertices.push([0, 1, 2].map(|a| mesh.anchor_m[a] + f64::from(p[a])));
                out.vertices.len() as u32 - 1
            })
        }));
    }
    out
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn every_method_covers_the_terrain_and_keeps_its_crack_policy() {
    let gpu = common::gpu();
    let terrain = odd_terrain();
    let lab = lab(&gpu, &terrain, false);
    let domain = terrain.extent_m();
    let area: f64 = (0..2).map(|a| domain[1][a] - domain[0][a]).product();
    for method in Method::ALL {
        let target = Offscreen::new(&gpu.device, SIZE).unwrap();
        let mut rival = lab.make(method, &detail()).unwrap();
        for (k, camera) in cameras(&terrain).iter().enumerate() {
            draw(&gpu, rival.as_mut(), camera, &target);
            let mesh = welded(&rival.read_mesh().unwrap());
            let faults = check_mesh(&mesh, domain, 0.05);
            let name = method.name();
            assert_eq!((faults.misoriented, faults.not_finite), (0, 0), "{name}, camera {k}: {faults:?}");
            assert!(faults.area_error < 1e-4, "{name}, camera {k}: {faults:?} of {area}");
            if method.crack_policy() == CrackPolicy::Conforming {
                assert_eq!(faults.open_edges, 0, "{name}, camera {k}: {faults:?}");
            }
        }
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn heights_come_from_the_data() {
    let gpu = common::gpu();
    let terrain = odd_terrain();
    let lab = lab(&gpu, &terrain, true);
    let ground = lab.ground().unwrap().clone();
    for method in Method::ALL {
        let target = Offscreen::new(&gpu.device, SIZE).unwrap();
        let mut rival = lab.make(method, &detail()).unwrap();
        for camera in cameras(&terrain) {
            draw(&gpu, rival.as_mut(), &camera, &target);
            let mesh = rival.read_mesh().unwrap();
            assert!(!mesh.triangles.is_empty(), "{}", method.name());
            let (mut exact, mut between) = (0, 0);
            for ix in mesh.triangles.iter().flatten() {
                let p = mesh.positions[*ix as usize];
                let world = [0, 1, 2].map(|a| mesh.anchor_m[a] + f64::from(p[a]));
                let at = terrain.samples_from_world(DVec3::from_array(world));
                let node = at.map(|v| v.round() as i32);
                assert!(
                    (0..2).all(|a| (at[a] - f64::from(node[a])).abs() < 0.01),
                    "{}: {at:?}",
                    method.name()
                );
                if (world[2] - f64::from(ground.height(node))).abs() < 1e-3 {
                    exact += 1
                } else {
                    between += 1
                }
            }
            // Only the two that morph have vertices between two levels' surfaces.
            let morphs = method.crack_policy() == CrackPolicy::ZeroAreaTriangles;
            assert!(morphs || between == 0, "{}: {between} vertices off the data", method.name());
            assert!(3 * exact > between, "{}: {exact} exact, {between} between", method.name());
        }
    }
}

/// Errors of a method over some cameras.
fn errors(gpu: &Gpu, lab: &Lab, terrain: &Terrain, method: Method, detail: &Detail) -> ErrorReport {
    let ground = lab.ground().unwrap().clone();
    let target = Offscreen::new(&gpu.device, SIZE).unwrap();
    let mut truth = lab.make(Method::BruteForce, detail).unwrap();
    let mut rival = lab.make(method, detail).unwrap();
    let mut sums = ErrorSums::default();
    for camera in cameras(terrain) {
        draw(gpu, truth.as_mut(), &camera, &target);
        let depth = target.read_depth(&gpu.device, &gpu.queue).unwrap();
        let view = TrueView::of(terrain, &ground, &camera, SIZE, &depth);
        draw(gpu, rival.as_mut(), &camera, &target);
        let depth = target.read_depth(&gpu.device, &gpu.queue).unwrap();
        let drawn = DrawnHeights::of(terrain, &ground, &rival.read_mesh().unwrap());
        sums.add(&ground, terrain, &view, &drawn);
        sums.add_picture(&ground, terrain, &view, &drawn, &depth);
    }
    sums.report()
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn what_is_read_back_is_what_was_drawn_and_no_pixel_is_a_crack() {
    let gpu = common::gpu();
    let terrain = odd_terrain();
    let lab = lab(&gpu, &terrain, true);
    for method in Method::ALL {
        let e = errors(&gpu, &lab, &terrain, method, &detail());
        let name = method.name();
        eprintln!("{name}: {e:?}");
        assert_eq!(e.crack_pixels, 0, "{name}: {e:?}");
        assert!(e.pixels > 10_000 && e.read_back_mismatch_pixels * 1_000 <= e.pixels, "{name}: {e:?}");
        assert_eq!(e.uncovered_samples, 0, "{name}: {e:?}");
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn brute_force_scores_zero() {
    let gpu = common::gpu();
    let terrain = odd_terrain();
    let lab = lab(&gpu, &terrain, true);
    let e = errors(&gpu, &lab, &terrain, Method::BruteForce, &detail());
    assert!(e.samples > 10_000);
    // What storing a height relative to the anchor as f32 leaves.
    assert!(e.vertical_m.max.unwrap() < 3e-4 && e.px.max.unwrap() < 0.01, "{e:?}");
    assert_eq!((e.crack_pixels, e.coverage_mismatch_pixels, e.read_back_mismatch_pixels), (0, 0, 0));
    // Whole metres are exact.
    let heights: Vec<f32> = (0..65 * 65).map(|k| ((k * 7_919) % 97) as f32).collect();
    let whole = Terrain::new(&HeightGrid::new(65, 65, heights).unwrap(), Prefilter::default());
    let lab = Lab::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &whole, &scene(true));
    let e = errors(&gpu, &lab, &whole, Method::BruteForce, &detail());
    assert_eq!((e.vertical_m.max, e.px.max), (Some(0.0), Some(0.0)));
}

/// A smooth ridge of 513 x 513 samples on a flat plane, seen whole.
#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn a_smooth_ridge_takes_few_triangles() {
    let gpu = common::gpu();
    let side = 513;
    let ridge = |k: usize| {
        let [x, y] = [k % side, k / side].map(|v| (v as f64 - 256.0) / 256.0);
        // A crest that bends, as high as a fifth of the extent is wide, and fades towards its ends.
        let off = (y - 0.15 * (3.0 * x).sin()) / 0.12;
        (1_000.0 * (-off * off).exp() * (1.0 - x * x).max(0.0)) as f32
    };
    let mut grid = HeightGrid::new(side, side, (0..side * side).map(ridge).collect()).unwrap();
    grid.spacing_m = [10.0; 2];
    let terrain = Terrain::new(&grid, Prefilter::default());
    let lab = lab(&gpu, &terrain, true);
    let ground = lab.ground().unwrap().clone();
    let size = [1280, 720];
    let camera = terrain.overview(60.0);
    let target = Offscreen::new(&gpu.device, size).unwrap();
    let frame = |method, detail: &Detail| {
        let mut rival = lab.make(method, detail).unwrap();
        rival.prepare(&camera, size).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        rival.record(
            &mut encoder,
            Target { color: &target.color, depth: &target.depth, clear: true, area: None },
        );
        gpu.queue.submit([encoder.finish()]);
        rival
    };
    drop(frame(Method::BruteForce, &detail()));
    let depth = target.read_depth(&gpu.device, &gpu.queue).unwrap();
    let view = TrueView::of(&terrain, &ground, &camera, size, &depth);
    let worst = |mesh: &DrawnMesh| {
        let mut sums = ErrorSums::default();
        sums.add(&ground, &terrain, &view, &DrawnHeights::of(&terrain, &ground, mesh));
        (mesh.triangles.len(), sums.report().px.max.unwrap())
    };
    let budget = Detail { error_n: 1023, pixel_error: 0.01, budget: Some(8_192), ..detail() };
    let ours = worst(&frame(Method::ByError, &budget).read_mesh().unwrap());
    // The uniform grid of as many triangles: every eighth sample.
    let steps = side / 8;
    let mut even = DrawnMesh { anchor_m: [0.0; 3], positions: Vec::new(), triangles: Vec::new() };
    for y in 0..=steps {
        for x in 0..=steps {
            let h = grid.heights_m[8 * y * side + 8 * x];
            even.positions.push([80.0 * x as f32, 80.0 * y as f32, h]);
            if x < steps && y < steps {
                let sw = (y * (steps + 1) + x) as u32;
                let (se, nw, ne) = (sw + 1, sw + steps as u32 + 1, sw + steps as u32 + 2);
                even.triangles.extend([[sw, se, nw], [se, ne, nw]]);
            }
        }
    }
    let even = worst(&even);
    eprintln!("ridge: ours {ours:?}, uniform {even:?} (triangles, px)");
    assert!(ours.0 <= 8_192 && ours.1 < 1.0 && even.0 == 8_192 && even.1 > 2.0);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn error_driven_methods_keep_near_their_threshold() {
    let gpu = common::gpu();
    let terrain = odd_terrain();
    let lab = lab(&gpu, &terrain, true);
    for method in [Method::Geomipmap, Method::Chunked, Method::Roam, Method::ByError] {
        let at = |pixel_error: f64| {
            let e = errors(&gpu, &lab, &terrain, method, &Detail { pixel_error, error_n: 1023, ..detail() });
            (e.px.p99.unwrap(), e.px.max.unwrap())
        };
        let (fine, coarse) = (at(0.5), at(8.0));
        eprintln!("{}: {fine:?} at 0.5, {coarse:?} at 8", method.name());
        assert!(fine.0 <= 0.5 && coarse.0 <= 8.0 && fine.0 < coarse.0, "{}", method.name());
        // ROAM's variance is no bound. The others' errors are, but of whole patches: a cell that is stitched to
        // another patch has other triangles.
        if method == Method::ByError {
            // A true bound, however sides are divided, where the window holds level 0 to the horizon.
            assert!(fine.1 <= 0.5 && coarse.1 <= 8.0, "{fine:?} {coarse:?}");
        } else if method != Method::Roam {
            assert!(fine.1 <= 1.0 && coarse.1 <= 16.0, "{}: {fine:?} {coarse:?}", method.name());
        }
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn small_and_narrow_data_is_drawn_or_refused_in_words() {
    let gpu = common::gpu();
    for (w, h) in [(2, 2), (2, 500), (17, 3), (40, 33)] {
        let heights: Vec<f32> = (0..w * h).map(|k| ((k * 31) % 11) as f32).collect();
        let terrain = Terrain::new(&HeightGrid::new(w, h, heights).unwrap(), Prefilter::default());
        let lab = lab(&gpu, &terrain, true);
        let target = Offscreen::new(&gpu.device, SIZE).unwrap();
        for method in Method::ALL {
            let mut rival = match lab.make(method, &Detail { n: 15, ..detail() }) {
                Ok(rival) => rival,
                Err(why) => panic!("{w} x {h}, {}: {why}", method.name()),
            };
            for camera in cameras(&terrain) {
                draw(&gpu, rival.as_mut(), &camera, &target);
                rival.read_mesh().unwrap();
                rival.count().unwrap();
            }
        }
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn what_a_method_cannot_do_is_said_in_one_line() {
    let gpu = common::gpu();
    let mut grid = common::terrain("procedural:mountains?size=65");
    let mut valid = vec![true; grid.heights_m.len()];
    valid[100] = false;
    grid.valid = Some(valid);
    let terrain = Terrain::new(&grid, Prefilter::default());
    let lab = lab(&gpu, &terrain, true);
    for method in Method::ALL {
        let made = lab.make(method, &detail());
        let ours = matches!(method, Method::Tessellated | Method::ByError | Method::AllPatches);
        match made {
            Ok(_) => assert!(ours, "{} has no rule for voids", method.name()),
            Err(why) => assert!(!ours && why.to_string().contains("voids"), "{}: {why}", method.name()),
        }
    }
    let bad = Detail { patch_cells: 12, ..detail() };
    let flat = Terrain::new(&common::terrain("procedural:plain?size=65"), Prefilter::default());
    let lab = Lab::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &flat, &scene(true));
    assert!(lab.make(Method::Geomipmap, &bad).err().unwrap().to_string().contains("12 cells"));
}
