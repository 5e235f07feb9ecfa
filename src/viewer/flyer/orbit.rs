//! Turning around a point of the ground.

use std::f64::consts::PI;

use glam::{DMat3, DQuat, DVec3};
use tessclip::{Camera, Terrain};

use super::travel::within;
use super::{Flyer, Ground, USUAL_FOV_DEG, usable};

/// Greatest elevation of the eye as seen from the centre, up and down, degrees.
const STEEPEST_DEG: f64 = 85.0;
/// Times that a turn is halved where it would lead beyond the vertical.
const HALVINGS: u32 = 10;
/// What rounding may leave of a picture that is upright, as the cosine of its tilt.
const ROUNDING: f64 = 1e-9;

/// An orbit under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Orbit {
    /// World metres.
    centre: DVec3,
    /// From the centre to the eye, metres; known from the first turn on.
    distance_m: Option<f64>,
}

impl Flyer {
    /// Begins to turn around a world point; all other motion ends.
    pub fn begin_orbit(&mut self, centre: DVec3) {
        if centre.is_finite() {
            self.stop();
            self.orbit = Some(Orbit { centre: within(centre), distance_m: None });
        }
    }

    /// Turns by mouse motion in pixels to the right and down, half a turn by the height of the picture. Eye
    /// and view turn together, so that the centre keeps its place in the picture; where that would lead into the
    /// ground they turn less.
    pub fn orbit(&mut self, delta_px: [f64; 2], terrain: &Terrain, size_px: [u32; 2], ground: &Ground<'_>) {
        let Some(Orbit { centre, distance_m }) = self.orbit else { return };
        let [across, down] = delta_px.map(|px| px * PI / f64::from(size_px[1].max(1)));
        let camera = self.camera(terrain, USUAL_FOV_DEG);
        let away = camera.eye_m - centre;
        let distance_m = distance_m.unwrap_or(away.length());
        // In the centre itself there is nothing to turn around.
        let Some(direction) = away.try_normalize() else { return };
        if !across.is_finite() || !down.is_finite() {
            return;
        }
        let place = terrain.pose(&Camera { eye_m: centre, ..camera });
        let up = terrain.camera(place, USUAL_FOV_DEG).axes.z_axis;
        let [right, _] = camera.right_and_up();
        // Up and down about the level right of the picture, so that the horizon stays level.
        let mut rise = risen(direction, up, right, down);
        let across = DQuat::from_axis_angle(up, -across);
        for halving in 0..=HALVINGS {
            if halving == HALVINGS {
                rise = 0.0;
            }
            let turn = across * DQuat::from_axis_angle(right, -rise);
            let axes = DMat3::from_quat(turn) * camera.axes;
            let eye_m = within(centre + turn * direction * distance_m);
            if (ground.above)(eye_m).is_some_and(|above_m| above_m < self.scale.clearance_m) {
                if halving == HALVINGS {
                    return;
                }
                rise *= 0.5;
                continue;
            }
            let turned = Camera { eye_m, axes, ..camera };
            let pose = terrain.pose(&turned);
            let local_up = terrain.camera(pose, USUAL_FOV_DEG).axes.z_axis;
            let [_, picture_up] = turned.right_and_up();
            if rise != 0.0 && local_up.dot(picture_up) < -ROUNDING {
                // The view would turn over.
                rise *= 0.5;
                continue;
            }
            if let Some(pose) = usable(pose) {
                self.pose = pose;
                self.orbit = Some(Orbit { centre, distance_m: Some(distance_m) });
                self.following = self.following.anew();
            }
            return;
        }
    }

    /// Ends the orbit; the camera stays where it is.
    pub fn end_orbit(&mut self) {
        self.orbit = None;
    }
}

/// What is left of a turn upwards of `wanted` radians about `right` when the eye, in `direction` from the
/// centre, stops short of the vertical.
fn risen(direction: DVec3, up: DVec3, right: DVec3, wanted: f64) -> f64 {
    let vertical = up.reject_from_normalized(right).normalize_or(up);
    let ahead = vertical.cross(right);
    let elevation = direction.dot(vertical).atan2(-direction.dot(ahead));
    let limit = STEEPEST_DEG.to_radians();
    // An orbit that begins beyond the limit may only lead back.
    (elevation + wanted).clamp(elevation.min(-limit), elevation.max(limit)) - elevation
}
