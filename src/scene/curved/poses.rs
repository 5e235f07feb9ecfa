//! Poses on a curved base surface: their numbers as cameras and places, and back.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::Curved;
use crate::camera::Camera;
use crate::pyramid::SampleSource as _;
use crate::surface::{Ellipsoid, Surface};

/// How the numbers of a pose are meant.
#[derive(Clone, Debug)]
pub(super) enum Poses {
    /// Degrees of longitude and latitude, metres above the ellipsoid.
    Geodetic(Ellipsoid),
    /// The DEM's own coordinates, metres above the base surface.
    Chart {
        surface: Arc<dyn Surface>,
        native: [[f64; 2]; 2],
        uv: [[f64; 2]; 2],
        cells: [f64; 2],
        degrees: bool,
    },
    /// World metres.
    World,
}

impl Curved {
    /// Camera of a pose `x, y, z, yaw, pitch` in the terrain's own units: longitude, latitude and height
    /// on a globe, the DEM's coordinates and the height above the base elsewhere, world metres where
    /// positions are the data.
    #[must_use]
    pub fn camera(&self, [x, y, z, yaw_deg, pitch_deg]: [f64; 5], fov_deg: f64) -> Camera {
        let (eye_m, axes) = match &self.poses {
            Poses::World => (DVec3::new(x, y, z), DMat3::IDENTITY),
            Poses::Geodetic(e) => place(e, [x.to_radians(), y.to_radians()], z),
            Poses::Chart { surface, native, uv, .. } => {
                let at = |a: usize, v: f64| uv[0][a] + (v - native[0][a]) / native[1][a] * uv[1][a];
                place(surface.as_ref(), [at(0, x), at(1, y)], z)
            }
        };
        Camera { eye_m, yaw_deg, pitch_deg, fov_deg, axes }
    }

    /// True when the first two numbers of a pose are longitude and latitude, degrees.
    #[must_use]
    pub fn poses_in_degrees(&self) -> bool {
        match &self.poses {
            Poses::World => false,
            Poses::Geodetic(_) => true,
            Poses::Chart { degrees, .. } => *degrees,
        }
    }

    /// A world point in the units of poses, and the axes that yaw and pitch are measured in there: the inverse
    /// of [`Curved::camera`]. Where the surface closes on itself, the turn nearest to the data's middle.
    #[must_use]
    pub fn place_of(&self, p: DVec3) -> ([f64; 3], DMat3) {
        match &self.poses {
            Poses::World => (p.to_array(), DMat3::IDENTITY),
            Poses::Geodetic(e) => {
                let (at, h) = e.invert(p);
                ([at[0].to_degrees(), at[1].to_degrees(), h], place(e, at, h).1)
            }
            Poses::Chart { surface, native, uv, cells, .. } => {
                let (found, h) = surface.invert(p);
                let periods = surface.periods();
                let at = [0, 1].map(|a: usize| {
                    let middle = uv[0][a] + 0.5 * cells[a] * uv[1][a];
                    let turn = |period: f64| ((found[a] - middle) / period).round() * period;
                    found[a] - periods[a].map_or(0.0, turn)
                });
                let [x, y] =
                    [0, 1].map(|a: usize| native[0][a] + (at[a] - uv[0][a]) / uv[1][a] * native[1][a]);
                ([x, y, h], place(surface.as_ref(), at, h).1)
            }
        }
    }

    /// The point a share `u`, `v` of the way across the data, in the units of poses: on a globe within 60
    /// degrees of longitude 0 and 50 of the equator.
    #[must_use]
    pub fn native_at(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        match &self.poses {
            Poses::Geodetic(_) => [120.0 * u - 60.0, 100.0 * v - 50.0],
            Poses::Chart { native, cells, .. } => {
                [0, 1].map(|a| native[0][a] + native[1][a] * cells[a] * [u, v][a])
            }
            Poses::World => {
                let last = self.graph.charts[0].lattice.last;
                let (p, _) = self.surface.base(0, [0, 1].map(|a| f64::from(last[a]) * [u, v][a]));
                [p.x, p.y]
            }
        }
    }

    /// Height of the ground under a point in the units of poses, metres above the base surface; 0 over a
    /// void. Where positions are the data, the highest z near that x and y.
    #[must_use]
    pub fn native_ground_m(&self, [x, y]: [f64; 2]) -> f64 {
        let Some(points) = &self.points else {
            let eye = self.camera([x, y, 0.0, 0.0, 0.0], 60.0).eye_m;
            return self.ground(eye).1.map_or(0.0, f64::from);
        };
        let top = points.height_range().map_or(0.0, |r| f64::from(r[1]));
        let foot = self.surface.foot(DVec3::new(x, y, top));
        self.surface.base(0, foot.at).0.z
    }

    /// What is wrong with a pose's place, when it is no place of this surface.
    #[must_use]
    pub fn bad_place(&self, [x, y]: [f64; 2]) -> Option<String> {
        let Poses::Geodetic(_) = self.poses else { return None };
        if y.abs() > 90.0 {
            return Some(format!("latitude {y} is not between -90 and 90 degrees"));
        }
        (x.abs() > 540.0).then(|| format!("longitude {x} is not between -540 and 540 degrees"))
    }
}

fn place(surface: &dyn Surface, uv: [f64; 2], h: f64) -> (DVec3, DMat3) {
    let [east, north, up] = surface.frame(uv);
    (surface.position(uv, h), DMat3::from_cols(east, north, up))
}
