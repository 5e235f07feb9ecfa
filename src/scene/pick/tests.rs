//! Rays that hit, graze and miss, on every base.

use glam::DVec3;

use super::Terrain;
use crate::heights::{Degrees, HeightGrid, PositionGrid, ReadOptions, open_terrain};
use crate::pyramid::Prefilter;
use crate::surface::Ellipsoid;

const FAR_M: f64 = 1e9;

fn grid(spec: &str) -> HeightGrid {
    open_terrain(spec, &ReadOptions::default()).unwrap()
}

fn plane(grid: &HeightGrid) -> Terrain {
    Terrain::new(grid, Prefilter::Subsample)
}

/// 0 m in the west, 1000 m in the east; between x = 310 and 320 a wall.
fn cliff() -> Terrain {
    plane(&grid("procedural:cliff?size=65&spacing=10"))
}

fn at(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

#[test]
fn a_wall_is_hit_from_both_sides_and_from_outside_the_data() {
    let terrain = cliff();
    let hit = |from, direction| terrain.pick(from, direction, FAR_M).unwrap();
    let wall = at(315.0, 300.0, 500.0);
    assert!(hit(at(5.0, 300.0, 500.0), DVec3::X).distance(wall) < 1e-3);
    assert!(hit(at(5.0, 300.0, 500.0), DVec3::X * 1e-7).distance(wall) < 1e-3);
    assert!(hit(at(-1e5, 300.0, 500.0), DVec3::X).distance(wall) < 0.2);
    // In the ground from the eastern border on: the wall from behind.
    assert!(hit(at(1e5, 300.0, 500.0), -DVec3::X).distance(wall) < 0.2);
    assert!(hit(at(100.0, 300.0, 500.0), -DVec3::Z).distance(at(100.0, 300.0, 0.0)) < 1e-3);
    assert!(hit(at(100.0, 300.0, -50.0), DVec3::Z).distance(at(100.0, 300.0, 0.0)) < 1e-3);
    // Slanted, from a corner outside.
    let from = at(-400.0, -300.0, 900.0);
    assert!(hit(from, wall - from).distance(wall) < 0.01);
}

#[test]
fn rays_that_point_away_end_too_early_or_are_no_rays_hit_nothing() {
    let terrain = cliff();
    let from = at(5.0, 300.0, 500.0);
    for direction in
        [DVec3::Z, -DVec3::X, at(-1.0, 0.1, 0.3), DVec3::ZERO, DVec3::NAN, at(f64::INFINITY, 0.0, 0.0)]
    {
        assert_eq!(terrain.pick(from, direction, FAR_M), None, "{direction}");
    }
    for reach_m in [0.0, -1.0, f64::NAN, 200.0, 309.0] {
        assert_eq!(terrain.pick(from, DVec3::X, reach_m), None, "{reach_m}");
    }
    assert!(terrain.pick(from, DVec3::X, 311.0).is_some());
    assert!(terrain.pick(from, DVec3::X, f64::INFINITY).is_some());
    for from in [at(f64::NAN, 0.0, 0.0), at(0.0, f64::INFINITY, 0.0), at(100.0, 300.0, -50.0)] {
        assert_eq!(terrain.pick(from, -DVec3::Z, FAR_M), None, "{from}");
    }
    assert_eq!(terrain.pick(at(1e300, -1e300, 1e300), at(-1.0, 1.0, -1.0), 1e301), None);
}

#[test]
fn a_ridge_is_grazed_two_metres_under_its_crest_and_missed_over_it() {
    // 100 m high, 600 m wide, 12 km away: steps are a hundred metres there.
    let (width, height) = (1_501, 11);
    let ridge = |k: usize| (100.0 * (1.0 - (k % width).abs_diff(1_200) as f32 / 30.0)).max(0.0);
    let mut grid = HeightGrid::new(width, height, (0..width * height).map(ridge).collect()).unwrap();
    grid.spacing_m = [10.0; 2];
    let terrain = plane(&grid);
    for (z, met_x) in [(98.0, 11_994.0), (99.0, 11_997.0), (60.0, 11_880.0)] {
        let hit = terrain.pick(at(0.0, 47.0, z), DVec3::X, FAR_M).unwrap();
        assert!(hit.distance(at(met_x, 47.0, z)) < 0.02, "{z}: {hit}");
    }
    assert_eq!(terrain.pick(at(0.0, 47.0, 100.05), DVec3::X, FAR_M), None);
    assert_eq!(terrain.pick(at(0.0, 47.0, 150.0), DVec3::X, FAR_M), None);
}

#[test]
fn rays_fall_through_holes() {
    let hole = |k: usize| [k % 21, k / 21].iter().all(|v| (8..=12).contains(v));
    let heights = (0..441).map(|k| if hole(k) { f32::NAN } else { 10.0 }).collect();
    let terrain = plane(&HeightGrid::new(21, 21, heights).unwrap());
    for direction in [at(0.0, 0.0, -1.0), at(0.01, 0.01, -1.0)] {
        assert_eq!(terrain.pick(at(10.0, 10.0, 100.0), direction, FAR_M), None);
        let hit = terrain.pick(at(3.0, 3.0, 100.0), direction, FAR_M).unwrap();
        assert!((hit.z - 10.0).abs() < 1e-3, "{hit}");
    }
}

fn planet() -> Terrain {
    Terrain::globe(vec![grid("procedural:planet?size=129")], Ellipsoid::WGS84).unwrap()
}

/// Metres between a hit and the surface there.
fn off_m(terrain: &Terrain, hit: DVec3) -> f64 {
    terrain.surface_at(hit).unwrap().above_m.abs()
}

#[test]
fn a_globe_is_hit_from_space_on_the_side_that_is_seen() {
    let terrain = planet();
    for (lon, lat) in [(20.0, 30.0), (180.0, 0.0), (-45.0, 35.26), (0.0, 90.0)] {
        let eye = terrain.camera([lon, lat, 2e7, 0.0, -90.0], 60.0).eye_m;
        let hit = terrain.pick(eye, -eye, FAR_M).unwrap();
        assert!(off_m(&terrain, hit) < 30.0 && hit.dot(eye) > 0.0, "{hit}");
        let side = eye.normalize().any_orthonormal_vector();
        for angle in [10.0_f64, 40.0, 60.0, 70.0] {
            let (sin, cos) = angle.to_radians().sin_cos();
            let target = (eye.normalize() * cos + side * sin) * 6.37e6;
            let hit = terrain.pick(eye, target - eye, FAR_M).unwrap();
            assert!(off_m(&terrain, hit) < 30.0, "{angle}: {hit}");
            assert!(hit.distance(eye) < target.distance(eye) + 3e5, "{angle}: {hit}");
        }
        // Past the limb, away, and not far enough.
        assert_eq!(terrain.pick(eye, side * 7.6e6 - eye, FAR_M), None);
        assert_eq!(terrain.pick(eye, eye, FAR_M), None);
        assert_eq!(terrain.pick(eye, -eye, 1e7), None);
    }
    // From close by.
    let camera = terrain.camera([20.0, 30.0, 9_000.0, 40.0, -35.0], 60.0);
    let hit = terrain.pick(camera.eye_m, camera.forward(), FAR_M).unwrap();
    assert!(off_m(&terrain, hit) < 0.1 && hit.distance(camera.eye_m) < 5e4, "{hit}");
}

#[test]
fn data_on_the_far_side_of_an_empty_globe_is_met_from_below() {
    let mut dunes = grid("procedural:dunes?width=121&height=100");
    dunes.georeference.degrees =
        Some(Degrees { west: 177.0, south: -2.0, step: [0.05; 2], metres_per_degree: [111_000.0; 2] });
    let terrain = Terrain::globe(vec![dunes], Ellipsoid::WGS84).unwrap();
    let hit = terrain.pick(at(1e7, 1_000.0, 2_000.0), -DVec3::X, FAR_M).unwrap();
    assert!(hit.x < -6.3e6 && off_m(&terrain, hit) < 30.0, "{hit}");
    let hit = terrain.pick(at(-1e7, 1_000.0, 2_000.0), DVec3::X, FAR_M).unwrap();
    assert!(hit.x < -6.3e6 && off_m(&terrain, hit) < 30.0, "{hit}");
    assert_eq!(terrain.pick(at(1e7, 3e6, 2_000.0), -DVec3::X, FAR_M), None);
}

#[test]
fn a_torus_has_a_hole_and_an_inner_side() {
    let dunes = grid("procedural:dunes?width=301&height=200");
    let base = "torus:4000,1200".parse().unwrap();
    let terrain = Terrain::on(&dunes, base, Prefilter::Subsample).unwrap();
    assert_eq!(terrain.pick(at(0.0, 0.0, 5_000.0), -DVec3::Z, FAR_M), None);
    // Heights of 0 to 100 m, and the chords' few metres.
    let over = |met: f64, bare: f64| (bare - 10.0..bare + 130.0).contains(&met);
    let top = terrain.pick(at(4_000.0, 0.0, 5_000.0), -DVec3::Z, FAR_M).unwrap();
    assert!(over(top.z, 1_200.0) && off_m(&terrain, top) < 0.01, "{top}");
    let inner = terrain.pick(DVec3::ZERO, DVec3::X, FAR_M).unwrap();
    assert!(over(-inner.x, -2_800.0) && off_m(&terrain, inner) < 0.01, "{inner}");
    let outer = terrain.pick(at(9_000.0, 100.0, 50.0), -DVec3::X, FAR_M).unwrap();
    assert!(over(outer.x, 5_200.0) && off_m(&terrain, outer) < 0.02, "{outer}");
}

#[test]
fn positions_are_hit_on_top_and_on_their_walls() {
    let terrain = Terrain::sampled(PositionGrid::parse("overhang?size=65").unwrap());
    let top = terrain.pick(at(-3_000.0, 100.0, 5_000.0), -DVec3::Z, FAR_M).unwrap();
    assert!((300.0..800.0).contains(&top.z) && off_m(&terrain, top) < 0.02, "{top}");
    // The cliff stands where 30 / 94 of half the width are left of it.
    let wall = terrain.pick(at(-4_900.0, 0.0, 300.0), DVec3::X, FAR_M).unwrap();
    assert!((wall.x + 3_404.26).abs() < 5.0 && off_m(&terrain, wall) < 0.02, "{wall}");
    assert_eq!(terrain.pick(at(-3_000.0, 9_000.0, 5_000.0), -DVec3::Z, FAR_M), None);
}
