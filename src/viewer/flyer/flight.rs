//! Eased flights to a goal: double click, home, coordinates.

use glam::{DQuat, DVec3};
use tessclip::{Camera, Terrain};

use super::ground::{above, lifted};
use super::travel::{short_way, turned, within};
use super::{Flyer, Ground, USUAL_FOV_DEG, usable};

/// Seconds that a flight takes.
const FLIGHT_S: f64 = 1.2;
/// What a double click leaves of the distance to the point.
const CLOSER: f64 = 0.25;

/// A flight under way.
#[derive(Clone, Debug)]
pub(super) struct Flight {
    /// Camera and height at the begin.
    from: (Camera, f64),
    to: Camera,
    goal: [f64; 5],
    spent_s: f64,
}

impl Flight {
    /// The pose a share `s` of the way: along a great circle of a globe, straight elsewhere.
    fn at(&self, s: f64, terrain: &Terrain) -> [f64; 5] {
        let mix = |a: f64, b: f64| a + (b - a) * s;
        let ((from, from_m), to) = (&self.from, &self.to);
        let height_m = mix(*from_m, self.goal[2]);
        let globe = terrain.curved.as_ref().filter(|c| c.globe.is_some());
        let eye_m = match globe {
            Some(globe) => {
                let arc = DQuat::from_rotation_arc(from.axes.z_axis, to.axes.z_axis);
                let up = (DQuat::IDENTITY.slerp(arc, s) * from.axes.z_axis).normalize();
                globe.over(up, height_m)
            }
            None => from.eye_m.lerp(to.eye_m, s),
        };
        let straight = terrain.pose(&Camera { eye_m, ..*from });
        let up = terrain.camera(straight, USUAL_FOV_DEG).axes.z_axis;
        // What both ends look at, seen from here: over a globe along with the ground, elsewhere in the world.
        let view = |end: &Camera| {
            let axes = if globe.is_some() { turned(&end.axes, up) } else { end.axes };
            terrain.pose(&Camera { eye_m, axes, ..*end })
        };
        let ([x, y, z, yaw, pitch], [.., to_yaw, to_pitch]) = (view(from), view(to));
        // A straight line would cut through ground that bulges.
        [x, y, z.max(height_m), yaw + short_way(yaw, to_yaw) * s, mix(pitch, to_pitch)]
    }
}

impl Flyer {
    /// Begins a flight of little more than a second that ends exactly at `goal`. Keys that are held end it.
    pub fn fly_to(&mut self, terrain: &Terrain, goal: [f64; 5]) {
        let Some(goal) = usable(goal) else { return };
        self.stop();
        let from = (self.camera(terrain, USUAL_FOV_DEG), self.pose[2]);
        let to = terrain.camera(goal, USUAL_FOV_DEG);
        let to = Camera { eye_m: within(to.eye_m), ..to };
        self.flight = Some(Flight { from, to, goal, spent_s: 0.0 });
    }

    /// Whether a flight is under way.
    pub fn is_moving(&self) -> bool {
        self.flight.is_some()
    }

    /// `dt_s` seconds more of the flight.
    pub(super) fn fly_on(&mut self, dt_s: f64, terrain: &Terrain, ground: &Ground<'_>) {
        let Some(mut flight) = self.flight.take() else { return };
        flight.spent_s += dt_s;
        let s = flight.spent_s / FLIGHT_S;
        if s >= 1.0 {
            self.pose = flight.goal;
            return;
        }
        let before = self.pose;
        if let Some(pose) = usable(flight.at(s * s * (3.0 - 2.0 * s), terrain)) {
            self.pose = pose;
        }
        self.flight = Some(flight);
        let above = self.above(terrain, ground);
        self.keep_clear(before, above, terrain, ground);
    }

    /// Where a double click on `point` leads: `camera` at a quarter of the distance, looking the same way, a
    /// few metres above the ground at least.
    pub fn double_click_goal(
        &self,
        terrain: &Terrain,
        camera: &Camera,
        point: DVec3,
        ground: &Ground<'_>,
    ) -> [f64; 5] {
        let eye_m = within(point + (camera.eye_m - point) * CLOSER);
        let goal = terrain.pose(&Camera { eye_m, ..*camera });
        lifted(goal, self.scale.stand_off_m, terrain, ground)
    }

    /// The pose over a place in the terrain's own units, with the present view: at a height in metres or,
    /// where none is given, 1.5 km above the ground, less over small terrains and more over coarse ones.
    pub fn go_to_goal(
        &self,
        terrain: &Terrain,
        [x, y]: [f64; 2],
        height_m: Option<f64>,
        ground: &Ground<'_>,
    ) -> [f64; 5] {
        let [.., yaw, pitch] = self.pose;
        if let Some(height_m) = height_m {
            return [x, y, height_m, yaw, pitch];
        }
        let range = match &terrain.curved {
            Some(curved) => curved.height_range(),
            None => terrain.source.height_range(),
        };
        let top_m = range.map_or(0.0, |r| f64::from(r[1]));
        let above_m = above([x, y, top_m, yaw, pitch], terrain, ground).unwrap_or(0.0);
        let goal = [x, y, top_m - above_m + self.scale.go_to_m, yaw, pitch];
        lifted(goal, self.scale.clearance_m, terrain, ground)
    }
}
