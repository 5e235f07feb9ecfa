//! The camera as it is flown: keys, mouse and time in, a pose out. It knows no window and no clock.

mod flight;
mod ground;
mod orbit;
#[cfg(test)]
mod tests;
mod travel;

use glam::DVec3;
use tessclip::{Camera, Terrain};

use self::flight::Flight;
pub use self::ground::Ground;
use self::ground::{Following, Scale};
use self::orbit::Orbit;
use self::travel::within;

/// Degrees that a pixel of mouse motion turns at [`USUAL_FOV_DEG`].
const LOOK_DEG_PER_PX: f64 = 0.1;
/// Vertical field of view that the mouse is tuned to, and of cameras of which only the place counts; degrees.
const USUAL_FOV_DEG: f64 = 60.0;
/// Time constant with which speed and followed height ease in and out, seconds.
const EASE_S: f64 = 0.12;
/// Share under which what is left to ease is nothing, so that the camera comes to a definite rest.
const REST: f64 = 1e-6;
/// Longest time that one step makes up for, seconds: after a pause the camera must not leap.
const LONGEST_STEP_S: f64 = 0.1;
/// Longest part of a step, seconds: speed changes with the height on the way.
const PART_S: f64 = 1.0 / 60.0;
/// Most parts of a step.
const MOST_PARTS: f64 = 16.0;
/// What the fast key multiplies the speed by, and the slow key divides it by.
const FASTER: f64 = 8.0;
/// Least and greatest factor on the speed.
const FACTORS: [f64; 2] = [1e-3, 1e3];

/// Keys that are held down to fly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held {
    /// Along the view direction.
    pub forward: bool,
    /// Against the view direction.
    pub back: bool,
    /// To the left of the picture.
    pub left: bool,
    /// To the right of the picture.
    pub right: bool,
    /// Away from the ground.
    pub up: bool,
    /// Towards the ground.
    pub down: bool,
    /// [`FASTER`] times as fast.
    pub fast: bool,
    /// As much slower.
    pub slow: bool,
}

impl Held {
    /// The wished velocity to the right, ahead and up, in units of the usual speed.
    fn wish(self) -> DVec3 {
        let axis = |more: bool, less: bool| f64::from(more) - f64::from(less);
        let way =
            DVec3::new(axis(self.right, self.left), axis(self.forward, self.back), axis(self.up, self.down));
        let factor = match (self.fast, self.slow) {
            (true, false) => FASTER,
            (false, true) => 1.0 / FASTER,
            _ => 1.0,
        };
        way.normalize_or_zero() * factor
    }
}

/// A camera that is flown. Its pose is all its state of place and view, so that printed lines and recordings
/// are exact.
#[derive(Clone, Debug)]
pub struct Flyer {
    /// In the terrain's own units.
    pose: [f64; 5],
    scale: Scale,
    /// On the speed.
    factor: f64,
    /// Velocity to the right, ahead and up, in units of the speed at this height.
    glide: DVec3,
    following: Following,
    flight: Option<Flight>,
    orbit: Option<Orbit>,
    /// Height of the ground last seen below, in the unit of the third number of a pose, metres.
    ground_m: f64,
}

impl Flyer {
    /// Stands where `camera` stands.
    pub fn new(terrain: &Terrain, camera: &Camera) -> Self {
        Self {
            pose: usable(terrain.pose(camera)).unwrap_or_default(),
            scale: Scale::of(terrain),
            factor: 1.0,
            glide: DVec3::ZERO,
            following: Following::Off,
            flight: None,
            orbit: None,
            ground_m: 0.0,
        }
    }

    /// `x, y, z, yaw, pitch` in the terrain's own units.
    pub fn pose(&self) -> [f64; 5] {
        self.pose
    }

    /// Stands there at once and rests; a pose that is not finite changes nothing.
    pub fn set_pose(&mut self, pose: [f64; 5]) {
        if let Some(pose) = usable(pose) {
            self.stop();
            self.pose = pose;
        }
    }

    /// The camera, with this vertical field of view.
    pub fn camera(&self, terrain: &Terrain, fov_deg: f64) -> Camera {
        let camera = terrain.camera(self.pose, fov_deg);
        Camera { eye_m: within(camera.eye_m), ..camera }
    }

    /// Turns by mouse motion in pixels to the right and down: a tenth of a degree a pixel at 60 degrees of
    /// view, in proportion to the field of view. A flight under way ends.
    pub fn look(&mut self, delta_px: [f64; 2], fov_deg: f64) {
        let [right, down] = delta_px.map(|px| px * LOOK_DEG_PER_PX * fov_deg / USUAL_FOV_DEG);
        if right == 0.0 && down == 0.0 {
            return;
        }
        let [x, y, z, yaw, pitch] = self.pose;
        if let Some(pose) = usable([x, y, z, yaw + right, pitch - down]) {
            self.flight = None;
            self.pose = pose;
        }
    }

    /// Metres a second at full speed: the height above the ground every second, between a height worth a few
    /// metres and the size of the terrain. Where there is no ground, by what was last seen of it.
    pub fn speed_m_s(&self, above_m: Option<f64>) -> f64 {
        let above_m = above_m.filter(|a| a.is_finite()).unwrap_or(self.pose[2] - self.ground_m);
        self.factor * above_m.clamp(self.scale.least_m, self.scale.size_m)
    }

    /// Flies `factor` times as fast from now on, within limits.
    pub fn scale_speed(&mut self, factor: f64) {
        let scaled = self.factor * factor;
        if scaled.is_finite() {
            self.factor = scaled.clamp(FACTORS[0], FACTORS[1]);
        }
    }

    /// Flies as fast as at first.
    pub fn reset_speed(&mut self) {
        self.factor = 1.0;
    }

    /// One step of `dt_s` seconds, of which at most a tenth of a second counts: moves, eases, follows the
    /// ground and stays out of it. True while anything moves or is about to.
    pub fn step(&mut self, dt_s: f64, held: &Held, terrain: &Terrain, ground: &Ground<'_>) -> bool {
        let before = self.pose;
        // What is no number is no time either.
        let dt_s = if dt_s > 0.0 { dt_s.min(LONGEST_STEP_S) } else { 0.0 };
        let wish = held.wish();
        if wish != DVec3::ZERO {
            self.flight = None;
        }
        if self.is_moving() {
            self.fly_on(dt_s, terrain, ground);
            return true;
        }
        let mut above = self.above(terrain, ground);
        let fastest = wish.length().max(self.glide.length());
        let parts = if fastest > 0.0 {
            let way_m = fastest * self.speed_m_s(above) * dt_s;
            (dt_s / PART_S).max(way_m / self.scale.clearance_m).ceil().clamp(1.0, MOST_PARTS)
        } else {
            1.0
        };
        for _ in 0..parts as u32 {
            above = self.part(dt_s / parts, wish, above, terrain, ground);
        }
        self.pose != before || self.glide != DVec3::ZERO || wish != DVec3::ZERO
    }

    /// A part of a step; takes and gives the height above the ground.
    fn part(
        &mut self,
        dt_s: f64,
        wish: DVec3,
        above: Option<f64>,
        terrain: &Terrain,
        ground: &Ground<'_>,
    ) -> Option<f64> {
        let before = self.pose;
        // The exact way under a wish that stays: it does not depend on the frame rate.
        let decay = (-dt_s / EASE_S).exp();
        let way = wish * dt_s + (self.glide - wish) * (EASE_S * (1.0 - decay));
        self.glide = wish + (self.glide - wish) * decay;
        if wish == DVec3::ZERO && self.glide.length() < REST {
            self.glide = DVec3::ZERO;
        }
        let way_m = way * self.speed_m_s(self.following.height_m().or(above));
        self.travel(way_m, terrain);
        let above = self.follow(dt_s, way_m.z, terrain, ground);
        self.keep_clear(before, above, terrain, ground)
    }

    /// Ends all motion; a followed height is taken anew where the camera then is.
    fn stop(&mut self) {
        self.glide = DVec3::ZERO;
        self.flight = None;
        self.orbit = None;
        self.following = self.following.anew();
    }
}

/// A pose within all limits; none where a number is not finite.
fn usable(pose: [f64; 5]) -> Option<[f64; 5]> {
    let [x, y, z, yaw, pitch] = pose;
    let far = Camera::FARTHEST_M;
    let place = [x, y, z].map(|v| v.clamp(-far, far));
    // As given where it can be, so that it is printed as it was typed.
    let yaw = if yaw.abs() > 360.0 { travel::short_way(0.0, yaw) } else { yaw };
    let finite = pose.iter().all(|v| v.is_finite());
    finite.then(|| [place[0], place[1], place[2], yaw, pitch.clamp(-90.0, 90.0)])
}
