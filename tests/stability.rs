//! Numerical stability: all rows hold, and each judge is shown failing on what is broken on purpose.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use glam::{DVec2, DVec3};
use tessclip::gpu::{Gpu, Offscreen};
use tessclip::measure::invariants::{CheckRow, Effort};
use tessclip::measure::oracle::packed_normal;
use tessclip::measure::stability::{
    PositionRows, Shot, check_stability, deviations, differing_pixels, faults_of, judge_displacement,
    judge_jitter, judge_order, judge_vertices, shoot,
};
use tessclip::surface::Ellipsoid;
use tessclip::{Camera, Prefilter, Renderer, Scene, Terrain};

/// A mesh that everything is right with.
struct Case {
    terrain: Terrain,
    camera: Camera,
    renderer: Renderer,
    shot: Shot,
}

fn case(gpu: &Gpu, terrain: Terrain, camera: Camera) -> Case {
    let scene = Scene { n: 31, ..Scene::default() };
    let mut renderer =
        Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene).expect("drawable");
    let shot = shoot(gpu, &mut renderer, &camera).expect("drawn");
    Case { terrain, camera, renderer, shot }
}

fn plane(gpu: &Gpu) -> Case {
    plane_at(gpu, 1e9)
}

fn plane_at(gpu: &Gpu, offset: f64) -> Case {
    let mut terrain = Terrain::new(&common::terrain("procedural:mountains?size=129"), Prefilter::Subsample);
    terrain.origin_m = [offset; 2];
    let [x, y] = [offset + 1_900.0, offset + 1_700.0];
    let ground = f64::from(terrain.ground_height_m(x, y).expect("ground"));
    let eye_m = DVec3::new(x, y, ground + 30.0);
    let camera = Camera { eye_m, yaw_deg: 20.0, pitch_deg: -30.0, ..Camera::default() };
    case(gpu, terrain, camera)
}

fn globe(gpu: &Gpu) -> Case {
    let terrain = Terrain::globe(vec![common::terrain("procedural:planet?size=129")], Ellipsoid::WGS84);
    let terrain = terrain.expect("a globe");
    let camera = terrain.camera([45.2, 10.0, 4e5, 80.0, -30.0], 60.0);
    case(gpu, terrain, camera)
}

impl Case {
    fn rows(&self, change: impl FnOnce(&mut Shot)) -> Vec<CheckRow> {
        let mut shot = self.shot.clone();
        change(&mut shot);
        let mut rows = PositionRows::new("test");
        judge_vertices(&mut rows, &shot, &self.terrain);
        rows.finish()
    }

    /// The vertex nearest to the camera among those in the picture.
    fn nearest(&self) -> usize {
        let anchor = DVec3::from_array(self.shot.mesh.anchor_m);
        let world = |k: usize| anchor + DVec3::from_array(self.shot.mesh.vertices[k].position.map(f64::from));
        let seen = |k: &usize| self.shot.lens.exact(world(*k)).is_some_and(|px| self.shot.lens.shows(px));
        let distance = |k: &usize| self.shot.lens.distance(world(*k));
        (0..self.shot.mesh.vertices.len())
            .filter(seen)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .expect("a vertex in view")
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn all_rows_hold() {
    let gpu = common::gpu();
    let grid = common::terrain("procedural:mountains?width=331&height=262");
    let rows = check_stability(&gpu, &grid, Effort::Full).expect("drawable");
    for row in &rows {
        eprintln!("{:<75} {:>8} {:>10.3e} of {:.1e} {}", row.name, row.tried, row.worst, row.bound, row.unit);
    }
    assert!(rows.len() > 80);
    for row in rows {
        assert!(row.pass && row.tried > 0, "{row:?}");
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_vertex_off_by_two_millimetres_is_caught_by_metre_and_by_pixel() {
    let gpu = common::gpu();
    let case = plane(&gpu);
    assert!(case.rows(|_| ()).iter().all(|r| r.pass), "{:?}", case.rows(|_| ()));
    let near = case.nearest();
    let rows = case.rows(|s| s.mesh.vertices[near].position[2] += 0.002);
    assert!(!rows[0].pass && rows[0].failed >= 1 && (rows[0].worst - 0.002).abs() < 1e-4, "{:?}", rows[0]);
    assert!(!rows[1].pass, "{:?}", rows[1]);
    let rows = case.rows(|s| s.mesh.vertices[near].position[0] = f32::NAN);
    assert!(!rows[0].pass && !rows[1].pass && rows[0].worst.is_infinite(), "{:?}", rows[0]);
    // A vertex that the data has is drawn as a void.
    let rows = case.rows(|s| s.mesh.vertices[near].packed = u32::MAX);
    assert!(!rows[0].pass, "{:?}", rows[0]);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn absolute_positions_are_told_from_ours() {
    let gpu = common::gpu();
    let case = plane_at(&gpu, 1e5);
    let versus = case.rows(|_| ()).remove(3);
    assert!(versus.pass && versus.bound > 10.0 * versus.worst, "{versus:?}");
    // Far worse than f32 steps at 100 km.
    let coarse = |s: &mut Shot| {
        for v in &mut s.mesh.vertices {
            v.position = v.position.map(|p| (p / 16.0).round() * 16.0);
        }
    };
    assert!(!case.rows(coarse)[3].pass);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn normals_tilted_by_a_fifth_of_a_degree_are_caught() {
    let gpu = common::gpu();
    for case in [plane(&gpu), globe(&gpu)] {
        let normals = case.rows(|_| ()).remove(2);
        assert!(normals.pass && normals.tried > 1_000, "{normals:?}");
        let curved = case.terrain.curved.is_some();
        let tilt = |s: &mut Shot| {
            for v in &mut s.mesh.vertices {
                let aim = {
                    let n = packed_normal(v.packed, curved);
                    (n + n.any_orthonormal_vector() * f64::to_radians(0.2).tan()).normalize()
                };
                v.packed = (v.packed & 0xff00_0000) | pack(aim, curved);
            }
        };
        let tilted = case.rows(tilt).remove(2);
        assert!(!tilted.pass && tilted.worst > 0.15 && tilted.worst < 0.3, "{tilted:?}");
    }
}

/// Octahedral coordinates, 2 x 12 bits.
fn pack(n: DVec3, curved: bool) -> u32 {
    let p = DVec2::new(n.x, n.y) / (n.x.abs() + n.y.abs() + n.z.abs());
    let folded = DVec2::new((1.0 - p.y.abs()) * p.x.signum(), (1.0 - p.x.abs()) * p.y.signum());
    let p = if n.z >= 0.0 || !curved { p } else { folded };
    let steps = if curved { 4094.0 } else { 4095.0 };
    let q = [p.x, p.y].map(|v| ((v * 0.5 + 0.5) * steps).round().clamp(0.0, 4095.0) as u32);
    q[0] | q[1] << 12
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn jitter_and_displacement_are_caught() {
    let gpu = common::gpu();
    let case = plane(&gpu);
    let before = deviations(&case.shot, &case.terrain);
    assert!(before.len() > 20);
    let mut still = CheckRow::new("still", "px", 0.01);
    judge_jitter(&mut still, &before, &before);
    assert!(still.pass && still.tried as usize == before.len());
    let mut shaken = case.shot.clone();
    let near = case.nearest();
    shaken.mesh.vertices[near].position[1] += 0.01;
    let mut row = CheckRow::new("shaken", "px", 0.01);
    judge_jitter(&mut row, &before, &deviations(&shaken, &case.terrain));
    assert!(!row.pass, "{row:?}");

    let mut row = CheckRow::new("moved", "px", 0.01);
    judge_displacement(&mut row, &case.shot, &case.shot);
    assert!(row.pass && row.tried > 100);
    judge_displacement(&mut row, &case.shot, &shaken);
    assert!(!row.pass && row.failed == 1, "{row:?}");
    let mut fewer = case.shot.clone();
    fewer.mesh.triangles.pop();
    let mut row = CheckRow::new("fewer", "px", 0.01);
    judge_displacement(&mut row, &case.shot, &fewer);
    assert!(!row.pass);
}

#[test]
fn a_swapped_order_of_depth_and_a_changed_pixel_are_caught() {
    let (sky, upper, lower) = ([255, 0, 255, 255], [9, 9, 9, 255], [80, 9, 9, 255]);
    let alone = [sky, upper, upper].concat();
    let mut row = CheckRow::new("right", "pixels", 0.0);
    judge_order(&mut row, &alone, &[lower, upper, upper].concat(), [255, 0, 255]);
    assert!(row.pass, "what lies beside the upper sheet is no fault");
    judge_order(&mut row, &alone, &[lower, upper, lower].concat(), [255, 0, 255]);
    assert!(!row.pass && (row.worst, row.failed) == (1.0, 1));
    assert_eq!(differing_pixels(&alone, &alone), 0);
    assert_eq!(differing_pixels(&alone, &[sky, upper, lower].concat()), 1);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn what_is_not_sane_is_caught() {
    let gpu = common::gpu();
    for case in [plane(&gpu), globe(&gpu)] {
        let faults = |change: &dyn Fn(&mut Shot)| {
            let mut shot = case.shot.clone();
            change(&mut shot);
            faults_of(&shot, &case.renderer, &case.camera)
        };
        assert_eq!(faults(&|_| ()), 0);
        let near = case.nearest();
        assert!(faults(&|s| s.mesh.vertices[near].position[1] = f32::INFINITY) > 0);
        assert!(faults(&|s| s.mesh.triangles[0][1] = u32::MAX) > 0);
        // The first half: those near the camera. Behind a globe's horizon more may be drawn than need be.
        let half = case.shot.mesh.patches.len() / 2;
        assert!(faults(&|s| drop(s.mesh.patches.drain(..half))) > 0, "patches in view were left out");
        if case.terrain.curved.is_none() {
            assert!(faults(&|s| s.mesh.vertices[near].position[2] += 1e4) > 0, "out of its patch's bounds");
        }
    }
}
