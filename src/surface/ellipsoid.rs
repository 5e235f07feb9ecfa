//! The ellipsoid of revolution around the z axis, by geodetic longitude and latitude.
//!
//! The foot point is found as in D. Eberly, "Distance from a Point to an Ellipse, an Ellipsoid, or a
//! Hyperellipsoid": one root of one convex function, which Newton's method reaches from one side for
//! every axis ratio, inside as well as outside. Series around small flattenings would not.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Surface;

/// Newton steps at most; the usual need is under 10, and every step takes a third of what is left
/// at the very least.
const MAX_STEPS: usize = 100;

/// An oblate (`b < a`) or prolate (`b > a`) ellipsoid, or a sphere (`a == b`).
///
/// u = geodetic longitude, v = geodetic latitude, both in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Radius of the equator in metres, positive.
    pub a: f64,
    /// Half the length of the axis in metres, positive.
    pub b: f64,
}

impl Ellipsoid {
    /// The Earth: World Geodetic System 1984.
    pub const WGS84: Self = Self { a: 6_378_137.0, b: 6_378_137.0 * (1.0 - 1.0 / 298.257_223_563) };
    /// The Moon: the IAU sphere.
    pub const MOON: Self = Self { a: 1_737_400.0, b: 1_737_400.0 };
    /// Mars: the IAU ellipsoid.
    pub const MARS: Self = Self { a: 3_396_190.0, b: 3_376_200.0 };

    /// The point of the surface (world metres) whose outward normal is `n`; `n` need not have unit
    /// length, but not length 0.
    #[must_use]
    pub fn surface_point_of_normal(&self, n: DVec3) -> DVec3 {
        let (a2, b2) = (self.a * self.a, self.b * self.b);
        // The textbook form N = a / sqrt(1 - e2 sin2), multiplied out: no eccentricity, so it holds
        // for prolate ones alike and is exact at the poles.
        let scale = (a2 * (n.x * n.x + n.y * n.y) + b2 * n.z * n.z).sqrt();
        DVec3::new(a2 * n.x, a2 * n.y, b2 * n.z) / scale
    }

    /// Direction (any length) in a meridian plane, outwards and along z, of the normal through the
    /// foot point of the point `r >= 0` metres from the axis at `z` metres.
    fn foot_normal(&self, r: f64, z: f64) -> [f64; 2] {
        let oblate = self.a >= self.b;
        // Along the long and the short axis.
        let [long, short] = if oblate { [self.a, self.b] } else { [self.b, self.a] };
        let [x, y] = if oblate { [r, z.abs()] } else { [z.abs(), r] };
        let gap = (long - short) * (long + short);
        // The unknown: the normal is (x / (s + gap), y / s). Both starts lie left of the root.
        let mut s = (short * y).max(long * x - gap);
        let [nx, ny] = if s > 0.0 {
            for _ in 0..MAX_STEPS {
                let (fx, fy) = (long * x / (s + gap), short * y / s);
                let excess = fx * fx + fy * fy - 1.0;
                let slope = 2.0 * (fx * fx / (s + gap) + fy * fy / s);
                let next = s + excess / slope;
                // The function is convex: steps go right until rounding turns one around.
                if next.is_nan() || next <= s {
                    break;
                }
                s = next;
            }
            [x / (s + gap), y / s]
        } else {
            // On the long axis between the centres of curvature: two feet, mirror images.
            let fx = if gap > 0.0 { (long * x / gap).min(1.0) } else { 0.0 };
            [fx / long, (1.0 - fx * fx).sqrt() / short]
        };
        let [out, up] = if oblate { [nx, ny] } else { [ny, nx] };
        [out, up.copysign(z)]
    }
}

impl Surface for Ellipsoid {
    fn position(&self, uv: [f64; 2], h: f64) -> DVec3 {
        let n = self.normal(uv);
        self.surface_point_of_normal(n) + h * n
    }

    fn normal(&self, [u, v]: [f64; 2]) -> DVec3 {
        let ((sin_u, cos_u), (sin_v, cos_v)) = (u.sin_cos(), v.sin_cos());
        DVec3::new(cos_v * cos_u, cos_v * sin_u, sin_v)
    }

    fn tangents(&self, [u, v]: [f64; 2]) -> [DVec3; 2] {
        let ((sin_u, cos_u), (sin_v, cos_v)) = (u.sin_cos(), v.sin_cos());
        let (a2, b2) = (self.a * self.a, self.b * self.b);
        let w2 = a2 * cos_v * cos_v + b2 * sin_v * sin_v;
        let w = w2.sqrt();
        // Radii of curvature across the meridian and along it.
        let (across, along) = (a2 / w, a2 * b2 / (w2 * w));
        [
            across * cos_v * DVec3::new(-sin_u, cos_u, 0.0),
            along * DVec3::new(-sin_v * cos_u, -sin_v * sin_u, cos_v),
        ]
    }

    fn invert(&self, p: DVec3) -> ([f64; 2], f64) {
        let u = p.y.atan2(p.x);
        let [out, up] = self.foot_normal(p.x.hypot(p.y), p.z);
        let v = up.atan2(out);
        let n = self.normal([u, v]);
        ([u, v], (p - self.surface_point_of_normal(n)).dot(n))
    }

    fn frame(&self, uv: [f64; 2]) -> [DVec3; 3] {
        let (sin_u, cos_u) = uv[0].sin_cos();
        let (east, up) = (DVec3::new(-sin_u, cos_u, 0.0), self.normal(uv));
        [east, up.cross(east), up]
    }

    fn periods(&self) -> [Option<f64>; 2] {
        [Some(TAU), None]
    }

    fn least_radius_m(&self) -> f64 {
        (self.a * self.a / self.b).min(self.b * self.b / self.a)
    }
}
