//! The globe on made-up grids; real ones are read by the integration tests.

use glam::DVec3;

use super::{Globe, GlobeError, degrees};
use crate::heights::{Degrees, HeightGrid, Planet};
use crate::pyramid::VOID;

/// A geographic grid: first sample, step in degrees, samples, and heights by longitude and latitude.
pub(super) fn grid(
    [west, south]: [f64; 2],
    step: f64,
    [width, height]: [usize; 2],
    at: impl Fn(f64, f64) -> f32,
) -> HeightGrid {
    let place = |i: usize| [west + step * (i % width) as f64, south + step * (i / width) as f64];
    let heights = (0..width * height).map(|i| at(place(i)[0], place(i)[1])).collect();
    let mut grid = HeightGrid::new(width, height, heights).unwrap();
    let metres_per_degree = [111_000.0; 2];
    grid.georeference.degrees = Some(Degrees { west, south, step: [step; 2], metres_per_degree });
    grid
}

fn normal(lon: f64, lat: f64) -> DVec3 {
    let (sin, cos) = lat.to_radians().sin_cos();
    let (east, prime) = lon.to_radians().sin_cos();
    DVec3::new(cos * prime, cos * east, sin)
}

fn close(a: f32, b: f64, tolerance: f64) {
    assert!((f64::from(a) - b).abs() <= tolerance, "{a} is not {b}");
}

fn global(step: f64, height: f32) -> HeightGrid {
    let rows = (180.0 / step) as usize;
    grid([-180.0, -90.0], step, [2 * rows, rows + 1], move |_, _| height)
}

/// A smooth field without a seam anywhere, metres.
pub(super) fn smooth(lon: f64, lat: f64) -> f32 {
    let n = normal(lon, lat);
    (1_000.0 * n.x + 500.0 * n.y * n.z - 300.0 * n.z) as f32
}

#[test]
fn unusable_grids_are_refused() {
    assert_eq!(Globe::new(vec![], 8.0).unwrap_err(), GlobeError::NoGrid);
    let plane = HeightGrid::new(2, 2, vec![0.0; 4]).unwrap();
    let error = Globe::new(vec![global(10.0, 0.0), plane], 8.0).unwrap_err();
    assert_eq!(error, GlobeError::NotGeographic { index: 1 });
    let low = Globe::new(vec![grid([0.0, -90.6], 1.0, [4, 4], |_, _| 0.0)], 8.0).unwrap_err();
    assert!(matches!(low, GlobeError::Latitude { index: 0, .. }), "{low}");
    let high = Globe::new(vec![grid([0.0, 80.0], 1.0, [4, 12], |_, _| 0.0)], 8.0).unwrap_err();
    assert!(matches!(high, GlobeError::Latitude { north: 91.0, .. }), "{high}");
    let wide = Globe::new(vec![grid([0.0, 0.0], 1.0, [362, 4], |_, _| 0.0)], 8.0).unwrap_err();
    assert_eq!(wide, GlobeError::Longitude { index: 0, degrees: 361.0 });
    for (west, step) in [(f64::NAN, 1.0), (0.0, 0.0), (0.0, f64::NAN), (0.0, f64::INFINITY)] {
        let mut bad = global(10.0, 0.0);
        bad.georeference.degrees =
            Some(Degrees { west, south: 0.0, step: [step; 2], metres_per_degree: [1.0; 2] });
        assert!(matches!(Globe::new(vec![bad], 8.0), Err(GlobeError::Broken { index: 0, .. })));
    }
    let mut short = global(10.0, 0.0);
    short.heights_m.pop();
    assert!(matches!(Globe::new(vec![short], 8.0), Err(GlobeError::Broken { .. })));
    // Half a cell over the pole is what a grid of pixels moved to its corners has.
    assert!(Globe::new(vec![grid([0.0, 80.5], 1.0, [4, 11], |_, _| 0.0)], 8.0).is_ok());
}

#[test]
fn every_layout_of_a_whole_globe_is_closed() {
    let layouts = [
        ([-180.0, -90.0], [360, 181]),
        ([-180.0, -90.0], [361, 181]),
        ([0.0, -90.0], [360, 181]),
        ([-179.5, -89.5], [360, 180]),
        ([-180.5, -90.5], [361, 182]),
        ([-180.0, -89.0], [360, 179]),
    ];
    for (origin, size) in layouts {
        let globe = Globe::new(vec![grid(origin, 1.0, size, smooth)], 8.0).unwrap();
        assert!(!globe.has_voids());
        for lat in [-90.0, -89.9, -89.2, -45.3, 0.0, 33.3, 89.7, 90.0] {
            for k in -720..=720 {
                let lon = f64::from(k) * 0.5;
                close(globe.height(normal(lon, lat)), f64::from(smooth(lon, lat)), 12.0);
            }
        }
        // From every side, the pole and the date line are approached without a jump.
        for pole in [-90.0, 90.0] {
            let top = globe.height(DVec3::Z * f64::signum(pole));
            for k in 0..360 {
                close(globe.height(normal(f64::from(k), pole * (1.0 - 1e-10))), f64::from(top), 1e-3);
            }
        }
        for k in -90..=90 {
            let lat = f64::from(k);
            let east = globe.height(normal(-180.0 + 1e-9, lat));
            close(globe.height(normal(180.0 - 1e-9, lat)), f64::from(east), 1e-3);
            close(globe.height(normal(180.0, lat)), f64::from(east), 1e-3);
        }
    }
}

#[test]
fn a_pole_has_one_height() {
    // A row at the pole that contradicts itself, and rows half a cell off it.
    for (origin, size) in [([-180.0, -90.0], [36, 19]), ([-175.0, -85.0], [36, 18])] {
        let globe = Globe::new(vec![grid(origin, 10.0, size, |lon, _| lon as f32)], 0.0).unwrap();
        let mean = if size[1] == 19 { -5.0 } else { 0.0 };
        for z in [1.0, -1.0] {
            for [x, y] in [[0.0, 0.0], [-0.0, 0.0], [0.0, -0.0], [-0.0, -0.0]] {
                close(globe.height(DVec3::new(x, y, z)), mean, 0.0);
            }
            for k in 0..36 {
                close(globe.height(normal(f64::from(k) * 10.0, z * (90.0 - 1e-9))), mean, 1e-6);
            }
        }
    }
}

#[test]
fn tiles_work_across_the_date_line() {
    for west in [179.0, -181.0] {
        let tile = grid([west, 10.0], 0.125, [17, 17], |lon, _| (lon - west) as f32);
        let globe = Globe::new(vec![tile], 8.0).unwrap();
        assert!(globe.has_voids());
        for k in 0..=16 {
            let lon = west + 0.125 * f64::from(k);
            close(globe.height(normal(lon, 11.0)), 0.125 * f64::from(k), 1e-6);
        }
        assert_eq!(globe.height(normal(178.99, 11.0)), VOID);
        assert_eq!(globe.height(normal(-178.99, 11.0)), VOID);
        assert_eq!(globe.height(normal(180.0, 9.99)), VOID);
        assert!(globe.finer_than(1.0, normal(-178.0, 11.0), 0.02));
        assert!(!globe.finer_than(1.0, normal(-178.0, 11.0), 0.01));
        assert!(!globe.finer_than(0.125, normal(180.0, 11.0), 0.1));
        assert!(!globe.finer_than(1.0, normal(0.0, 11.0), 0.1));
        assert!(globe.finer_than(1.0, normal(0.0, 85.0), 1.4), "over the pole");
    }
    let globe = Globe::new(vec![global(10.0, 0.0)], 8.0).unwrap();
    assert!(!globe.height(DVec3::NAN).is_nan());
    assert_eq!(globe.height(DVec3::NAN), VOID);
    assert_eq!(globe.height(DVec3::new(1.0, f64::INFINITY, 0.0)), VOID);
}

#[test]
fn borders_and_voids_are_blended_away() {
    let step = 0.0625;
    let (size, cells) = ([129, 129], 16.0);
    let tile = |void: bool| {
        let mut tile = grid([4.0, 4.0], step, size, |_, _| 1_000.0);
        if void {
            let mut valid = vec![true; 129 * 129];
            valid[60 * 129 + 64] = false;
            tile.valid = Some(valid);
        }
        tile
    };
    for void in [false, true] {
        let globe = Globe::new(vec![global(10.0, 0.0), tile(void)], cells).unwrap();
        let mut previous = globe.height(normal(3.0, 7.77));
        let mut extremes = [0.0_f32; 2];
        for k in 0..=10_000 {
            let lon = 3.0 + f64::from(k) * 1e-3;
            let h = globe.height(normal(lon, 7.77));
            // Steepest where the smoothstep is: 1.5 of its height over its width.
            assert!((h - previous).abs() <= (1_000.0 * 1.5 * 1e-3 / (cells * step)) as f32 * 1.01, "{lon}");
            extremes = [extremes[0].min(h), extremes[1].max(h)];
            previous = h;
        }
        assert_eq!(extremes, [0.0, 1_000.0]);
        let centre = globe.height(normal(4.0 + 64.0 * step + 0.01, 4.0 + 60.0 * step + 0.01));
        assert_eq!(centre, if void { 0.0 } else { 1_000.0 });
        // Alone, the tile keeps its value to its very border.
        let alone = Globe::new(vec![tile(void)], cells).unwrap();
        for lon in [4.0, 4.001, 12.0] {
            assert_eq!(alone.height(normal(lon, 5.0)), 1_000.0);
        }
        let centre = alone.height(normal(4.0 + 64.0 * step + 0.01, 4.0 + 60.0 * step + 0.01));
        assert_eq!(centre, if void { VOID } else { 1_000.0 });
    }
}

#[test]
fn tiles_side_by_side_meet_without_a_trench() {
    let tile = |x: f64, y: f64| grid([x, y], 0.0625, [17, 17], |_, _| 1_000.0);
    // An L, so that its inner corner has to be eased out on three sides.
    let tiles = vec![global(10.0, 0.0), tile(4.0, 4.0), tile(5.0, 4.0), tile(4.0, 5.0)];
    let globe = Globe::new(tiles, 4.0).unwrap();
    assert_eq!(globe.height(normal(5.0, 4.5)), 1_000.0);
    assert_eq!(globe.height(normal(4.5, 5.0)), 1_000.0);
    close(globe.height(normal(5.0, 5.0)), 0.0, 1e-9);
    let at = |x: i32, y: i32| globe.height(normal(3.9 + f64::from(x) * 0.01, 3.9 + f64::from(y) * 0.01));
    for y in 0..220 {
        for x in 0..220 {
            assert!((at(x + 1, y) - at(x, y)).abs() < 70.0, "{x} {y}");
            assert!((at(x, y + 1) - at(x, y)).abs() < 70.0, "{x} {y}");
        }
    }
}

#[test]
fn sizes_follow_the_finest_grid() {
    let size = |step: f64| Globe::new(vec![grid([0.0, 0.0], step, [3, 3], smooth)], 0.0).unwrap().size();
    assert_eq!(size(1.0 / 12.0), 2_048);
    assert_eq!(size(90.0 / 1_024.0), 1_024);
    assert_eq!(size(1.0 / 3_600.0), 1 << 19);
    assert_eq!(size(10.0), 64);
    assert_eq!(size(1e-9), 1 << 21);
}

#[test]
fn whole_metres_travel_in_halves() {
    let make = |dtype, at: fn(f64, f64) -> f32| {
        let mut grid = grid([-180.0, -90.0], 10.0, [36, 19], at);
        grid.dtype = dtype;
        Globe::new(vec![grid], 0.0).unwrap()
    };
    let globe = make("int16", |lon, lat| smooth(lon, lat).round());
    assert_eq!(globe.step_m(), Some(0.5));
    for k in 0..1_000 {
        let h = globe.height(normal(f64::from(k) * 7.3, f64::from(k % 179) - 89.0));
        assert_eq!((h * 2.0).fract(), 0.0);
        assert!(h != 0.0 || h.is_sign_positive());
    }
    assert_eq!(make("float32", |_, _| 1.0).step_m(), None);
    assert_eq!(make("int16", |_, _| 0.25).step_m(), None);
    assert_eq!(make("uint16", |lon, _| if lon == 0.0 { 16_383.0 } else { 0.0 }).step_m(), None);
    assert_eq!(make("byte", |_, _| 16_382.0).height_range(), Some([16_382.0; 2]));
}

#[test]
fn longitudes_and_latitudes_come_back() {
    for lat in [-90.0, -89.999_999, -30.0, 0.0, 60.0, 90.0] {
        for lon in [-179.0, -90.0, 0.0, 45.0, 180.0] {
            let [x, y] = degrees(normal(lon, lat)).unwrap();
            assert!((y - lat).abs() < 1e-13, "{lat} {y}");
            assert!((x - lon).abs() < 1e-7 || lat.abs() == 90.0, "{lon} {x}");
        }
    }
}

#[test]
fn the_smallest_planets_are_whole() {
    for size in 2..=4 {
        let planet = Planet { size, ..Planet::default() }.to_grid().unwrap();
        let [low, high] = planet.min_max_mean().map(|(low, high, _)| [low, high]).unwrap();
        let globe = Globe::new(vec![planet], 8.0).unwrap();
        assert!(!globe.has_voids());
        for k in 0..10_000 {
            let h = globe.height(normal(f64::from(k) * 1.7, f64::from(k % 1_801) * 0.1 - 90.0));
            assert!((low..=high).contains(&h), "{size} {k} {h}");
        }
    }
}

#[test]
fn a_cap_that_sees_a_tile_says_so() {
    for (west, south) in [(170.0, 60.0), (-10.0, -5.0), (30.0, -90.0), (100.0, 80.0)] {
        let globe = Globe::new(vec![grid([west, south], 1.0, [21, 11], smooth)], 0.0).unwrap();
        let tile: Vec<DVec3> = (0..21 * 11)
            .map(|k| normal(west + f64::from(k % 21), (south + f64::from(k / 21)).clamp(-90.0, 90.0)))
            .collect();
        let mut missed = 0;
        for k in 0..2_000 {
            let centre = normal(f64::from(k) * 137.5, f64::from(k % 181) - 90.0);
            let radius = 0.02 + f64::from(k % 23) * 0.09;
            let seen = tile.iter().any(|p| p.angle_between(centre) <= radius);
            assert!(!seen || globe.finer_than(2.0, centre, radius), "{west} {south} {k}");
            missed += u32::from(!globe.finer_than(2.0, centre, radius));
        }
        assert!(missed > 200, "it says yes to everything");
    }
}
