//! The ring torus around the z axis.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Surface;

/// A ring torus around z; u = angle around the axis, v = angle around the tube, both in radians.
///
/// v = 0 is the outer equator and v grows upwards (towards +z) there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torus {
    /// Metres from the axis to the middle of the tube, over `minor_m`.
    pub major_m: f64,
    /// Radius of the tube in metres, positive.
    pub minor_m: f64,
}

impl Surface for Torus {
    fn position(&self, [u, v]: [f64; 2], h: f64) -> DVec3 {
        let ((sin_u, cos_u), (sin_v, cos_v)) = (u.sin_cos(), v.sin_cos());
        let out = self.major_m + (self.minor_m + h) * cos_v;
        DVec3::new(out * cos_u, out * sin_u, (self.minor_m + h) * sin_v)
    }

    fn normal(&self, [u, v]: [f64; 2]) -> DVec3 {
        let ((sin_u, cos_u), (sin_v, cos_v)) = (u.sin_cos(), v.sin_cos());
        DVec3::new(cos_v * cos_u, cos_v * sin_u, sin_v)
    }

    fn tangents(&self, [u, v]: [f64; 2]) -> [DVec3; 2] {
        let ((sin_u, cos_u), (sin_v, cos_v)) = (u.sin_cos(), v.sin_cos());
        [
            (self.major_m + self.minor_m * cos_v) * DVec3::new(-sin_u, cos_u, 0.0),
            self.minor_m * DVec3::new(-sin_v * cos_u, -sin_v * sin_u, cos_v),
        ]
    }

    fn invert(&self, p: DVec3) -> ([f64; 2], f64) {
        let out = p.x.hypot(p.y) - self.major_m;
        ([p.y.atan2(p.x), p.z.atan2(out)], out.hypot(p.z) - self.minor_m)
    }

    fn periods(&self) -> [Option<f64>; 2] {
        [Some(TAU); 2]
    }

    fn least_radius_m(&self) -> f64 {
        // Across the tube it is the tube's; along the inner equator it is the hole's.
        self.minor_m.min(self.major_m - self.minor_m)
    }
}
