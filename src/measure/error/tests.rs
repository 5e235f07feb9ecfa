//! The probe on terrain small enough to be judged by hand, by slow twins, and by pictures made here.

use glam::DVec3;

use super::{DrawnHeights, ErrorReport, ErrorSums, TrueView, keep_every, place};
use crate::Prefilter;
use crate::camera::Camera;
use crate::heights::HeightGrid;
use crate::rivals::{DrawnMesh, Ground};
use crate::scene::Terrain;

const SAMPLES: [usize; 2] = [65, 49];
const SIZE_PX: [u32; 2] = [128, 96];
/// The near plane over samples a metre apart.
const NEAR_M: f64 = 0.05;

/// Terrain of samples a metre apart, heights in whole quarters so that f32 holds all differences.
fn terrain_of(height: impl Fn(f64, f64) -> f64) -> (Terrain, Ground) {
    let heights = (0..SAMPLES[0] * SAMPLES[1])
        .map(|k| {
            let h = height((k % SAMPLES[0]) as f64, (k / SAMPLES[0]) as f64);
            ((h * 4.0).round() / 4.0) as f32
        })
        .collect();
    let grid = HeightGrid::new(SAMPLES[0], SAMPLES[1], heights).unwrap();
    let terrain = Terrain::new(&grid, Prefilter::default());
    let ground = Ground::of(&terrain).unwrap();
    (terrain, ground)
}

fn hills() -> (Terrain, Ground) {
    terrain_of(|x, y| 60.0 + 8.0 * (x / 9.0).sin() + 5.0 * (y / 7.0).cos())
}

/// Every `step`-th sample, raised by `raise_m`; cells cut from south-east to north-west.
fn mesh_of(terrain: &Terrain, ground: &Ground, step: u32, raise_m: f32) -> DrawnMesh {
    let middle = [32.0, 24.0];
    let spacing = ground.spacing_m;
    let [columns, rows] = ground.size.map(|s| (s - 1) / step + 1);
    let positions = (0..columns * rows).map(|k| {
        let at = [k % columns * step, k / columns * step];
        let [x, y] = [0, 1].map(|a| ((f64::from(at[a]) - middle[a]) * spacing[a]) as f32);
        [x, y, ground.height(at.map(u32::cast_signed)) + raise_m - 64.0]
    });
    let mut triangles = Vec::new();
    for y in 0..rows - 1 {
        for x in 0..columns - 1 {
            let sw = y * columns + x;
            triangles.push([sw, sw + 1, sw + columns]);
            triangles.push([sw + 1, sw + columns + 1, sw + columns]);
        }
    }
    let [x, y] = [0, 1].map(|a| terrain.origin_m[a] + middle[a] * spacing[a]);
    DrawnMesh { anchor_m: [x, y, 64.0], positions: positions.collect(), triangles }
}

/// Twice the area of a triangle in its first two coordinates.
fn area2(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    (b - a).truncate().perp_dot((c - a).truncate())
}

/// Slow depth picture, by the camera's clip matrix; triangles that reach before the near plane are left out.
fn depth_picture(mesh: &DrawnMesh, camera: &Camera) -> Vec<f32> {
    let [width, height] = SIZE_PX.map(f64::from);
    let clip = camera.clip_from_anchor(DVec3::from_array(mesh.anchor_m), width / height, NEAR_M);
    let corner = |vertex: u32| {
        let p = clip * DVec3::from_array(mesh.positions[vertex as usize].map(f64::from)).extend(1.0);
        let at = |v: f64, size: f64| (v / p.w + 1.0) * 0.5 * size;
        (p.w > NEAR_M).then(|| DVec3::new(at(p.x, width), at(-p.y, height), p.z / p.w))
    };
    let mut depth = vec![0.0_f32; (SIZE_PX[0] * SIZE_PX[1]) as usize];
    for t in &mesh.triangles {
        let [Some(a), Some(b), Some(c)] = t.map(&corner) else { continue };
        let whole = area2(a, b, c);
        if whole == 0.0 {
            continue;
        }
        let low = a.min(b).min(c).max(DVec3::ZERO);
        let high = a.max(b).max(c).min(DVec3::new(width, height, 1.0));
        for y in low.y as u32..high.y.ceil().max(0.0) as u32 {
            for x in low.x as u32..high.x.ceil().max(0.0) as u32 {
                let p = DVec3::new(f64::from(x) + 0.5, f64::from(y) + 0.5, 0.0);
                let share = [area2(p, b, c), area2(p, c, a), area2(p, a, b)].map(|v| v / whole);
                if share.iter().all(|v| *v >= -1e-9) {
                    let d = share[0] * a.z + share[1] * b.z + share[2] * c.z;
                    let pixel = &mut depth[(y * SIZE_PX[0] + x) as usize];
                    *pixel = pixel.max(d as f32);
                }
            }
        }
    }
    depth
}

fn camera_at(eye: [f64; 3], pitch_deg: f64) -> Camera {
    Camera { eye_m: DVec3::from_array(eye), pitch_deg, ..Camera::default() }
}

fn from_above() -> Camera {
    camera_at([32.0, 24.0, 200.0], -90.0)
}

/// North, along the horizon, over all of the terrain.
fn level() -> Camera {
    camera_at([32.0, -100.0, 90.0], 0.0)
}

fn view_of(terrain: &Terrain, ground: &Ground, camera: Camera) -> TrueView {
    let depth = depth_picture(&mesh_of(terrain, ground, 1, 0.0), &camera);
    TrueView::of(terrain, ground, &camera, SIZE_PX, &depth)
}

/// Everything of one view of one mesh.
fn probe(terrain: &Terrain, ground: &Ground, camera: Camera, mesh: &DrawnMesh) -> ErrorReport {
    let view = view_of(terrain, ground, camera);
    let drawn = DrawnHeights::of(terrain, ground, mesh);
    let mut sums = ErrorSums::default();
    sums.add(ground, terrain, &view, &drawn);
    sums.add_picture(ground, terrain, &view, &drawn, &depth_picture(mesh, &camera));
    sums.report()
}

/// Pixels that 3 m upright span at a distance along the horizon, with 60 degrees over the picture's height.
fn three_metres_px(distance_m: f64) -> f64 {
    3.0 * f64::from(SIZE_PX[1]) / (2.0 * 30.0_f64.to_radians().tan() * distance_m)
}

fn close(got: Option<f64>, expected: f64) {
    let got = got.unwrap();
    assert!((got - expected).abs() <= 1e-5 * expected.max(1.0), "{got} instead of {expected}");
}

#[test]
fn all_samples_drawn_score_exactly_nothing() {
    let (terrain, ground) = hills();
    let mesh = mesh_of(&terrain, &ground, 1, 0.0);
    for camera in [from_above(), level(), camera_at([32.0, -60.0, 110.0], -30.0)] {
        let report = probe(&terrain, &ground, camera, &mesh);
        assert!(report.samples > 1_000 && report.pixels > 400, "{report:?}");
        assert_eq!(report.px.max, Some(0.0));
        assert_eq!(report.px.p99, Some(0.0));
        assert_eq!(report.px.share_over_1, Some(0.0));
        assert_eq!((report.vertical_m.rms, report.vertical_m.max), (Some(0.0), Some(0.0)));
        let faults = [report.uncovered_samples, report.crack_pixels, report.coverage_mismatch_pixels];
        assert_eq!((faults, report.read_back_mismatch_pixels), ([0; 3], 0));
    }
}

#[test]
fn the_least_step_that_leaves_few_enough_is_taken() {
    for count in 1..50_usize {
        let step = keep_every(count, 7);
        assert!((0..count).step_by(step).count() <= 7);
        assert!(step == 1 || (0..count).step_by(step - 1).count() > 7);
    }
    assert_eq!(keep_every(0, 7), 1);
}

#[test]
fn nothing_added_is_null() {
    let report = ErrorSums::default().report();
    assert!(report.px.max.is_none() && report.px.share_over_1.is_none() && report.px.mean.is_none());
    assert!(report.vertical_m.rms.is_none() && report.vertical_m.max.is_none());
    assert!(report.pop_px.p99.is_none() && report.pop_px.max.is_none());
}

#[test]
fn a_raised_mesh_scores_what_it_was_raised_by() {
    let (terrain, ground) = hills();
    let mesh = mesh_of(&terrain, &ground, 1, 3.0);
    let report = probe(&terrain, &ground, level(), &mesh);
    close(report.vertical_m.rms, 3.0);
    close(report.vertical_m.p99, 3.0);
    close(report.vertical_m.max, 3.0);
    let view = view_of(&terrain, &ground, level());
    let rows = view.visible().iter().map(|ix| *ix as usize / SAMPLES[0]);
    let px: Vec<f64> = rows.map(|row| three_metres_px(row as f64 + 100.0)).collect();
    assert_eq!(report.samples, px.len() as u64);
    close(report.px.max, px.iter().copied().fold(0.0, f64::max));
    close(report.px.mean, px.iter().sum::<f64>() / px.len() as f64);
    assert_eq!(report.px.share_over_1, Some(1.0), "all by more than 1.6 pixels");
}

#[test]
fn a_raised_mesh_seen_from_above_spreads_from_the_middle() {
    let (terrain, ground) = terrain_of(|_, _| 60.0);
    let report = probe(&terrain, &ground, from_above(), &mesh_of(&terrain, &ground, 1, 3.0));
    // 140 m below the eye, 137 when raised; the corners are farthest from the middle.
    let focal_px = 48.0 / 30.0_f64.to_radians().tan();
    close(report.px.max, focal_px * 32.0_f64.hypot(24.0) * (1.0 / 137.0 - 1.0 / 140.0));
    assert_eq!(report.samples, ground.heights.len() as u64);
}

#[test]
fn a_shift_pops_by_what_it_displaces() {
    let (terrain, ground) = hills();
    let view = view_of(&terrain, &ground, level());
    let [before, after] =
        [0.0, 3.0].map(|raise| DrawnHeights::of(&terrain, &ground, &mesh_of(&terrain, &ground, 1, raise)));
    let mut sums = ErrorSums::default();
    sums.add_pop(&ground, &terrain, &view, &before, &view.camera, &before);
    assert_eq!(sums.report().pop_px.max, Some(0.0));
    sums.add_pop(&ground, &terrain, &view, &before, &view.camera, &after);
    let report = sums.report();
    let nearest_row = view.visible().iter().map(|ix| *ix as usize / SAMPLES[0]).min().unwrap();
    close(report.pop_px.max, three_metres_px(nearest_row as f64 + 100.0));
    assert_eq!((report.pops, report.views), (2, 0));
}

/// The differences of a mesh by trying every triangle at every sample.
fn slow_differences(terrain: &Terrain, ground: &Ground, mesh: &DrawnMesh) -> Vec<Option<f64>> {
    let anchor = DVec3::from_array(mesh.anchor_m);
    let corners: Vec<[DVec3; 3]> = mesh
        .triangles
        .iter()
        .map(|t| t.map(|v| anchor + DVec3::from_array(mesh.positions[v as usize].map(f64::from))))
        .collect();
    let of_sample = |ix: usize| {
        let truth_m = f64::from(ground.heights[ix]);
        let p = place(terrain, ground, ix, truth_m);
        let mut farthest: Option<f64> = None;
        for [a, b, c] in &corners {
            let whole = area2(*a, *b, *c);
            let (u, v) = (area2(*a, p, *c) / whole, area2(*a, *b, p) / whole);
            if whole != 0.0 && u > -1e-6 && v > -1e-6 && u + v < 1.0 + 1e-6 {
                let difference = a.z + u * (b.z - a.z) + v * (c.z - a.z) - truth_m;
                if farthest.is_none_or(|d| difference.abs() > d.abs()) {
                    farthest = Some(difference);
                }
            }
        }
        farthest
    };
    (0..ground.heights.len()).map(of_sample).collect()
}

#[test]
fn a_coarse_mesh_equals_its_slow_twin() {
    let (mut terrain, _) = hills();
    terrain.origin_m = [500_000.0, -4_000.0];
    terrain.spacing_m = [2.0, 3.0];
    let ground = Ground::of(&terrain).unwrap();
    let mut mesh = mesh_of(&terrain, &ground, 4, 0.0);
    // The south-western half of a cell that nothing below covers again.
    mesh.triangles.remove(2 * 14);
    // Without area in the plan; then one whose corners are no nodes, across others; then one half outside.
    mesh.triangles.push([0, 1, 2]);
    for corners in [[[1.3, 1.7], [40.4, 3.2], [15.6, 60.1]], [[50.0, 40.0], [90.0, 40.0], [50.0, 80.0]]] {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners.map(|[x, y]| [(x - 32.0) * 2.0, (y - 24.0) * 3.0, 20.0_f32]));
        mesh.triangles.push([first, first + 2, first + 1]);
    }
    let drawn = DrawnHeights::of(&terrain, &ground, &mesh);
    let slow = slow_differences(&terrain, &ground, &mesh);
    assert!(slow.iter().any(Option::is_none) && slow.iter().flatten().any(|d| *d > 20.0));
    for (ix, expected) in slow.iter().enumerate() {
        match (drawn.at(ix), expected) {
            (Some(got), Some(expected)) => assert!((got - expected).abs() < 1e-4, "{ix}: {got} {expected}"),
            (got, expected) => assert_eq!(got, *expected, "{ix}"),
        }
    }
}

#[test]
fn a_coarse_mesh_is_found_in_its_own_picture() {
    let (terrain, ground) = hills();
    let mesh = mesh_of(&terrain, &ground, 4, 0.0);
    for camera in [from_above(), level(), camera_at([32.0, -60.0, 110.0], -30.0)] {
        let report = probe(&terrain, &ground, camera, &mesh);
        assert_eq!(report.read_back_mismatch_pixels, 0);
        assert!(report.px.max.unwrap() > 0.0 && report.vertical_m.max.unwrap() > 0.0);
    }
}

#[test]
fn a_triangle_left_out_is_a_crack_and_uncovered() {
    let (terrain, ground) = terrain_of(|_, _| 60.0);
    let mut mesh = mesh_of(&terrain, &ground, 4, 0.0);
    let whole = probe(&terrain, &ground, from_above(), &mesh);
    assert_eq!([whole.crack_pixels, whole.coverage_mismatch_pixels, whole.uncovered_samples], [0; 3]);
    // The south-western half of a cell near the middle: 3 of its samples lie on none of its edges.
    mesh.triangles.remove(2 * (6 * 16 + 8));
    let report = probe(&terrain, &ground, from_above(), &mesh);
    assert_eq!(report.uncovered_samples, 3);
    assert!(report.crack_pixels > 0, "{report:?}");
    assert!(report.crack_pixels <= report.coverage_mismatch_pixels);
    assert_eq!(report.vertical_m.max, Some(0.0));
}

#[test]
fn background_that_reaches_the_border_is_no_crack() {
    let (terrain, ground) = terrain_of(|_, _| 60.0);
    let view = view_of(&terrain, &ground, from_above());
    let drawn = DrawnHeights::of(&terrain, &ground, &DrawnMesh::default());
    let mut sums = ErrorSums::default();
    sums.add(&ground, &terrain, &view, &drawn);
    sums.add_picture(&ground, &terrain, &view, &drawn, &[0.0; 128 * 96]);
    let report = sums.report();
    assert!(report.pixels > 0);
    assert_eq!((report.crack_pixels, report.coverage_mismatch_pixels), (0, report.pixels));
    assert_eq!((report.samples, report.uncovered_samples), (0, view.visible().len() as u64));
    assert!(report.px.max.is_none() && report.vertical_m.max.is_none());
}

#[test]
fn samples_behind_a_wall_are_not_seen() {
    let (terrain, ground) = terrain_of(|_, y| if y == 20.0 { 30.0 } else { 0.0 });
    let camera = camera_at([32.0, -30.0, 10.0], 0.0);
    let view = view_of(&terrain, &ground, camera);
    let seen = |x: u32, y: u32| view.visible().contains(&(y * SAMPLES[0] as u32 + x));
    assert!((10..55).all(|x| seen(x, 10) && seen(x, 20)), "before the wall and on it");
    assert!((22..49).all(|y| (0..65).all(|x| !seen(x, y))), "behind it");
    // Without the wall's picture they are: it is the picture that hides them.
    let open = TrueView::of(&terrain, &ground, &camera, SIZE_PX, &[0.0; 128 * 96]);
    assert!(open.visible().len() > view.visible().len());
    assert!(!open.is_terrain(0) && view.is_terrain(60 * 128 + 64));
}

#[test]
fn a_mesh_that_is_not_what_was_drawn_is_noticed() {
    let (terrain, ground) = hills();
    let view = view_of(&terrain, &ground, from_above());
    let [truth, raised] = [0.0, 6.0].map(|raise| mesh_of(&terrain, &ground, 1, raise));
    let shown = depth_picture(&truth, &from_above());
    let mismatches = |mesh: &DrawnMesh| {
        let drawn = DrawnHeights::of(&terrain, &ground, mesh);
        let mut sums = ErrorSums::default();
        sums.add_picture(&ground, &terrain, &view, &drawn, &shown);
        sums.report()
    };
    assert_eq!(mismatches(&truth).read_back_mismatch_pixels, 0);
    let report = mismatches(&raised);
    assert!(report.read_back_mismatch_pixels * 10 > report.pixels * 9, "{report:?}");
}
