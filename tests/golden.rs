//! A few small pictures. A missing golden fails; TESSCLIP_BLESS=1 writes them, on purpose only.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use std::path::Path;

use tessclip::gpu::Offscreen;
use tessclip::heights::PositionGrid;
use tessclip::measure::invariants::draw;
use tessclip::surface::Ellipsoid;
use tessclip::{Camera, ColorMode, Prefilter, Renderer, Scene, Terrain};

const SIZE: [u32; 2] = [192, 108];

/// Pixels of which any channel differs by more than `tolerance`; `None` where the sizes do.
fn wrong_pixels(a: &[u8], b: &[u8], tolerance: u8) -> Option<usize> {
    (a.len() == b.len()).then(|| {
        a.chunks(4)
            .zip(b.chunks(4))
            .filter(|(p, q)| p.iter().zip(*q).any(|(x, y)| x.abs_diff(*y) > tolerance))
            .count()
    })
}

fn compare(name: &str, got: &[u8]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{name}.png"));
    if std::env::var("TESSCLIP_BLESS").is_ok_and(|v| v == "1") {
        image::save_buffer(&path, got, SIZE[0], SIZE[1], image::ColorType::Rgba8).expect("written");
    }
    let golden = image::open(&path)
        .unwrap_or_else(|e| panic!("{}: {e}: the golden picture is missing", path.display()));
    let wrong = wrong_pixels(got, golden.to_rgba8().as_raw(), 6);
    // Drivers may rasterise an edge the other way round: a few pixels, never a patch.
    if wrong.is_none_or(|w| w > 30) {
        let out = std::env::temp_dir().join(format!("tessclip-{name}-got.png"));
        image::save_buffer(&out, got, SIZE[0], SIZE[1], image::ColorType::Rgba8).expect("written");
        panic!("{name}: {wrong:?} wrong pixels of 30 allowed; see {}", out.display());
    }
}

fn render(scene: &Scene) -> Vec<u8> {
    let terrain =
        Terrain::new(&common::terrain("procedural:mountains?seed=3&size=257"), Prefilter::Subsample);
    let eye_m = glam::DVec3::new(3_900.0, -500.0, 4_500.0);
    picture(&terrain, scene, &Camera { eye_m, pitch_deg: -35.0, ..Camera::default() })
}

fn picture(terrain: &Terrain, scene: &Scene, camera: &Camera) -> Vec<u8> {
    let gpu = common::gpu();
    let mut renderer =
        Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, scene).expect("drawable");
    let target = Offscreen::new(&gpu.device, SIZE).expect("small");
    draw(&gpu, &mut renderer, &target, camera).expect("drawn");
    target.read_rgba(&gpu.device, &gpu.queue).expect("read")
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_earth_looks_as_it_did_from_four_distances() {
    let Some(file) = common::data("etopo/etopo5_int16.tif") else { return };
    let terrain = Terrain::globe(vec![common::terrain(&file)], Ellipsoid::WGS84).expect("a globe");
    let poses = [
        ("earth-20000-km", [10.0, 30.0, 2e7, 0.0, -90.0]),
        ("earth-1200-km", [8.0, 44.0, 1.2e6, 10.0, -50.0]),
        ("earth-40-km", [86.0, 26.5, 4e4, 10.0, -12.0]),
        ("earth-100-m", [86.9, 28.0, 6_200.0, 20.0, -1.0]),
    ];
    for (name, pose) in poses {
        compare(name, &picture(&terrain, &Scene::default(), &terrain.camera(pose, 60.0)));
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn other_bases_look_as_they_did() {
    let grid = common::terrain("procedural:mountains?size=257");
    let on = |base: &str| {
        Terrain::on(&grid, base.parse().expect("a base"), Prefilter::Subsample).expect("it fits")
    };
    let planet = Terrain::globe(vec![common::terrain("procedural:planet?size=257")], Ellipsoid::WGS84);
    let overhang = PositionGrid::parse("overhang?size=257").expect("known");
    for (name, terrain) in [
        ("planet", planet.expect("a globe")),
        ("torus", on("torus:5000,1700")),
        ("cylinder-inside", on("cylinder:9000,inside")),
        ("overhang", Terrain::sampled(overhang)),
    ] {
        let scene = Scene { n: 63, ..Scene::default() };
        compare(name, &picture(&terrain, &scene, &terrain.overview(60.0)));
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn shaded_mountains_look_as_they_did() {
    let got = render(&Scene { n: 63, ..Scene::default() });
    compare("shaded", &got);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn levels_in_wireframe_look_as_they_did() {
    let scene = Scene {
        n: 31,
        color: ColorMode::Levels,
        wireframe: true,
        drop_fine_levels: false,
        ..Scene::default()
    };
    let got = render(&scene);
    compare("levels-wireframe", &got);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_same_input_gives_the_same_bytes() {
    let scene = Scene { n: 63, ..Scene::default() };
    assert_eq!(render(&scene), render(&scene));
}

#[test]
fn the_comparator_can_fail() {
    let a = vec![10_u8; 16];
    let mut b = a.clone();
    assert_eq!(wrong_pixels(&a, &b, 6), Some(0));
    b[5] = 17;
    assert_eq!(wrong_pixels(&a, &b, 6), Some(1));
    assert_eq!(wrong_pixels(&a, &b[..12], 6), None);
}
