//! What a scene is turned into: the figures of six scenes, and that nothing left out changes a picture.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use tessclip::gpu::{Capacity, Gpu, Offscreen, Variant};
use tessclip::heights::{HeightGrid, PositionGrid};
use tessclip::measure::invariants::draw;
use tessclip::plan::{DEFAULT_MOST_BYTES, Plan};
use tessclip::{Camera, ColorMode, Factors, Prefilter, Renderer, Scene, Terrain};

const SIZE: [u32; 2] = [192, 108];

/// A grid with holes.
fn holed(spec: &str) -> HeightGrid {
    let mut grid = common::terrain(spec);
    let mut valid = vec![true; grid.width * grid.height];
    valid.iter_mut().skip(3_000).step_by(997).for_each(|v| *v = false);
    grid.valid = Some(valid);
    grid
}

fn plane(spec: &str) -> Terrain {
    Terrain::new(&common::terrain(spec), Prefilter::Subsample)
}

fn on(grid: &HeightGrid, base: &str) -> Terrain {
    Terrain::on(grid, base.parse().expect("a base"), Prefilter::Subsample).expect("it fits")
}

fn overhang(size: usize) -> Terrain {
    Terrain::sampled(PositionGrid::parse(&format!("overhang?size={size}")).expect("known"))
}

fn plan(terrain: &Terrain, scene: &Scene) -> Plan {
    let shape = scene.shape(terrain).expect("a shape");
    Plan::new(scene, terrain, shape, DEFAULT_MOST_BYTES, None)
}

/// Six scenes that differ in what they need; from little to much.
fn scenes() -> [(&'static str, Terrain, Scene); 6] {
    let flat = Scene { color: ColorMode::Elevation, cull: false, fog: false, ..Scene::default() };
    let morph = Scene { morph: true, ..Scene::default() };
    let holed_plane = Terrain::new(&holed("procedural:mountains?size=513"), Prefilter::Subsample);
    let mountains = common::terrain("procedural:mountains?size=513");
    [
        ("flat, unlit, heights only", plane("procedural:mountains?size=513"), flat),
        ("lit plane", plane("procedural:mountains?size=513"), Scene::default()),
        ("plane with nodata and morph", holed_plane, morph),
        ("region on an ellipsoid", on(&mountains, "wgs84"), Scene::default()),
        ("sampled overhang", overhang(513), Scene::default()),
        ("lit planet with nodata", on(&holed("procedural:planet?size=513"), "wgs84"), Scene::default()),
    ]
}

#[test]
fn six_scenes_take_so_many_passes_bindings_and_bytes() {
    let figures = scenes().map(|(name, terrain, scene)| {
        let totals = plan(&terrain, &scene).totals;
        assert_eq!(totals.texture_bytes, 0, "{name}");
        (name, totals.passes, totals.bindings, totals.buffer_bytes)
    });
    assert_eq!(
        figures,
        [
            ("flat, unlit, heights only", 5, 19, 12_419_900),
            ("lit plane", 6, 23, 12_452_668),
            ("plane with nodata and morph", 6, 23, 12_452_668),
            ("region on an ellipsoid", 6, 37, 19_844_560),
            ("sampled overhang", 6, 37, 21_179_280),
            ("lit planet with nodata", 6, 37, 71_424_440),
        ]
    );
    let (flat, planet) = (figures[0], figures[5]);
    assert!(flat.1 < planet.1 && flat.2 < planet.2 && flat.3 < planet.3);
}

#[test]
fn factors_by_error_take_so_many_more() {
    let terrain = plane("procedural:mountains?size=513");
    let figures = [(Some(1.0), None), (None, Some(100_000))].map(|(pixel_error, budget)| {
        let factors = Factors::ByError { pixel_error, budget };
        let plan = plan(&terrain, &Scene { factors, ..Scene::default() });
        let expands: Vec<_> =
            plan.passes.iter().map(|p| p.pass).filter(|name| name.starts_with("expand")).collect();
        assert_eq!(expands, ["expand_leaves"]);
        let totals = plan.totals;
        (totals.passes, totals.bindings, totals.buffer_bytes)
    });
    assert_eq!(figures, [(9, 45, 10_971_636), (10, 50, 5_867_956)]);
    let uniform = plan(&terrain, &Scene::default());
    for absent in ["deviations", "wishes", "weights", "grades", "fresh", "leaves"] {
        assert!(uniform.buffers.iter().all(|b| b.name != absent), "{absent}");
    }
    let why = uniform.left_out.iter().find(|l| l.feature == "factors by error").expect("left out");
    assert!(why.because.contains("MB saved"), "{}", why.because);
}

#[test]
fn each_thing_left_out_has_its_reason_and_is_not_in_the_plan() {
    let scenes = scenes();
    let out = |ix: usize| {
        let (_, terrain, scene) = &scenes[ix];
        plan(terrain, scene)
    };
    let because = |plan: &Plan, feature: &str| {
        plan.left_out.iter().find(|l| l.feature == feature).map(|l| l.because.clone())
    };
    let flat = out(0);
    let names: Vec<_> = flat.buffers.iter().map(|b| b.name).collect();
    for absent in ["block_bounds", "curve", "charts", "records", "shades"] {
        assert!(!names.contains(&absent), "{absent}");
        assert!(flat.passes.iter().all(|p| !p.bindings.contains(&absent)), "{absent}");
    }
    assert!(flat.passes.iter().all(|p| p.pass != "bound_blocks"));
    for feature in ["position texture", "block bounds"] {
        assert!(because(&flat, feature).is_some_and(|b| b.contains("MB saved")), "{feature}");
    }
    // 12 bytes less for each sample of the windows.
    let samples = flat.buffers.iter().find(|b| b.name == "samples").expect("present").bytes;
    let saved = format!("no position texture, {:.1} MB saved", samples as f64 * 3.0 / 1e6);
    assert_eq!(because(&flat, "position texture"), Some(format!("base is a plane: {saved}")));
    for feature in ["nodata", "geomorph", "normals", "wireframe", "frustum culling", "horizon culling"] {
        assert!(because(&flat, feature).is_some(), "{feature}");
    }
    let planet = out(5);
    for feature in ["position texture", "nodata", "block bounds", "normals", "frustum culling", "fog"] {
        assert_eq!(because(&planet, feature), None, "{feature}");
    }
    assert!(because(&planet, "horizon culling").is_some_and(|b| b.contains("voids")));
    assert!(because(&planet, "4-byte samples").is_some_and(|b| b.contains("MB saved")));
}

fn renderer(gpu: &Gpu, terrain: &Terrain, scene: &Scene, variant: Variant) -> Renderer {
    let shape = scene.shape(terrain).expect("a shape");
    let room = Capacity::worst_case(shape, variant.charts);
    let (device, queue) = (&gpu.device, &gpu.queue);
    Renderer::with_variant(device, queue, Offscreen::FORMAT, terrain, scene, room, variant).expect("drawable")
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_renderer_allocates_what_the_plan_says() {
    let gpu = common::gpu();
    let factors = Factors::ByError { pixel_error: Some(1.0), budget: Some(50_000) };
    let by_error = Scene { factors, ..Scene::default() };
    let more = ("plane by error", plane("procedural:mountains?size=513"), by_error);
    for (name, terrain, scene) in scenes().into_iter().chain([more]) {
        let scene = Scene { n: if scene.factors == Factors::Uniform { 63 } else { 127 }, ..scene };
        let plan = plan(&terrain, &scene);
        let renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene);
        let renderer = renderer.expect("drawable");
        let mut said: Vec<_> = plan.buffers.iter().map(|b| (b.name, b.bytes)).collect();
        let mut held = renderer.buffer_bytes();
        said.sort_unstable();
        held.sort_unstable();
        assert_eq!(held, said, "{name}");
        assert_eq!(renderer.gpu_bytes(), plan.totals.buffer_bytes, "{name}");
        assert_eq!(renderer.plan().passes, plan.passes, "{name}");
    }
}

/// The pictures of a scene as planned and with `change` made to its variant.
fn both(
    terrain: &Terrain,
    scene: &Scene,
    camera: &Camera,
    change: impl FnOnce(&mut Variant),
) -> [Vec<u8>; 2] {
    let gpu = common::gpu();
    let planned = plan(terrain, scene).variant;
    let mut changed = planned;
    change(&mut changed);
    assert_ne!(planned, changed, "nothing was changed");
    [planned, changed].map(|variant| {
        let target = Offscreen::new(&gpu.device, SIZE).expect("small");
        let mut renderer = renderer(&gpu, terrain, scene, variant);
        draw(&gpu, &mut renderer, &target, camera).expect("drawn");
        assert!(renderer.read_counters().expect("read").expand_x > 0, "nothing was drawn");
        target.read_rgba(&gpu.device, &gpu.queue).expect("read")
    })
}

fn same(terrain: &Terrain, scene: &Scene, camera: &Camera, change: impl FnOnce(&mut Variant)) {
    let [planned, full] = both(terrain, scene, camera, change);
    let colors: std::collections::HashSet<_> = planned.chunks(4).collect();
    assert!(colors.len() > 16, "the picture is empty");
    let wrong = planned.chunks(4).zip(full.chunks(4)).filter(|(a, b)| a != b).count();
    assert_eq!(wrong, 0, "pixels that differ");
}

fn low_camera() -> Camera {
    let eye_m = glam::DVec3::new(3_900.0, -500.0, 4_500.0);
    Camera { eye_m, yaw_deg: 0.0, pitch_deg: -35.0, fov_deg: 60.0, ..Camera::default() }
}

fn small() -> Scene {
    Scene { n: 63, drop_fine_levels: false, ..Scene::default() }
}

/// A plane, a planet and positions, each with a camera.
fn grounds() -> [(Terrain, Camera); 3] {
    let planet = on(&common::terrain("procedural:planet?size=257"), "wgs84");
    let above = planet.camera([10.0, 20.0, 2_000_000.0, 30.0, -50.0], 60.0);
    let wave = overhang(257);
    let over = wave.overview(60.0);
    [(plane("procedural:mountains?seed=3&size=257"), low_camera()), (planet, above), (wave, over)]
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_test_for_voids_changes_nothing_where_there_are_none() {
    for (terrain, camera) in grounds() {
        same(&terrain, &small(), &camera, |v| v.has_voids = true);
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn fog_of_no_density_is_no_fog() {
    for (terrain, camera) in grounds() {
        same(&terrain, &Scene { fog: false, ..small() }, &camera, |v| v.fog = true);
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_single_level_has_nothing_to_morph_into() {
    let scene = Scene { levels: Some(1), ..small() };
    let (terrain, camera) = grounds()[0].clone();
    let inside = Camera { eye_m: glam::DVec3::new(3_900.0, 3_000.0, 4_500.0), pitch_deg: -80.0, ..camera };
    same(&terrain, &scene, &inside, |v| v.morph = true);
    let few = overhang(62);
    let over = few.overview(60.0);
    same(&few, &scene, &over, |v| v.morph = true);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn culling_and_bounds_change_nothing_that_is_seen() {
    for (terrain, camera) in grounds() {
        let all = Scene { cull: false, ..small() };
        same(&terrain, &all, &camera, |v| v.bounds = true);
        same(&terrain, &all, &camera, |v| (v.bounds, v.cull) = (true, true));
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn what_lies_behind_the_horizon_is_hidden_anyway() {
    let (terrain, above) = grounds()[1].clone();
    let near = terrain.camera([40.0, 5.0, 30_000.0, 100.0, -5.0], 60.0);
    for camera in [above, near] {
        same(&terrain, &small(), &camera, |v| v.horizon = false);
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_height_ramp_needs_no_normals() {
    let scene = Scene { color: ColorMode::Elevation, ..small() };
    let (terrain, camera) = grounds()[0].clone();
    same(&terrain, &scene, &camera, |v| v.normals = true);
    same(&terrain, &Scene { wireframe: true, ..scene }, &camera, |v| v.normals = true);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn samples_of_two_bytes_arrive_as_those_of_four() {
    let mut grid = common::terrain("procedural:mountains?seed=3&size=257");
    grid.heights_m.iter_mut().for_each(|h| *h = h.round());
    let whole = Terrain::new(&grid, Prefilter::Subsample);
    same(&whole, &small(), &low_camera(), |v| v.short = false);
    let (planet, above) = grounds()[1].clone();
    same(&planet, &small(), &above, |v| v.short = false);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn leaving_out_what_is_needed_does_change_the_picture() {
    let (terrain, camera) = grounds()[0].clone();
    let differ = |scene: &Scene, change: &dyn Fn(&mut Variant)| {
        let [planned, without] = both(&terrain, scene, &camera, change);
        assert!(planned != without, "the pictures are the same");
    };
    differ(&small(), &|v| v.fog = false);
    differ(&small(), &|v| v.normals = false);
    differ(&Scene { morph: true, ..small() }, &|v| v.morph = false);
}
