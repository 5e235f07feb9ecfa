//! The cylinder around the z axis, stood on from outside or from inside.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Surface;

/// A cylinder around z; u = angle in radians, v = z in metres.
///
/// Seen from the side heights grow to, u runs to the right when +z is up: outside, u turns
/// counter-clockwise around +z (y = sin u); inside, clockwise (y = -sin u). So (east, +z, up) is
/// right-handed in both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Radius in metres, positive.
    pub radius_m: f64,
    /// True when heights grow towards the axis.
    pub inside: bool,
}

impl Cylinder {
    /// +1 outside, -1 inside.
    fn side(self) -> f64 {
        if self.inside { -1.0 } else { 1.0 }
    }

    /// Unit direction away from the axis.
    fn radial(self, u: f64) -> DVec3 {
        let (sin, cos) = u.sin_cos();
        DVec3::new(cos, self.side() * sin, 0.0)
    }
}

impl Surface for Cylinder {
    fn position(&self, [u, v]: [f64; 2], h: f64) -> DVec3 {
        (self.radius_m + self.side() * h) * self.radial(u) + v * DVec3::Z
    }

    fn normal(&self, [u, _]: [f64; 2]) -> DVec3 {
        self.side() * self.radial(u)
    }

    fn tangents(&self, [u, _]: [f64; 2]) -> [DVec3; 2] {
        let (sin, cos) = u.sin_cos();
        [self.radius_m * DVec3::new(-sin, self.side() * cos, 0.0), DVec3::Z]
    }

    fn invert(&self, p: DVec3) -> ([f64; 2], f64) {
        let u = (self.side() * p.y).atan2(p.x);
        ([u, p.z], self.side() * (p.x.hypot(p.y) - self.radius_m))
    }

    fn periods(&self) -> [Option<f64>; 2] {
        [Some(TAU), None]
    }

    fn least_radius_m(&self) -> f64 {
        self.radius_m
    }
}
