//! Frustum and horizon culling on curved surfaces: the picture is the same bytes with and without them.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use tessclip::gpu::{Gpu, Offscreen};
use tessclip::heights::PositionGrid;
use tessclip::measure::invariants::draw;
use tessclip::surface::Ellipsoid;
use tessclip::{Camera, Prefilter, Renderer, Scene, Terrain};

const SIZE: [u32; 2] = [320, 180];

/// Differing bytes over all cameras, and patches drawn with and without culling.
fn compare(gpu: &Gpu, terrain: &Terrain, n: u32, morph: bool, cameras: &[Camera]) -> (usize, [u64; 2]) {
    let target = Offscreen::new(&gpu.device, SIZE).unwrap();
    let make = |cull| {
        let scene = Scene { n, morph, cull, drop_fine_levels: false, ..Scene::default() };
        Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, &scene).unwrap()
    };
    let (mut with, mut without) = (make(true), make(false));
    let mut patches = [0, 0];
    let mut differing = 0;
    for camera in cameras {
        let mut picture = |renderer: &mut Renderer, k: usize| {
            draw(gpu, renderer, &target, camera).unwrap();
            let counters = renderer.read_counters().unwrap();
            assert_eq!(counters.patches_dropped, 0);
            patches[k] += u64::from(counters.patches_visible);
            target.read_rgba(&gpu.device, &gpu.queue).unwrap()
        };
        let (a, b) = (picture(&mut with, 0), picture(&mut without, 1));
        let wrong = a.iter().zip(&b).filter(|(x, y)| x != y).count();
        if wrong > 0 {
            eprintln!("{wrong} bytes differ: {camera:?}");
        }
        differing += wrong;
    }
    (differing, patches)
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn on_a_planet() {
    let gpu = common::gpu();
    let terrain =
        Terrain::globe(vec![common::terrain("procedural:planet?size=257")], Ellipsoid::WGS84).unwrap();
    let mut cameras = Vec::new();
    for (k, height) in [200.0, 8e3, 9e4, 1e6, 2e7, 1e9].into_iter().enumerate() {
        for (j, [lon, lat]) in
            [[0.0, 90.0], [45.0, 35.26], [180.0, 0.0], [-100.0, 44.0], [12.0, -71.0]].into_iter().enumerate()
        {
            let ground = terrain.camera([lon, lat, 0.0, 0.0, 0.0], 60.0);
            let curved = terrain.curved.as_ref().unwrap();
            let over = f64::from(curved.ground(ground.eye_m).1.unwrap()).max(0.0) + 900.0;
            let pitch = [-2.0, -30.0, -88.0, 5.0][(k + j) % 4];
            cameras.push(terrain.camera([lon, lat, over + height, 77.0 * j as f64, pitch], 60.0));
        }
    }
    let (differing, [with, without]) = compare(&gpu, &terrain, 63, false, &cameras);
    println!("patches {with} of {without}");
    assert_eq!(differing, 0);
    assert!(with * 2 < without, "culling must be worth something: {with} of {without}");
    let (differing, _) = compare(&gpu, &terrain, 63, true, &cameras[..8]);
    assert_eq!(differing, 0, "morphing");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn on_other_surfaces() {
    let gpu = common::gpu();
    let grid = common::terrain("procedural:mountains?width=301&height=200");
    for base in ["torus:4000,1200", "cylinder:4000", "cylinder:4000,inside", "sphere:20000", "wgs84"] {
        let terrain = Terrain::on(&grid, base.parse().unwrap(), Prefilter::Subsample).unwrap();
        let mut cameras = vec![terrain.overview(60.0)];
        for k in 0..12 {
            let (x, y) = (f64::from(k * 757 % 9000), f64::from(k * 1151 % 6000));
            cameras.push(terrain.camera([x, y, 3_200.0, f64::from(k) * 50.0, -25.0], 60.0));
        }
        let (differing, [with, without]) = compare(&gpu, &terrain, 31, false, &cameras);
        println!("{base}: patches {with} of {without}");
        assert_eq!(differing, 0, "{base}");
        assert!(with < without, "{base}");
    }
    let terrain = Terrain::sampled(PositionGrid::parse("overhang?size=257").unwrap());
    let mut cameras = vec![terrain.overview(60.0)];
    for k in 0..12 {
        let (x, y) = (f64::from(k * 757 % 9000), f64::from(k * 1151 % 9000));
        cameras.push(terrain.camera([x, y, 2_000.0, f64::from(k) * 50.0, -25.0], 60.0));
    }
    let (differing, [with, without]) = compare(&gpu, &terrain, 31, false, &cameras);
    println!("overhang: patches {with} of {without}");
    assert_eq!(differing, 0);
}
