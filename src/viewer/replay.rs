//! Replays a path in real time: recordings, other path files and the named paths of `fly`.

use tessclip::{Camera, Terrain};

use crate::cli::paths::{CameraPath, NAMES, Tempo};

/// Seconds that a named path takes.
const NAMED_S: u32 = 20;
/// Frames a second of path time, which named paths count in.
const RATE: u32 = 60;

/// A path that is replayed.
pub struct Replay {
    path: CameraPath,
    seconds: f64,
}

impl Replay {
    /// A named path, which takes 20 seconds, or a CSV file `t,x,y,z,yaw,pitch`, which takes its own.
    pub fn open(spec: &str, terrain: &Terrain) -> anyhow::Result<Self> {
        let tempo = Tempo { frames: NAMED_S * RATE, hz: Some(RATE), speed_m_s: None };
        let path = CameraPath::open(spec, terrain, &tempo)?;
        let seconds = if NAMES.contains(&spec) { f64::from(NAMED_S) } else { path.seconds() };
        Ok(Self { path, seconds })
    }

    /// Seconds it lasts.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// The camera `t_s` seconds after the begin, with this vertical field of view; none after the end.
    pub fn at(&self, t_s: f64, fov_deg: f64) -> Option<Camera> {
        // Exactly 1 for files, so that recorded times meet recorded cameras.
        let own = self.path.seconds() / self.seconds;
        (t_s <= self.seconds).then(|| self.path.at_time(t_s.max(0.0) * own, fov_deg))
    }
}

#[cfg(test)]
mod tests {
    use super::super::recorder::Recorder;
    use super::super::tests::{globe, in_degrees, mountains, sampled};
    use super::*;

    /// Cameras on a winding way around a pose, at uneven times.
    fn winding(from: [f64; 5], stride: [f64; 5]) -> Vec<(f64, [f64; 5])> {
        (0..40)
            .map(|k| {
                let s = f64::from(k) * 0.37;
                let part = [s.sin(), (0.7 * s).cos(), (1.3 * s).sin(), (0.5 * s).sin(), (0.9 * s).cos()];
                (f64::from(k * k + k) / 97.0, [0, 1, 2, 3, 4].map(|i| from[i] + stride[i] * part[i]))
            })
            .collect()
    }

    #[test]
    fn a_recording_is_replayed_camera_by_camera() {
        let dir = tempfile::tempdir().unwrap();
        let turn = [100.0, 60.0];
        for (terrain, from, stride, tolerance) in [
            (
                mountains(),
                [3_000.0, 4_000.0, 3_500.0, 40.0, -10.0],
                [900.0, 700.0, 300.0, turn[0], turn[1]],
                1e-12,
            ),
            (in_degrees(), [8.03, 46.03, 3_500.0, 40.0, -10.0], [0.02, 0.01, 300.0, turn[0], turn[1]], 1e-12),
            (
                sampled(),
                [100.0, -200.0, 2_500.0, 40.0, -10.0],
                [900.0, 700.0, 300.0, turn[0], turn[1]],
                1e-12,
            ),
            (globe(), [10.0, 47.0, 2e5, 40.0, -10.0], [30.0, 20.0, 1e5, turn[0], turn[1]], 1e-9),
        ] {
            let cameras = winding(from, stride);
            let mut recorder = Recorder::begin(dir.path()).unwrap();
            let file = recorder.path().to_path_buf();
            cameras.iter().for_each(|(t_s, pose)| recorder.add(*t_s, *pose).unwrap());
            assert_eq!(recorder.finish().unwrap(), cameras.len());
            let replay = Replay::open(file.to_str().unwrap(), &terrain).unwrap();
            assert_eq!(replay.seconds(), cameras[39].0);
            for (t_s, pose) in cameras {
                let camera = replay.at(t_s, 50.0).unwrap();
                assert_eq!(camera.fov_deg, 50.0);
                let found = terrain.pose(&camera);
                for i in 0..5 {
                    let mut off = found[i] - pose[i];
                    if i == 3 {
                        off = (off + 180.0).rem_euclid(360.0) - 180.0;
                    }
                    let most = tolerance * pose[i].abs().max(1.0);
                    assert!(off.abs() <= most, "{} at {t_s} s: {found:?}, not {pose:?}", terrain.base());
                }
            }
        }
    }

    #[test]
    fn nothing_lies_after_the_end() {
        let terrain = mountains();
        let replay = Replay::open("circle", &terrain).unwrap();
        assert_eq!(replay.seconds(), 20.0);
        assert!(replay.at(20.0, 60.0).is_some());
        assert!(replay.at(20.001, 60.0).is_none());
        assert!(replay.at(f64::NAN, 60.0).is_none());
        assert_eq!(replay.at(-1.0, 60.0), replay.at(0.0, 60.0));
    }

    #[test]
    fn named_paths_take_twenty_seconds() {
        let terrain = mountains();
        for name in NAMES {
            let replay = Replay::open(name, &terrain).unwrap();
            assert_eq!(replay.seconds(), 20.0, "{name}");
            let at = |t_s: f64| replay.at(t_s, 60.0).unwrap();
            assert!((0..=80).all(|k| at(0.25 * f64::from(k)).validate().is_ok()), "{name}");
            // They move until the very end, all but the one that stands.
            assert_eq!(at(18.5) != at(20.0), name != "still", "{name}");
        }
        // Two seconds a turn, as in a flight.
        let spin = Replay::open("spin", &terrain).unwrap();
        let ahead = |t_s: f64| spin.at(t_s, 60.0).unwrap().forward();
        assert!(ahead(0.0).distance(ahead(2.0)) < 1e-9);
        assert!(ahead(0.0).dot(ahead(1.0)) < 0.0);
    }

    #[test]
    fn what_is_no_path_is_refused() {
        let error = Replay::open("no-such-path.csv", &mountains()).err().unwrap().to_string();
        assert!(error.contains("no-such-path.csv"), "{error}");
    }
}
