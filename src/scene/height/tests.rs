//! The full-resolution surface against its own samples and triangles, on every base.

use glam::DVec3;

use super::{Spot, Terrain};
use crate::heights::{Degrees, HeightGrid, PositionGrid, ReadOptions, open_terrain};
use crate::pyramid::Prefilter;
use crate::surface::Ellipsoid;

fn grid(spec: &str) -> HeightGrid {
    open_terrain(spec, &ReadOptions::default()).unwrap()
}

fn on(grid: &HeightGrid, base: &str) -> Terrain {
    Terrain::on(grid, base.parse().unwrap(), Prefilter::Subsample).unwrap()
}

/// One cell over the plane: 0 and 1 in the south, 2 and 5 in the north.
fn cell() -> Terrain {
    Terrain::new(&HeightGrid::new(2, 2, vec![0.0, 1.0, 2.0, 5.0]).unwrap(), Prefilter::Subsample)
}

#[test]
fn cells_are_cut_from_south_east_to_north_west() {
    let terrain = cell();
    for (x, y, height) in [
        (0.0, 0.0, 0.0),
        (1.0, 0.0, 1.0),
        (0.0, 1.0, 2.0),
        (1.0, 1.0, 5.0),
        (0.5, 0.5, 1.5),
        (0.25, 0.25, 0.75),
        (0.75, 0.75, 3.25),
    ] {
        let got = terrain.height_at(DVec3::new(x, y, -7.0)).unwrap();
        assert!((got - height).abs() < 1e-12, "{x} {y}: {got}");
    }
}

#[test]
fn a_spot_tells_place_height_and_slope() {
    let spot = cell().surface_at(DVec3::new(0.2, 0.3, 10.0)).unwrap();
    let height = 0.2 + 2.0 * 0.3;
    assert!(spot.point_m.distance(DVec3::new(0.2, 0.3, height)) < 1e-12, "{spot:?}");
    assert!((spot.height_m - height).abs() < 1e-12 && (spot.above_m - (10.0 - height)).abs() < 1e-12);
    // It rises by 1 to the east and by 2 to the north.
    assert!((spot.slope_deg - 5.0_f64.sqrt().atan().to_degrees()).abs() < 1e-9, "{spot:?}");
    assert_eq!((spot.up, spot.level), (DVec3::Z, 0));
}

#[test]
fn nothing_lies_beside_the_data_nor_in_its_holes() {
    let terrain = cell();
    for p in [[-1e-3, 0.5], [0.5, 1.001], [7.0, 7.0], [f64::NAN, 0.5], [0.5, f64::INFINITY]] {
        assert_eq!(terrain.surface_at(DVec3::new(p[0], p[1], 0.0)), None, "{p:?}");
    }
    assert_eq!(terrain.height_at(DVec3::new(0.5, 0.5, f64::NAN)), None);
    let mut heights = vec![1.0; 25];
    heights[12] = f32::NAN;
    let holed = Terrain::new(&HeightGrid::new(5, 5, heights).unwrap(), Prefilter::Subsample);
    // All triangles around the void sample, but not the other halves of their cells.
    for (x, y, there) in [
        (2.0, 2.0, false),
        (1.9, 1.9, false),
        (1.7, 2.1, false),
        (2.4, 2.4, false),
        (2.6, 2.6, true),
        (1.3, 1.3, true),
        (1.4, 2.6, false),
        (0.5, 2.5, true),
    ] {
        assert_eq!(holed.height_at(DVec3::new(x, y, 0.0)).is_some(), there, "{x} {y}");
    }
}

/// Points on the triangles of all cells, some steps apart, asked for from above and below.
fn lies_on_its_triangles(name: &str, terrain: &Terrain, every: usize, away_m: f64) -> Vec<Spot> {
    let curved = terrain.curved.as_ref().unwrap();
    let mut out = Vec::new();
    for chart in 0..curved.graph.charts.len() {
        let last = curved.graph.charts[chart].lattice.last;
        for y in (0..last[1]).step_by(every) {
            for x in (0..last[0]).step_by(every) {
                let corner = |dx: i32, dy: i32| curved.position(chart, 0, [x + dx, y + dy]).unwrap().0;
                let (sw, se, nw, ne) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
                for ([a, b, c], u, v) in [
                    ([sw, se, nw], 0.3, 0.4),
                    ([se, ne, nw], 0.25, 0.7),
                    ([sw, se, nw], 0.5, 0.0),
                    ([se, ne, nw], 0.0, 0.5),
                    ([sw, se, nw], 0.0, 0.0),
                    ([se, ne, nw], 0.5, 0.0),
                ] {
                    let p = a + (b - a) * u + (c - a) * v;
                    let told = format!("{name}: chart {chart}, cell {x} {y}, {u} {v}");
                    let spot = terrain.surface_at(p).unwrap_or_else(|| panic!("{told}"));
                    let most = 1e-9 * p.length().max(1.0) + 1e-7;
                    assert!(spot.above_m.abs() < most && spot.point_m.distance(p) < most, "{told}: {spot:?}");
                    for off in [away_m, -away_m] {
                        let far = terrain.surface_at(p + spot.up * off).unwrap_or_else(|| panic!("{told}"));
                        assert!((far.above_m - off).abs() < most, "{told}: {far:?}");
                        assert!(far.point_m.distance(p) < most, "{told}: {far:?}");
                    }
                    out.push(spot);
                }
            }
        }
    }
    out
}

#[test]
fn on_a_whole_globe() {
    let terrain = Terrain::globe(vec![grid("procedural:planet?size=65")], Ellipsoid::WGS84).unwrap();
    let spots = lies_on_its_triangles("globe", &terrain, 7, 3_000.0);
    assert!(spots.iter().any(|s| s.height_m < -3_000.0) && spots.iter().any(|s| s.height_m > 500.0));
    // Chords of cells of three degrees alone are tilted by as much.
    assert!(spots.iter().all(|s| s.slope_deg < 10.0 && s.level == 0));
}

#[test]
fn on_a_patch_of_the_globe_on_rings_and_on_both_sides_of_a_cylinder() {
    let dunes = grid("procedural:dunes?width=121&height=100");
    let mut placed = dunes.clone();
    placed.georeference.degrees = Some(Degrees {
        west: 179.0,
        south: 60.0,
        step: [0.05, 0.02],
        metres_per_degree: [55_000.0, 111_000.0],
    });
    let bases = ["sphere:9000", "torus:4000,1200", "cylinder:4000", "cylinder:4000,inside"];
    for base in bases {
        lies_on_its_triangles(base, &on(&dunes, base), 3, 200.0);
    }
    lies_on_its_triangles("wgs84", &on(&placed, "wgs84"), 3, 200.0);
}

#[test]
fn beside_a_patch_of_the_globe_there_is_nothing() {
    let mut dunes = grid("procedural:dunes?width=121&height=100");
    dunes.georeference.degrees =
        Some(Degrees { west: 10.0, south: 40.0, step: [0.01; 2], metres_per_degree: [85_000.0, 111_000.0] });
    let terrain = on(&dunes, "wgs84");
    let at = |lon, lat| terrain.surface_at(terrain.camera([lon, lat, 500.0, 0.0, 0.0], 60.0).eye_m);
    assert!(at(10.6, 40.5).is_some() && at(10.0001, 40.9899).is_some());
    for (lon, lat) in
        [(9.99, 40.5), (11.3, 40.5), (10.6, 39.9), (10.6, 41.1), (-170.0, -40.5), (190.5, -40.2)]
    {
        assert_eq!(at(lon, lat), None, "{lon} {lat}");
    }
}

#[test]
fn on_positions_heights_are_those_of_the_world_and_overhangs_are_steeper_than_walls() {
    let positions = PositionGrid::parse("overhang?size=65").unwrap();
    let terrain = Terrain::sampled(positions.clone());
    let mut overhanging = 0;
    for (k, p) in positions.xyz_m.iter().enumerate().step_by(7) {
        let spot = terrain.surface_at(DVec3::from_array(*p)).unwrap();
        assert!(spot.above_m.abs() < 1e-6 && (spot.height_m - p[2]).abs() < 1e-6, "{k}: {spot:?}");
        overhanging += i32::from(spot.slope_deg > 95.0);
    }
    assert!(overhanging > 2, "{overhanging}");
    // Over the top of the sheet, and over its border and 500 m beside it.
    let top = terrain.surface_at(DVec3::new(-3_000.0, 100.0, 5_000.0)).unwrap();
    assert!(top.above_m > 3_000.0 && top.up.z > 0.5, "{top:?}");
    for beside in [[-5_500.0, 0.0], [0.0, 5_500.0], [6_000.0, -6_000.0]] {
        assert_eq!(terrain.surface_at(DVec3::new(beside[0], beside[1], 300.0)), None, "{beside:?}");
    }
}

#[test]
fn a_fold_gives_one_of_its_sheets_and_cells_without_area_give_their_height() {
    let positions = PositionGrid::parse("fold?size=65").unwrap();
    let terrain = Terrain::sampled(positions.clone());
    for p in positions.xyz_m.iter().step_by(5) {
        let spot = terrain.surface_at(DVec3::from_array(*p)).unwrap();
        assert!(spot.above_m.abs() < 1e-6, "{p:?}: {spot:?}");
    }
}
