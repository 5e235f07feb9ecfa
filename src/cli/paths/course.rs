//! A path as it is flown: which camera each frame has.

use tessclip::{Camera, Terrain};

use super::CameraPath;

/// How a path is flown.
#[derive(Clone, Copy, Debug)]
pub struct Tempo {
    /// Frames of the flight.
    pub frames: u32,
    /// Frames due a second (open loop); none in closed loop, where a frame is 1/60 s of path time.
    pub hz: Option<u32>,
    /// Speed over the ground in metres a second of path time; none spreads the path over the frames.
    pub speed_m_s: Option<f64>,
}

impl Tempo {
    /// Frames a second of path time.
    pub fn rate(&self) -> f64 {
        self.hz.map_or(60.0, f64::from)
    }

    /// Path time of the flight where it is not spread over the frames, seconds.
    pub fn seconds(&self) -> f64 {
        f64::from(self.frames) / self.rate()
    }
}

/// A path and how it is flown.
pub struct Course {
    /// Where it leads.
    pub path: CameraPath,
    /// How fast.
    pub tempo: Tempo,
}

impl Course {
    /// A named path, or a CSV file.
    pub fn open(spec: &str, terrain: &Terrain, tempo: Tempo) -> anyhow::Result<Self> {
        Ok(Self { path: CameraPath::open(spec, terrain, &tempo)?, tempo })
    }

    /// Path time and camera of a frame. A path in real time that is too short is flown back and forth, with
    /// the headings of the way there.
    pub fn at(&self, frame: u32, fov_deg: f64) -> (f64, Camera) {
        if !self.path.timed {
            let share = f64::from(frame) / f64::from((self.tempo.frames - 1).max(1));
            return self.path.at(share, fov_deg);
        }
        let t_s = self.time_s(frame);
        (t_s, self.path.at_time(back_and_forth(t_s, self.path.seconds()), fov_deg))
    }

    /// Whether this frame is the first one after a jump.
    pub fn jumped(&self, frame: u32) -> bool {
        frame > 0 && self.path.jumps_between(self.time_s(frame - 1), self.time_s(frame))
    }

    fn time_s(&self, frame: u32) -> f64 {
        f64::from(frame) / self.tempo.rate()
    }
}

/// Where on a way of `length` one is after `t`, turning round at both ends.
pub(super) fn back_and_forth(t: f64, length: f64) -> f64 {
    if length <= 0.0 {
        return 0.0;
    }
    let phase = t.rem_euclid(2.0 * length);
    if phase <= length { phase } else { 2.0 * length - phase }
}
