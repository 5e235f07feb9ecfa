#![allow(clippy::unwrap_used, reason = "a failed expectation is a failed test")]

mod motion;
mod turning;

use glam::DVec3;
use tessclip::heights::PositionGrid;
use tessclip::surface::Base;
use tessclip::{Camera, HeightGrid, Prefilter, Terrain};

use super::{Flyer, Ground, Held};
use crate::viewer::tests::{globe, in_degrees, mountains, plane, read, sampled};

/// Seconds of a frame.
const FRAME_S: f64 = 1.0 / 60.0;
const FORWARD: Held = Held {
    forward: true,
    back: false,
    left: false,
    right: false,
    up: false,
    down: false,
    fast: false,
    slow: false,
};
const FAST: Held = Held { fast: true, ..FORWARD };
const UP: Held = Held { forward: false, up: true, ..FORWARD };
const DOWN: Held = Held { forward: false, down: true, ..FORWARD };
const NONE: Held = Held { forward: false, ..FORWARD };

fn tunnel() -> Terrain {
    let base = "cylinder:2000,inside".parse().unwrap();
    Terrain::on(&read("procedural:dunes?size=129"), base, Prefilter::Subsample).unwrap()
}

/// Terrains with two poses high above the ground each.
fn worlds() -> Vec<(Terrain, [[f64; 5]; 2])> {
    vec![
        (mountains(), [[2_000.0, 2_000.0, 4_500.0, 30.0, -20.0], [5_000.0, 4_000.0, 5_200.0, -170.0, -60.0]]),
        (in_degrees(), [[8.02, 46.02, 6_000.0, 30.0, -20.0], [8.05, 46.04, 5_000.0, 100.0, -90.0]]),
        (globe(), [[10.0, 30.0, 1e6, 20.0, -30.0], [-100.0, -40.0, 5e5, -170.0, -60.0]]),
        (sampled(), [[-2_000.0, 1_000.0, 4_000.0, 10.0, -20.0], [3_000.0, -2_000.0, 5_000.0, 100.0, -50.0]]),
        (tunnel(), [[500.0, 1_000.0, 500.0, 0.0, -10.0], [900.0, 2_000.0, 700.0, 40.0, -30.0]]),
    ]
}

/// Height above bilinear ground on a plane, above the nearest sample on curved surfaces, above all of sampled
/// positions; metres.
fn above(terrain: &Terrain, p: DVec3) -> Option<f64> {
    if let Some(curved) = &terrain.curved {
        if curved.points.is_some() {
            return Some(p.z - 1_700.0);
        }
        let (foot, ground) = curved.ground(p);
        return ground.map(|g| foot.height_m - f64::from(g));
    }
    let (at, last) = (terrain.samples_from_world(p), terrain.source.lattice().last);
    if (0..2).any(|a| at[a] < 0.0 || at[a] > f64::from(last[a])) {
        return None;
    }
    let node = [0, 1].map(|a| at[a].floor().min(f64::from(last[a]) - 1.0));
    let part = [0, 1].map(|a| at[a] - node[a]);
    let corner = |i: f64, j: f64| {
        let x = terrain.origin_m[0] + (node[0] + i) * terrain.spacing_m[0];
        let y = terrain.origin_m[1] + (node[1] + j) * terrain.spacing_m[1];
        f64::from(terrain.ground_height_m(x, y).unwrap())
    };
    let mix = |a: f64, b: f64, s: f64| a + (b - a) * s;
    let south = mix(corner(0.0, 0.0), corner(1.0, 0.0), part[0]);
    let north = mix(corner(0.0, 1.0), corner(1.0, 1.0), part[0]);
    Some(p.z - mix(south, north, part[1]))
}

fn standing(terrain: &Terrain, pose: [f64; 5]) -> Flyer {
    let mut flyer = Flyer::new(terrain, &terrain.camera(pose, 60.0));
    flyer.set_pose(pose);
    flyer
}

fn step(flyer: &mut Flyer, terrain: &Terrain, dt_s: f64, held: Held) -> bool {
    flyer.step(dt_s, &held, terrain, &Ground { above: &|p| above(terrain, p) })
}

/// Lets go of all keys; true when the camera comes to rest within five seconds.
fn rests(flyer: &mut Flyer, terrain: &Terrain) -> bool {
    (0..300).any(|_| !step(flyer, terrain, FRAME_S, NONE))
}

fn eye(flyer: &Flyer, terrain: &Terrain) -> DVec3 {
    flyer.camera(terrain, 60.0).eye_m
}

fn height(flyer: &Flyer, terrain: &Terrain) -> Option<f64> {
    above(terrain, eye(flyer, terrain))
}

fn degrees_between(a: &Camera, b: &Camera) -> f64 {
    a.forward().angle_between(b.forward()).to_degrees()
}
