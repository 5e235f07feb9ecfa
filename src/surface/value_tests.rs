//! Tests of each surface against known values, and of the awkward places.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use super::{Cylinder, Ellipsoid, Plane, SampledSurface, Surface, Torus};
use crate::heights::{PositionGrid, PositionKind};

fn degrees(d: f64, m: f64, s: f64) -> f64 {
    (d + m / 60.0 + s / 3600.0).to_radians()
}

#[test]
fn geodetic_coordinates_match_published_values() {
    let wgs84 = Ellipsoid::WGS84;
    // Airy 1830, as used by the Ordnance Survey.
    let airy = Ellipsoid { a: 6_377_563.396, b: 6_356_256.909 };
    // Ellipsoid, latitude, longitude, height; x, y, z; tolerance of the printed digits.
    let published = [
        // By definition: a, and b as listed in NIMA TR8350.2.
        (wgs84, 0.0, 0.0, 0.0, [6_378_137.0, 0.0, 0.0], 1e-9),
        (wgs84, 0.0, FRAC_PI_2, 0.0, [0.0, 6_378_137.0, 0.0], 1e-9),
        (wgs84, FRAC_PI_2, 0.0, 0.0, [0.0, 0.0, 6_356_752.314_2], 1e-4),
        (wgs84, -FRAC_PI_2, 1.0, 100.0, [0.0, 0.0, -6_356_852.314_2], 1e-4),
        // EPSG Guidance Note 7-2, geographic/geocentric conversions.
        (
            wgs84,
            degrees(53.0, 48.0, 33.820),
            degrees(2.0, 7.0, 46.380),
            73.0,
            [3_771_793.968, 140_253.342, 5_124_304.349],
            0.02,
        ),
        // GeographicLib, manual of CartConvert, forward and (near the centre) reverse.
        (
            wgs84,
            degrees(33.3, 0.0, 0.0),
            degrees(44.4, 0.0, 0.0),
            6_000.0,
            [3_816_209.60, 3_737_108.55, 3_485_109.57],
            0.01,
        ),
        // Ordnance Survey, A Guide to Coordinate Systems in Great Britain, annex B.
        (
            airy,
            degrees(52.0, 39.0, 27.2531),
            degrees(1.0, 43.0, 4.5177),
            24.7,
            [3_874_938.849, 116_218.624, 5_047_168.208],
            0.002,
        ),
    ];
    for (e, latitude, longitude, h, xyz, tolerance) in published {
        let expected = DVec3::from_array(xyz);
        let p = e.position([longitude, latitude], h);
        assert!(p.distance(expected) < tolerance, "{p} for {expected}");
        let ([u, v], height) = e.invert(expected);
        assert!((v - latitude).abs() * e.a < tolerance && (height - h).abs() < tolerance);
        assert!((u - longitude).abs() * e.a < tolerance || latitude.abs() == FRAC_PI_2);
    }
    let ([u, v], h) = wgs84.invert(DVec3::new(30_000.0, 30_000.0, 0.0));
    assert!((v.to_degrees() - 6.483).abs() < 1e-3 && (u.to_degrees() - 45.0).abs() < 1e-12, "{v}");
    assert!((h + 6_335_709.73).abs() < 0.01, "{h}");
}

#[test]
fn frames_at_the_poles_follow_the_meridian() {
    for u in [0.0, 1.0, -2.5] {
        let [east, north, up] = Ellipsoid::WGS84.frame([u, FRAC_PI_2]);
        assert!(up.distance(DVec3::Z) < 1e-15);
        assert!(east.distance(DVec3::new(-u.sin(), u.cos(), 0.0)) < 1e-15);
        assert!(north.distance(DVec3::new(-u.cos(), -u.sin(), 0.0)) < 1e-15);
    }
}

#[test]
fn least_radii_bound_the_bending_and_are_reached() {
    let torus = |major_m, minor_m| Box::new(Torus { major_m, minor_m }) as Box<dyn Surface>;
    let ellipsoid = |a, b| Box::new(Ellipsoid { a, b }) as Box<dyn Surface>;
    let cylinder = Box::new(Cylinder { radius_m: 4.0, inside: true }) as Box<dyn Surface>;
    for s in [
        torus(3.0, 1.0),
        torus(3.0, 2.0),
        ellipsoid(1.0, 1.0),
        ellipsoid(2.0, 1.0),
        ellipsoid(1.0, 2.0),
        cylinder,
    ] {
        let mut least = f64::INFINITY;
        for i in 0..=400 {
            // All are symmetric in u, and bent most along u or v.
            let uv = [0.3, TAU * (f64::from(i) / 400.0 - 0.5)];
            let e = 1e-6;
            for d in [[e, 0.0], [0.0, e]] {
                let to = [uv[0] + d[0], uv[1] + d[1]];
                let moved = s.position(to, 0.0).distance(s.position(uv, 0.0));
                let turned = s.normal(to).distance(s.normal(uv));
                if moved > 1e-8 && turned > 1e-8 {
                    least = least.min(moved / turned);
                }
            }
        }
        let claimed = s.least_radius_m();
        assert!((least / claimed - 1.0).abs() < 1e-3, "{s:?}: {least} for {claimed}");
    }
    assert_eq!(Plane.least_radius_m(), f64::INFINITY);
}

#[test]
fn the_cylinder_runs_to_the_right_on_both_sides() {
    for inside in [false, true] {
        let c = Cylinder { radius_m: 10.0, inside };
        let [_, north, up] = c.frame([1.0, 5.0]);
        assert_eq!(north.round(), DVec3::Z);
        let axis = -c.position([1.0, 0.0], 0.0);
        assert_eq!(up.dot(axis) > 0.0, inside);
        let ([u, v], h) = c.invert(DVec3::new(0.0, 0.0, 7.0));
        assert!(u.is_finite() && v == 7.0 && h.abs() == 10.0);
    }
}

#[test]
fn sampled_positions_are_found_again_on_overhangs_and_folds() {
    for kind in PositionKind::ALL {
        let s = SampledSurface::new(PositionGrid::procedural(kind, 65).unwrap());
        assert!(s.least_radius_m() > 0.0);
        let mut downward = 0;
        for i in 0..500 {
            let uv = [f64::from(i * 37 % 640) / 10.0, f64::from(i * 91 % 640) / 10.0];
            let p = s.position(uv, 0.0);
            let (found, h) = s.invert(p);
            assert!(s.position(found, h).distance(p) < 1e-5, "{kind:?} {uv:?} {found:?} {h}");
            let n = s.normal(uv);
            downward += i32::from(n.z < 0.0);
            assert!((n.length() - 1.0).abs() < 1e-12, "{kind:?} {uv:?} {n}");
            assert!(s.frame(uv).iter().all(|a| (a.length() - 1.0).abs() < 1e-12), "{kind:?} {uv:?}");
        }
        assert!(downward > 10, "{kind:?} {downward}");
    }
}

#[test]
fn the_nearest_point_of_a_grid_beats_a_dense_search() {
    let s = SampledSurface::new(PositionGrid::procedural(PositionKind::Overhang, 49).unwrap());
    for i in 0..40 {
        let f = f64::from(i);
        let p = DVec3::new((f * 1.7).sin() * 6e3, (f * 2.3).cos() * 6e3, (f * 0.9).sin() * 2e3);
        let (uv, _) = s.invert(p);
        let found = s.position(uv, 0.0).distance(p);
        let dense = (0..480 * 480).map(|k| {
            let at = [f64::from(k % 480) / 10.0, f64::from(k / 480) / 10.0];
            s.position(at, 0.0).distance(p)
        });
        let naive = dense.fold(f64::INFINITY, f64::min);
        assert!(found <= naive + 1e-9, "{p}: {found} against {naive}");
    }
}

#[test]
fn degenerate_grids_stay_finite() {
    let grid = |xyz: Vec<[f64; 3]>| SampledSurface::new(PositionGrid::new(3, 3, xyz).unwrap());
    let mut holed = vec![[5.0, 5.0, 5.0]; 9];
    holed[4] = [f64::NAN; 3];
    for s in [grid(vec![[1.0; 3]; 9]), grid(vec![[f64::NAN; 3]; 9]), grid(holed.clone())] {
        for uv in [[0.0, 0.0], [1.0, 1.0], [9.0, -4.0], [0.3, f64::NAN], [f64::INFINITY, 1.5]] {
            assert_eq!(s.normal(uv), DVec3::Z);
            assert!(s.position(uv, 2.0).is_finite());
            assert!(s.frame(uv).iter().all(|a| a.is_finite()));
        }
        let (uv, h) = s.invert(DVec3::new(1.0, 2.0, 8.0));
        assert!(uv.iter().all(|c| c.is_finite()) && h.is_finite());
        s.invert(DVec3::NAN);
    }
    let s = grid(holed);
    assert_eq!(s.grid().xyz_m[4], [5.0; 3]);
    assert_eq!(s.grid().void_count(), 1);
}
