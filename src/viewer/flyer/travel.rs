//! Moving over a surface: where the eye gets to, and what becomes of the view there.

use glam::{DMat3, DQuat, DVec3};
use tessclip::{Camera, Terrain};

use super::ground::Following;
use super::{Flyer, USUAL_FOV_DEG, usable};

/// Turn of the local up by metres moved, in units of the sharpest bend of the surface, beyond which the
/// camera is near the middle of what the surface bends around, as in a tunnel.
const SHARPEST: f64 = 2.0;
/// What rounding may turn the local up by, radians.
const ROUNDING: f64 = 1e-12;

impl Flyer {
    /// Moves by metres to the right, ahead and up. Ahead is along the view; of a camera that follows the
    /// ground, level, and its height is not changed here.
    pub(super) fn travel(&mut self, way_m: DVec3, terrain: &Terrain) {
        if way_m == DVec3::ZERO {
            return;
        }
        let camera = self.camera(terrain, USUAL_FOV_DEG);
        let up = camera.axes.z_axis;
        let [right, _] = camera.right_and_up();
        let offset = match self.following {
            Following::Off => right * way_m.x + camera.forward() * way_m.y + up * way_m.z,
            _ => right * way_m.x + up.cross(right) * way_m.y,
        };
        if let Some(pose) = usable(self.moved(&camera, offset, terrain)) {
            self.pose = pose;
        }
    }

    /// The pose after a move by `offset` metres in the world.
    fn moved(&self, camera: &Camera, offset: DVec3, terrain: &Terrain) -> [f64; 5] {
        let eye_m = within(camera.eye_m + offset);
        let straight = terrain.pose(&Camera { eye_m, ..*camera });
        let [x, y, z, ..] = straight;
        let [.., yaw, pitch] = self.pose;
        let Some(curved) = &terrain.curved else { return [x, y, z, yaw, pitch] };
        let (old, new) = (camera.axes.z_axis, terrain.camera(straight, USUAL_FOV_DEG).axes.z_axis);
        let bend = SHARPEST * offset.length() / curved.surface.least_radius_m() + ROUNDING;
        if old.distance(new) > bend {
            // The view keeps its direction in the world, the eye the straight line.
            return straight;
        }
        let carried = Camera { eye_m, axes: turned(&camera.axes, new), ..*camera };
        let [.., yaw, _] = terrain.pose(&carried);
        // Level flight stays level, however long the step.
        [x, y, self.pose[2] + offset.dot(old), yaw, pitch]
    }
}

/// The nearest place that a camera may have, world metres.
pub(super) fn within(p: DVec3) -> DVec3 {
    let far = DVec3::splat(Camera::FARTHEST_M);
    p.clamp(-far, far)
}

/// The short way round from one heading to another, degrees.
pub(super) fn short_way(from: f64, to: f64) -> f64 {
    (to - from + 180.0).rem_euclid(360.0) - 180.0
}

/// Axes after the smallest turn that brings their vertical to `up`.
pub(super) fn turned(axes: &DMat3, up: DVec3) -> DMat3 {
    DMat3::from_quat(DQuat::from_rotation_arc(axes.z_axis, up)) * *axes
}
