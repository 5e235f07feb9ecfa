//! Where a frame over a plane stands: what every method that draws it has in common.

use glam::{DMat4, DVec3};

use crate::camera::Camera;
use crate::scene::{Scene, Terrain};

/// The place that positions of a frame over a plane are relative to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneStand {
    /// Base sample.
    pub anchor: [i32; 2],
    /// Height, metres.
    pub anchor_height_m: f32,
    /// Both in the world, metres.
    pub anchor_m: DVec3,
    /// What windows are centred on, from the anchor, base samples: the camera, or the nearest place of the
    /// data. Geomorph is measured from there: from a camera outside it would reach every level's middle.
    pub eye_samples: [f32; 2],
}

impl PlaneStand {
    /// The sample nearest to the camera: what rounding leaves of other positions is then in proportion to
    /// their distance, however far samples lie apart. A function of the camera, as the height.
    pub fn of(terrain: &Terrain, camera: &Camera) -> Self {
        let last = terrain.source.lattice().last;
        let at = terrain.samples_from_world(camera.eye_m);
        #[expect(clippy::cast_possible_truncation, reason = "clamped to the lattice")]
        let anchor = [0, 1].map(|a| at[a].round().clamp(0.0, f64::from(last[a])) as i32);
        let range = terrain.source.height_range().unwrap_or([0.0, 0.0]);
        let near = camera.eye_m.z.clamp(range[0].into(), range[1].into());
        let anchor_height_m = ((near / 64.0).round() * 64.0) as f32;
        let ground = |a: usize| terrain.origin_m[a] + f64::from(anchor[a]) * terrain.spacing_m[a];
        Self {
            anchor,
            anchor_height_m,
            anchor_m: DVec3::new(ground(0), ground(1), anchor_height_m.into()),
            eye_samples: [0, 1].map(|a| (at[a].clamp(0.0, f64::from(last[a])) - f64::from(anchor[a])) as f32),
        }
    }
}

/// Clip space from metres relative to `anchor_m`, for a target of the given size.
pub(crate) fn clip(terrain: &Terrain, camera: &Camera, anchor_m: DVec3, size_px: [u32; 2]) -> DMat4 {
    let aspect = f64::from(size_px[0].max(1)) / f64::from(size_px[1].max(1));
    let spacing = terrain.spacing_m[0].min(terrain.spacing_m[1]);
    // Reverse depth has precision to spare: the near plane need only be closer than any detail.
    let near_m = (0.05 * spacing).clamp(1e-4, 0.05);
    camera.clip_from_anchor(anchor_m, aspect, near_m)
}

/// Direction towards the sun in the axes that yaw is measured in.
pub(crate) fn sun_direction(scene: &Scene) -> DVec3 {
    let [azimuth, altitude] = scene.sun_deg.map(f64::to_radians);
    DVec3::new(azimuth.sin() * altitude.cos(), azimuth.cos() * altitude.cos(), altitude.sin())
}

/// Over a plane fog takes two thirds over 1.7 times the data's diagonal.
pub(crate) fn fog_per_m(terrain: &Terrain) -> f64 {
    let [low, high] = terrain.extent_m();
    let diagonal = (high[0] - low[0]).hypot(high[1] - low[1]);
    0.6 / diagonal.max(1e-6)
}
