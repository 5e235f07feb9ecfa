//! Camera paths: named ones over a terrain, and CSV files `t,x,y,z,yaw,pitch` with header.

mod course;
mod csv;
mod field;
mod ground;
mod named;
mod places;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
use serde::Deserialize;
use tessclip::scene::Curved;
use tessclip::{Camera, Terrain};

pub use self::course::{Course, Tempo};
pub(crate) use self::named::NAMES;
use self::named::{Named, named};

/// A timed camera path, sampled linearly; on a globe along great circles.
pub struct CameraPath {
    /// As given.
    pub name: String,
    /// In the terrain's own units; on a plane in world metres. Two keys of the same time are a jump.
    keys: Vec<Key>,
    curved: Option<Arc<Curved>>,
    /// On a globe: the cameras at the keys, see [`carried`].
    carried: Vec<Camera>,
    /// Its seconds are those of the flight; else it is spread over the frames.
    timed: bool,
    /// Times of jumps to another place.
    jumps: Vec<f64>,
}

#[derive(Clone, Copy, Deserialize)]
struct Key {
    t: f64,
    x: f64,
    y: f64,
    z: f64,
    yaw: f64,
    pitch: f64,
}

impl Key {
    fn pose(self) -> [f64; 5] {
        [self.x, self.y, self.z, self.yaw, self.pitch]
    }
}

/// Shorter ground distances between two keys are standing, metres.
const STANDING_M: f64 = 1e-6;

impl CameraPath {
    /// A named path, or a CSV file.
    pub fn open(spec: &str, terrain: &Terrain, tempo: &Tempo) -> anyhow::Result<Self> {
        let made = if NAMES.contains(&spec) {
            named(spec, terrain, tempo)
        } else {
            Named::untimed(self::csv::read_csv(spec, terrain)?)
        };
        let curved = terrain.curved.clone();
        let carried = match &curved {
            Some(c) if c.globe.is_some() => carried(c, &made.keys),
            _ => Vec::new(),
        };
        let Named { keys, timed, jumps } = made;
        let mut path = Self { name: spec.into(), keys, curved, carried, timed, jumps };
        if let Some(speed_m_s) = tempo.speed_m_s.filter(|_| !timed) {
            path.retime(speed_m_s);
            path.timed = true;
        }
        Ok(path)
    }

    /// Seconds it lasts.
    pub fn seconds(&self) -> f64 {
        self.keys.last().map_or(0.0, |k| k.t) - self.keys[0].t
    }

    /// Distance it covers over the ground in metres, jumps left out; on a curved surface along the surface
    /// itself, whatever the height.
    pub fn length_m(&self) -> f64 {
        (0..self.keys.len() - 1).map(|k| self.segment_m(k)).sum()
    }

    /// Ground distance between key `k` and the next one, metres; 0 for a jump.
    fn segment_m(&self, k: usize) -> f64 {
        let (a, b) = (self.keys[k], self.keys[k + 1]);
        if b.t <= a.t {
            return 0.0;
        }
        let Some(curved) = &self.curved else { return (b.x - a.x).hypot(b.y - a.y) };
        let foot = |s: f64| {
            let pose = [a.x + (b.x - a.x) * s, a.y + (b.y - a.y) * s, 0.0, 0.0, 0.0];
            curved.camera(pose, 60.0).eye_m
        };
        if !self.carried.is_empty() {
            // Along the great circle, not through the globe.
            let (p, q) = (foot(0.0), foot(1.0));
            let radius_m = 0.5 * (p.length() + q.length());
            return 2.0 * radius_m * (0.5 * p.distance(q) / radius_m).min(1.0).asin();
        }
        let feet: Vec<DVec3> = (0..=8).map(|j| foot(f64::from(j) / 8.0)).collect();
        feet.windows(2).map(|p| p[0].distance(p[1])).sum()
    }

    /// Sets the times of the keys so that the ground passes at this speed. Where the camera stands, turns or
    /// sinks over one place, they stay.
    fn retime(&mut self, speed_m_s: f64) {
        let lengths: Vec<f64> = (0..self.keys.len() - 1).map(|k| self.segment_m(k)).collect();
        let mut before = self.keys[0].t;
        for (k, length_m) in lengths.into_iter().enumerate() {
            let own_s = self.keys[k + 1].t - before;
            before = self.keys[k + 1].t;
            let takes_s = if length_m > STANDING_M { length_m / speed_m_s } else { own_s };
            self.keys[k + 1].t = self.keys[k].t + takes_s;
        }
    }

    /// The camera at a share 0..1 of the path, and its path time.
    fn at(&self, share: f64, fov_deg: f64) -> (f64, Camera) {
        let t_s = share * self.seconds();
        (self.keys[0].t + t_s, self.at_time(t_s, fov_deg))
    }

    /// The camera `t_s` seconds after the path's begin.
    pub fn at_time(&self, t_s: f64, fov_deg: f64) -> Camera {
        let t = self.keys[0].t + t_s;
        // Of keys at the same time the last one counts: a jump leaves nothing between its two places.
        let after = self.keys.partition_point(|k| k.t <= t).clamp(1, self.keys.len() - 1);
        let (a, b) = (self.keys[after - 1], self.keys[after]);
        let s = if b.t > a.t { ((t - a.t) / (b.t - a.t)).clamp(0.0, 1.0) } else { 1.0 };
        let mix = |u: f64, v: f64| u + (v - u) * s;
        // The short way round between two headings.
        let short_way = |from: f64, to: f64| (to - from + 180.0).rem_euclid(360.0) - 180.0;
        if let [.., _] = &self.carried[..]
            && let Some(curved) = &self.curved
        {
            let (from, to) = (self.carried[after - 1], self.carried[after]);
            return between(curved, &from, &to, s, fov_deg);
        }
        let turn = short_way(a.yaw, b.yaw);
        let pose = [mix(a.x, b.x), mix(a.y, b.y), mix(a.z, b.z), a.yaw + turn * s, mix(a.pitch, b.pitch)];
        if let Some(curved) = &self.curved {
            return curved.camera(pose, fov_deg);
        }
        Camera {
            eye_m: DVec3::new(pose[0], pose[1], pose[2]),
            yaw_deg: pose[3],
            pitch_deg: pose[4],
            fov_deg,
            ..Camera::default()
        }
    }

    /// Whether a jump lies after `from_s` and not after `to_s`, seconds from the path's begin.
    fn jumps_between(&self, from_s: f64, to_s: f64) -> bool {
        let upto = |t: f64| self.jumps.partition_point(|j| *j <= t);
        upto(from_s) < upto(to_s)
    }

    /// Whether it leads to places it does not fly to.
    pub fn has_jumps(&self) -> bool {
        !self.jumps.is_empty()
    }
}

/// Cameras at the keys of a path over a globe. Yaw is measured in axes that are carried along the path
/// without turning about the vertical, so that neither the view nor the light jumps where north does: at a
/// pole.
fn carried(curved: &Curved, keys: &[Key]) -> Vec<Camera> {
    let mut out: Vec<Camera> = Vec::with_capacity(keys.len());
    for (k, key) in keys.iter().enumerate() {
        let mut camera = curved.camera(key.pose(), 60.0);
        let flown = k > 0 && key.t > keys[k - 1].t;
        if let Some(before) = out.last().filter(|_| flown) {
            let forward = camera.forward();
            camera.axes = turned(before, camera.axes.z_axis);
            let d = camera.axes.transpose() * forward;
            camera.yaw_deg = d.x.atan2(d.y).to_degrees();
        }
        out.push(camera);
    }
    out
}

/// The axes of `from` after the smallest turn that brings its vertical to `up`.
fn turned(from: &Camera, up: DVec3) -> DMat3 {
    DMat3::from_quat(DQuat::from_rotation_arc(from.axes.z_axis, up)) * from.axes
}

/// The camera a share `s` of the way, on the great circle between both.
fn between(curved: &Curved, from: &Camera, to: &Camera, s: f64, fov_deg: f64) -> Camera {
    let (a, b) = (from.axes.z_axis, to.axes.z_axis);
    let arc = DQuat::from_rotation_arc(a, b);
    let up = (DQuat::IDENTITY.slerp(arc, s) * a).normalize();
    let height = |c: &Camera| curved.surface.foot(c.eye_m).height_m;
    let above = height(from) + (height(to) - height(from)) * s;
    let turn = (to.yaw_deg - from.yaw_deg + 180.0).rem_euclid(360.0) - 180.0;
    Camera {
        eye_m: curved.over(up, above),
        yaw_deg: from.yaw_deg + turn * s,
        pitch_deg: from.pitch_deg + (to.pitch_deg - from.pitch_deg) * s,
        fov_deg,
        axes: turned(from, up),
    }
}
