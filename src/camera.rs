//! The camera: f64 pose in the world, and what the GPU gets of it.

use glam::{DMat3, DMat4, DVec3, DVec4};

/// A perspective camera. World axes: on a plane x east, y north, z up; on a globe Earth-centred and
/// Earth-fixed; metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Eye in world metres.
    pub eye_m: DVec3,
    /// Heading in degrees, clockwise from north.
    pub yaw_deg: f64,
    /// Elevation of the view direction in degrees, up from the horizon.
    pub pitch_deg: f64,
    /// Vertical field of view in degrees, from [`Camera::LEAST_FOV_DEG`] to 180, which is excluded.
    pub fov_deg: f64,
    /// What yaw and pitch are measured in: unit east, north and up in the world's axes, as columns.
    /// [`crate::Terrain::camera`] gives those of the place; the identity on a plane.
    pub axes: DMat3,
}

impl Default for Camera {
    fn default() -> Self {
        Self { eye_m: DVec3::ZERO, yaw_deg: 0.0, pitch_deg: 0.0, fov_deg: 60.0, axes: DMat3::IDENTITY }
    }
}

/// Why a pose cannot be used.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum PoseError {
    /// Wrong number of fields.
    #[error("camera pose '{text}' has {count} numbers: give x,y,z,yaw,pitch")]
    Fields {
        /// What was given.
        text: String,
        /// How many numbers it holds.
        count: usize,
    },
    /// A field that is no finite number.
    #[error("camera pose '{text}': '{field}' is not a finite number")]
    Number {
        /// What was given.
        text: String,
        /// The offending field.
        field: String,
    },
    /// A coordinate beyond [`Camera::FARTHEST_M`].
    #[error("camera pose: {value:e} is too far away to draw with: give numbers of at most 1e15")]
    TooFar {
        /// The offending number.
        value: f64,
    },
    /// Field of view out of range.
    #[error("field of view {fov_deg:e} degrees cannot be drawn: give at least 1e-4 and less than 180")]
    FieldOfView {
        /// What was given.
        fov_deg: f64,
    },
}

impl Camera {
    /// Narrowest field of view: beyond it f32 planes no longer tell left from right.
    pub const LEAST_FOV_DEG: f64 = 1e-4;
    /// Largest coordinate (and angle) taken: what f32 products of positions still hold.
    pub const FARTHEST_M: f64 = 1e15;

    /// The five numbers of a pose `x,y,z,yaw,pitch` in the terrain's own units.
    ///
    /// # Errors
    /// When there are not five finite numbers.
    pub fn parse_pose(text: &str) -> Result<[f64; 5], PoseError> {
        let numbers = text
            .split(',')
            .map(|field| match field.trim().parse::<f64>() {
                Ok(v) if v.is_finite() => Ok(v),
                _ => Err(PoseError::Number { text: text.into(), field: field.trim().into() }),
            })
            .collect::<Result<Vec<_>, _>>()?;
        let count = numbers.len();
        numbers.try_into().map_err(|_| PoseError::Fields { text: text.into(), count })
    }

    /// Checks that every number can be drawn with.
    ///
    /// # Errors
    /// When a coordinate is not finite or the field of view is out of range.
    pub fn validate(&self) -> Result<(), PoseError> {
        let mut all = vec![self.eye_m.x, self.eye_m.y, self.eye_m.z, self.yaw_deg, self.pitch_deg];
        all.extend(self.axes.to_cols_array());
        if let Some(bad) = all.iter().find(|v| !v.is_finite()) {
            return Err(PoseError::Number { text: format!("{all:?}"), field: bad.to_string() });
        }
        if let Some(far) = all.iter().find(|v| v.abs() > Self::FARTHEST_M) {
            return Err(PoseError::TooFar { value: *far });
        }
        if !(self.fov_deg >= Self::LEAST_FOV_DEG && self.fov_deg < 180.0) {
            return Err(PoseError::FieldOfView { fov_deg: self.fov_deg });
        }
        Ok(())
    }

    /// Unit view direction.
    #[must_use]
    pub fn forward(&self) -> DVec3 {
        let (yaw, pitch) = (self.yaw_deg.to_radians(), self.pitch_deg.to_radians());
        self.axes * DVec3::new(yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), pitch.sin())
    }

    /// Unit vectors to the right and upwards in the picture.
    #[must_use]
    pub fn right_and_up(&self) -> [DVec3; 2] {
        let (yaw, pitch) = (self.yaw_deg.to_radians(), self.pitch_deg.to_radians());
        let right = DVec3::new(yaw.cos(), -yaw.sin(), 0.0);
        let up = DVec3::new(-yaw.sin() * pitch.sin(), -yaw.cos() * pitch.sin(), pitch.cos());
        [self.axes * right, self.axes * up]
    }

    /// Direction (not unit) through the middle of a pixel, counted from the top left.
    #[must_use]
    pub fn ray(&self, pixel: [u32; 2], size_px: [u32; 2]) -> DVec3 {
        let [right, up] = self.right_and_up();
        let half = (self.fov_deg.to_radians() * 0.5).tan() / f64::from(size_px[1]);
        let offset = |a: usize| f64::from(2 * pixel[a] + 1) - f64::from(size_px[a]);
        self.forward() + right * (half * offset(0)) - up * (half * offset(1))
    }

    /// A camera at `eye_m` on a plane that looks at `target_m`.
    #[must_use]
    pub fn looking_at(eye_m: DVec3, target_m: DVec3, fov_deg: f64) -> Self {
        let d = target_m - eye_m;
        let yaw_deg = d.x.atan2(d.y).to_degrees();
        let pitch_deg = d.z.atan2(d.truncate().length()).to_degrees();
        Self { eye_m, yaw_deg, pitch_deg, fov_deg, axes: DMat3::IDENTITY }
    }

    /// Clip space from positions relative to `anchor_m`: reverse depth (1 at `near_m`, 0 at infinity).
    #[must_use]
    pub fn clip_from_anchor(&self, anchor_m: DVec3, aspect: f64, near_m: f64) -> DMat4 {
        let [right, up] = self.right_and_up();
        let forward = self.forward();
        let eye = self.eye_m - anchor_m;
        let row = |axis: DVec3| DVec4::new(axis.x, axis.y, axis.z, -axis.dot(eye));
        let view = DMat4::from_cols(row(right), row(up), row(-forward), DVec4::W).transpose();
        let focal = 1.0 / (self.fov_deg.to_radians() * 0.5).tan();
        let projection = DMat4::from_cols(
            DVec4::new(focal / aspect, 0.0, 0.0, 0.0),
            DVec4::new(0.0, focal, 0.0, 0.0),
            DVec4::new(0.0, 0.0, 0.0, -1.0),
            DVec4::new(0.0, 0.0, near_m, 0.0),
        );
        projection * view
    }

    /// Planes left, right, bottom, top, near of a clip matrix; unit inward normals.
    #[must_use]
    pub fn planes(clip: &DMat4) -> [[f32; 4]; 5] {
        let row = |i: usize| clip.row(i);
        let w = row(3);
        // With reverse depth z = near, so w >= z is what lies beyond the near plane.
        let planes = [w + row(0), w - row(0), w + row(1), w - row(1), w - row(2)];
        planes.map(|p| {
            let length = p.truncate().length();
            (p / if length > 0.0 { length } else { 1.0 }).as_vec4().to_array()
        })
    }
}
