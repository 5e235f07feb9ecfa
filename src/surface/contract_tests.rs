//! Tests that every surface keeps the contract of the trait, at random places.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use proptest::prelude::*;

use super::{Cylinder, Ellipsoid, Plane, SampledSurface, Surface, Torus};
use crate::heights::PositionGrid;

/// A saddle over a skewed plane. Bilinear patches reproduce it exactly, so it has no creases.
fn saddle() -> SampledSurface {
    let node = |i: usize| {
        let (c, r) = ((i % 40) as f64, (i / 40) as f64);
        [100.0 * c + 10.0 * r, 90.0 * r, 0.4 * (c - 19.0) * (r - 14.0)]
    };
    SampledSurface::new(PositionGrid::new(40, 30, (0..1200).map(node).collect()).unwrap())
}

/// Radius of curvature of the saddle in its middle is about 22 km.
const SADDLE_REACH_M: f64 = 5_000.0;

fn radius() -> impl Strategy<Value = f64> {
    prop_oneof![Just(1.0), Just(6_371_000.0), 1e-3..1e9_f64]
}

/// An angle within half a turn, often a corner case.
fn angle(half: f64) -> impl Strategy<Value = f64> {
    prop_oneof![4 => -half..half, 1 => Just(0.0), 1 => Just(half), 1 => Just(-half), 1 => (half - 1e-7)..half]
}

/// A height over a surface of curvature radius `least`: down to near its centre, up to 1e9 m or more.
fn height(least: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        (-0.9 * least)..least,
        (0.0..1.0_f64).prop_map(move |x| least.max(1.0) * 1e9_f64.powf(x))
    ]
}

/// A surface, its extent in metres, and a chart point and height where the foot point is unique.
fn placed() -> impl Strategy<Value = (Box<dyn Surface>, f64, [f64; 2], f64)> {
    let at = |e: Ellipsoid, size: f64, [u, v]: [f64; 2]| {
        let least = e.least_radius_m();
        (angle(u), angle(v), height(least)).prop_map(move |(u, v, h)| (size, [u, v], h)).boxed()
    };
    let ellipsoid = (radius(), prop_oneof![Just(1.0), 0.1..10.0_f64]).prop_flat_map(move |(a, ratio)| {
        let e = Ellipsoid { a, b: a * ratio };
        at(e, a.max(e.b), [PI, FRAC_PI_2])
            .prop_map(move |(size, uv, h)| (Box::new(e) as Box<dyn Surface>, size, uv, h))
    });
    let named = prop_oneof![Just(Ellipsoid::WGS84), Just(Ellipsoid::MOON), Just(Ellipsoid::MARS)];
    let named = named.prop_flat_map(move |e| {
        at(e, e.a, [PI, FRAC_PI_2])
            .prop_map(move |(size, uv, h)| (Box::new(e) as Box<dyn Surface>, size, uv, h))
    });
    let cylinder = (radius(), any::<bool>()).prop_flat_map(move |(radius_m, inside)| {
        let c = Cylinder { radius_m, inside };
        let low = if inside { -5.0 } else { -0.99 };
        let high = if inside { 0.99 } else { 5.0 };
        (angle(PI), -3.0..3.0_f64, low..high).prop_map(move |(u, v, h)| {
            (Box::new(c) as Box<dyn Surface>, radius_m, [u, v * radius_m], h * radius_m)
        })
    });
    let torus = (radius(), 0.05..0.9_f64).prop_flat_map(move |(major_m, tube)| {
        let t = Torus { major_m, minor_m: major_m * tube };
        let least = t.least_radius_m();
        (angle(PI), angle(PI), (-0.9 * least)..(0.9 * (major_m - t.minor_m)))
            .prop_map(move |(u, v, h)| (Box::new(t) as Box<dyn Surface>, major_m, [u, v], h))
    });
    let plane = (-1e9..1e9_f64, -1e9..1e9_f64, -1e9..1e9_f64)
        .prop_map(|(u, v, h)| (Box::new(Plane) as Box<dyn Surface>, 1e9, [u, v], h));
    let sampled = (2.0..37.0_f64, 2.0..27.0_f64, -SADDLE_REACH_M / 50.0..SADDLE_REACH_M / 50.0)
        .prop_map(|(u, v, h)| (Box::new(saddle()) as Box<dyn Surface>, 4e3, [u, v], h));
    prop_oneof![3 => ellipsoid, 2 => named, 1 => cylinder, 1 => torus, 1 => plane, 1 => sampled]
}

/// Distance of two chart points in metres on the surface, wraps considered.
fn chart_distance(s: &dyn Surface, a: [f64; 2], b: [f64; 2]) -> f64 {
    let lengths = s.tangents(a).map(|t| t.length());
    let periods = s.periods();
    let along = [0, 1].map(|k: usize| {
        let d = a[k] - b[k];
        lengths[k] * periods[k].map_or(d, |p| d - p * (d / p).round())
    });
    along[0].hypot(along[1])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn positions_invert_to_their_chart_points((s, size, uv, h) in placed()) {
        let p = s.position(uv, h);
        let (found, height) = s.invert(p);
        let scale = 1e-12 * size.max(p.length());
        prop_assert!((height - h).abs() <= scale, "{s:?} {uv:?} {h}: height {height}");
        prop_assert!(s.position(found, height).distance(p) <= scale, "{s:?} {uv:?} {h}: {found:?}");
        let off = chart_distance(&*s, uv, found);
        // Below the surface, chart points are crowded, by at most ten here.
        prop_assert!(off <= 1e-11 * size, "{s:?} {uv:?} {h}: {found:?}, {off} m");
    }

    #[test]
    fn frames_are_orthonormal_and_right_handed((s, _, uv, _) in placed()) {
        let [east, north, up] = s.frame(uv);
        for (a, b) in [(east, north), (north, up), (up, east)] {
            prop_assert!(a.dot(b).abs() < 1e-14 && (a.length() - 1.0).abs() < 1e-14);
        }
        prop_assert!(east.cross(north).distance(up) < 1e-14);
        prop_assert!(up.distance(s.normal(uv)) < 1e-14);
        let [u, v] = s.tangents(uv);
        prop_assert!(u.length() < 1e-6 || east.dot(u) > 0.999 * u.length(), "{s:?} {uv:?}");
        prop_assert!(north.dot(v) > 0.9 * v.length(), "{s:?} {uv:?}");
    }

    #[test]
    fn tangents_are_the_derivatives_and_perpendicular_to_the_normal((s, size, uv, _) in placed()) {
        let n = s.normal(uv);
        prop_assert!((n.length() - 1.0).abs() < 1e-14);
        let tangents = s.tangents(uv);
        for (k, t) in tangents.into_iter().enumerate() {
            prop_assert!(t.dot(n).abs() <= 1e-12 * size, "{s:?} {uv:?}");
            // About 1e-5 of the size, in whatever unit; longer where u hardly moves, as near a pole.
            let e = 1e-5 * size / t.length().max(1e-3 * size);
            let (mut low, mut high) = (uv, uv);
            low[k] -= e;
            high[k] += e;
            let difference = (s.position(high, 0.0) - s.position(low, 0.0)) / (high[k] - low[k]);
            // Curvature changes fast at the tips of long ellipsoids.
            prop_assert!(difference.distance(t) <= 1e-6 * size, "{s:?} {uv:?} {difference} {t}");
        }
        let [e, f, g] = s.metric(uv);
        let [u, v] = tangents;
        prop_assert!(e == u.dot(u) && f == u.dot(v) && g == v.dot(v));
    }

    #[test]
    fn normals_lead_back_to_their_foot((s, uv) in (0.1..10.0_f64, angle(PI), angle(FRAC_PI_2))
        .prop_map(|(ratio, u, v)| (Ellipsoid { a: 5.0, b: 5.0 * ratio }, [u, v])))
    {
        let p = s.surface_point_of_normal(3.0 * s.normal(uv));
        prop_assert!(p.distance(s.position(uv, 0.0)) < 1e-13 * s.a.max(s.b));
        let [x, y, z] = [p.x / s.a, p.y / s.a, p.z / s.b];
        prop_assert!((x * x + y * y + z * z - 1.0).abs() < 1e-14);
    }

    /// Also between the centres of curvature, where the foot is one of several.
    #[test]
    fn every_point_in_an_ellipsoid_has_a_finite_nearest_foot(
        ratio in prop_oneof![Just(1.0), 0.1..10.0_f64],
        p in prop_oneof![
            prop::array::uniform3(-1.0..1.0_f64),
            (-1.0..1.0_f64).prop_map(|z| [0.0, 0.0, z]),
            (-1.0..1.0_f64).prop_map(|x| [x, 0.0, 0.0]),
            Just([0.0; 3]), Just([-0.0; 3]), Just([1e-300; 3]),
        ],
    ) {
        let e = Ellipsoid { a: 1.0, b: ratio };
        let p = DVec3::from_array(p) * DVec3::new(1.0, 1.0, ratio);
        let (uv, h) = e.invert(p);
        prop_assert!(e.position(uv, h).distance(p) < 1e-9 * ratio.max(1.0), "{e:?} {p} {uv:?} {h}");
        // No nearer point among many.
        for i in 0..=64 {
            let v = PI * (f64::from(i) / 64.0 - 0.5);
            prop_assert!(e.position([uv[0], v], 0.0).distance(p) > h.abs() - 1e-9, "{e:?} {p} {uv:?} {h}");
        }
    }
}
