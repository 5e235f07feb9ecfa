#![allow(clippy::unwrap_used, reason = "a failed expectation is a failed test")]

use glam::DVec3;
use tessclip::heights::{ReadOptions, open_terrain};
use tessclip::surface::Ellipsoid;
use tessclip::{Camera, Prefilter, Terrain};

use super::course::back_and_forth;
use super::named::NAMES;
use super::{CameraPath, Course, Tempo};

fn plane(spec: &str) -> Terrain {
    Terrain::new(&open_terrain(spec, &ReadOptions::default()).unwrap(), Prefilter::Subsample)
}

fn mountains() -> Terrain {
    plane("procedural:mountains?width=331&height=262")
}

fn tempo(frames: u32, speed_m_s: Option<f64>) -> Tempo {
    Tempo { frames, hz: None, speed_m_s }
}

fn flown(name: &str, terrain: &Terrain, tempo: Tempo) -> Vec<Camera> {
    let course = Course::open(name, terrain, tempo).unwrap();
    (0..tempo.frames).map(|frame| course.at(frame, 60.0).1).collect()
}

fn inside(terrain: &Terrain, camera: &Camera) -> bool {
    let [low, high] = terrain.extent_m();
    let eye = [camera.eye_m.x, camera.eye_m.y];
    (0..2).all(|a| low[a] - 1e-6 <= eye[a] && eye[a] <= high[a] + 1e-6)
}

fn over_ground(a: &Camera, b: &Camera) -> f64 {
    (b.eye_m - a.eye_m).truncate().length()
}

#[test]
fn named_paths_stay_inside_and_do_not_jump() {
    let terrain = mountains();
    let [low, high] = terrain.extent_m();
    let side = (high[0] - low[0]).max(high[1] - low[1]);
    for name in NAMES {
        for speed in [None, Some(600.0)] {
            let frames = flown(name, &terrain, tempo(3_000, speed));
            assert!(frames.iter().all(|c| inside(&terrain, c) && c.validate().is_ok()), "{name} {speed:?}");
            for (k, pair) in frames.windows(2).enumerate().filter(|_| name != "teleport") {
                let step = pair[0].eye_m.distance(pair[1].eye_m);
                assert!(step < 0.05 * side, "{name} {speed:?}: {step} m after frame {k}");
                let turn = pair[0].forward().angle_between(pair[1].forward()).to_degrees();
                assert!(turn < 10.0, "{name} {speed:?}: {turn} degrees after frame {k}");
            }
        }
    }
}

#[test]
fn named_paths_lead_over_curved_surfaces() {
    let read = |spec: &str| open_terrain(spec, &ReadOptions::default()).unwrap();
    let planet = Terrain::globe(vec![read("procedural:planet?size=65")], Ellipsoid::WGS84).unwrap();
    let dunes = read("procedural:dunes?size=129");
    let torus = Terrain::on(&dunes, "torus:5000,1700".parse().unwrap(), Prefilter::Subsample).unwrap();
    let tunnel = Terrain::on(&dunes, "cylinder:2000,inside".parse().unwrap(), Prefilter::Subsample).unwrap();
    for terrain in [planet, torus, tunnel] {
        for name in NAMES {
            for speed in [None, Some(1_000.0)] {
                let frames = flown(name, &terrain, tempo(150, speed));
                assert!(frames.iter().all(|c| c.validate().is_ok()), "{name} on {}", terrain.base());
            }
        }
    }
}

#[test]
fn a_speed_is_held_over_the_ground() {
    let terrain = mountains();
    // Windows of n = 63, two of them a second.
    let window_m = 62.0 * terrain.spacing_m[0];
    let speed = 2.0 * window_m;
    for name in ["straight", "circle", "double-turn", "random-walk", "follow"] {
        let frames = flown(name, &terrain, tempo(900, Some(speed)));
        let step = speed / 60.0;
        let steps: Vec<f64> = frames.windows(2).map(|p| over_ground(&p[0], &p[1])).collect();
        assert!(steps.iter().all(|s| *s < step * 1.0001), "{name}");
        // Where the path bends or turns round, the straight way between two frames is shorter.
        let held = steps.iter().filter(|s| **s > 0.97 * step).count();
        assert!(held as f64 > 0.95 * steps.len() as f64, "{name}: {held} of {}", steps.len());
        let path = CameraPath::open(name, &terrain, &tempo(900, Some(speed))).unwrap();
        let windows_per_s = path.length_m() / path.seconds() / window_m;
        assert!((windows_per_s - 2.0).abs() < 1e-9, "{name}: {windows_per_s}");
    }
}

#[test]
fn an_open_loop_moves_by_its_own_rate() {
    let terrain = mountains();
    let open = Tempo { frames: 60, hz: Some(30), speed_m_s: Some(600.0) };
    let frames = flown("straight", &terrain, open);
    assert!((over_ground(&frames[0], &frames[1]) - 20.0).abs() < 1e-6);
}

#[test]
fn following_stays_clear_of_every_sample() {
    for spec in ["procedural:mountains?width=331&height=262", "procedural:spikes?size=600"] {
        let terrain = plane(spec);
        let [dx, dy] = terrain.spacing_m;
        let frames = flown("follow", &terrain, tempo(2_000, None));
        for camera in &frames {
            // A triangle under the camera reaches no higher than its corners.
            let at = terrain.samples_from_world(camera.eye_m);
            let corner = |i: f64, j: f64| {
                let (x, y) = (at[0].floor() + i, at[1].floor() + j);
                let (x, y) = (terrain.origin_m[0] + x * dx, terrain.origin_m[1] + y * dy);
                terrain.ground_height_m(x, y).map_or(0.0, f64::from)
            };
            let ground = corner(0.0, 0.0).max(corner(1.0, 0.0)).max(corner(0.0, 1.0)).max(corner(1.0, 1.0));
            assert!(camera.eye_m.z >= ground + 5.0, "{spec}: {} over {ground}", camera.eye_m.z);
        }
    }
    // And close to it: over a plain exactly at its height.
    let plain = flown("follow", &plane("procedural:plain?size=100"), tempo(50, None));
    assert!(plain.iter().all(|c| (c.eye_m.z - 20.0).abs() < 1e-9));
}

#[test]
fn the_descent_sees_all_and_ends_on_the_ground() {
    let terrain = mountains();
    let [low, high] = terrain.extent_m();
    let frames = flown("orbit-to-ground", &terrain, tempo(600, None));
    let first = frames[0];
    assert!((first.pitch_deg + 90.0).abs() < 1e-9);
    let reach = first.eye_m.z * f64::to_radians(30.0).tan();
    assert!(reach > 0.5 * (high[0] - low[0]).max(high[1] - low[1]));
    let last = frames[599].eye_m;
    let ground = terrain.ground_height_m(last.x, last.y).map_or(0.0, f64::from);
    assert!(last.z - ground < 500.0, "{} over {ground}", last.z);
}

#[test]
fn teleports_come_every_second_and_nothing_lies_between() {
    let terrain = mountains();
    for speed in [None, Some(20_000.0)] {
        let course = Course::open("teleport", &terrain, tempo(301, speed)).unwrap();
        let mut jumps = Vec::new();
        for frame in 1..301 {
            let (before, now) = (course.at(frame - 1, 60.0).1, course.at(frame, 60.0).1);
            if course.jumped(frame) {
                jumps.push(frame);
                assert!(before.eye_m.distance(now.eye_m) > 100.0);
            } else {
                assert!(over_ground(&before, &now) <= speed.unwrap_or(0.0) / 60.0 + 1e-6);
            }
        }
        assert_eq!(jumps, [60, 120, 180, 240, 300]);
    }
    let still = flown("teleport", &terrain, tempo(60, None));
    assert!(still.windows(2).all(|p| p[0] == p[1]));
    let moving = flown("teleport", &terrain, tempo(60, Some(600.0)));
    let held = moving.windows(2).filter(|p| (over_ground(&p[0], &p[1]) - 10.0).abs() < 1e-6).count();
    assert!(held >= 57, "{held}");
}

#[test]
fn spinning_turns_once_in_two_seconds_on_the_spot() {
    let terrain = mountains();
    let frames = flown("spin", &terrain, tempo(121, Some(1e5)));
    assert!(frames.iter().all(|c| c.eye_m == frames[0].eye_m));
    assert!(frames[0].forward().distance(frames[120].forward()) < 1e-9);
    let turned: f64 =
        frames.windows(2).map(|p| (p[1].yaw_deg - p[0].yaw_deg + 180.0).rem_euclid(360.0) - 180.0).sum();
    assert!((turned - 360.0).abs() < 1e-6, "{turned}");
}

#[test]
fn short_paths_are_flown_back_and_forth() {
    let at = |t: f64| back_and_forth(t, 2.0);
    assert_eq!([0.0, 1.5, 2.0, 2.5, 4.0, 5.0].map(at), [0.0, 1.5, 2.0, 1.5, 0.0, 1.0]);
    assert_eq!(back_and_forth(3.0, 0.0), 0.0);
    let terrain = mountains();
    // 0.8 of 7,830 m at 3,132 m/s: two seconds there, and back.
    let frames = flown("straight", &terrain, tempo(241, Some(0.4 * 7_830.0)));
    for k in 0..120 {
        let (there, back) = (frames[k], frames[240 - k]);
        assert!(there.eye_m.distance(back.eye_m) < 1e-6);
        assert!((there.yaw_deg - back.yaw_deg).abs() < 1e-6, "the heading is kept");
    }
}

#[test]
fn neither_view_nor_axes_jump_over_the_pole() {
    let grid = open_terrain("procedural:planet?size=65", &ReadOptions::default()).unwrap();
    let terrain = Terrain::globe(vec![grid], Ellipsoid::WGS84).unwrap();
    let path = CameraPath::open("straight", &terrain, &tempo(1, None)).unwrap();
    let frames: Vec<_> = (0..=1000).map(|k| path.at(f64::from(k) / 1000.0, 60.0).1).collect();
    // The path does lead over it, and poses alone would turn around there.
    assert!(frames.iter().any(|c| c.eye_m.truncate().length() < 1e4));
    let poses = [[10.0, 89.9, 1e5, 0.0, 0.0], [-170.0, 89.9, 1e5, 0.0, 0.0]];
    let [a, b]: [DVec3; 2] = poses.map(|p| terrain.camera(p, 60.0).axes.x_axis);
    assert!(a.dot(b) < -0.99);
    let step = path.length_m() / 1000.0;
    for pair in frames.windows(2) {
        assert!(pair[0].forward().dot(pair[1].forward()) > 0.999);
        assert!(pair[0].axes.x_axis.dot(pair[1].axes.x_axis) > 0.999);
        assert!(pair[0].eye_m.distance(pair[1].eye_m) < 2.0 * step);
    }
}
