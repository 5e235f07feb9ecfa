//! The plane z = 0: the chart is the world.

use glam::DVec3;

use super::Surface;

/// The horizontal plane; u = x, v = y in metres, heights along +z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Plane;

impl Surface for Plane {
    fn position(&self, [u, v]: [f64; 2], h: f64) -> DVec3 {
        DVec3::new(u, v, h)
    }

    fn normal(&self, _uv: [f64; 2]) -> DVec3 {
        DVec3::Z
    }

    fn tangents(&self, _uv: [f64; 2]) -> [DVec3; 2] {
        [DVec3::X, DVec3::Y]
    }

    fn invert(&self, p: DVec3) -> ([f64; 2], f64) {
        ([p.x, p.y], p.z)
    }

    fn periods(&self) -> [Option<f64>; 2] {
        [None; 2]
    }

    fn least_radius_m(&self) -> f64 {
        f64::INFINITY
    }
}
