//! Room for the mesh: overflow is counted, never silent, and mended by growing.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use tessclip::gpu::{Capacity, Offscreen};
use tessclip::measure::Mesh;
use tessclip::measure::invariants::draw;
use tessclip::{Camera, Prefilter, Renderer, Scene, Terrain};

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn too_little_room_is_reported_and_grows_to_the_same_mesh() {
    let gpu = common::gpu();
    let terrain = Terrain::new(&common::terrain("procedural:dunes?size=257"), Prefilter::Subsample);
    let scene = Scene { n: 63, cull: false, ..Scene::default() };
    let target = Offscreen::new(&gpu.device, [64, 64]).expect("small");
    let eye_m = glam::DVec3::new(4_000.0, 4_000.0, 300.0);
    let camera = Camera { eye_m, yaw_deg: 10.0, pitch_deg: -20.0, fov_deg: 60.0, ..Camera::default() };
    let with = |capacity| {
        Renderer::with_capacity(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene, capacity)
            .expect("drawable")
    };
    let mut roomy = with(Capacity { vertices: 1 << 20, indices: 1 << 20 });
    draw(&gpu, &mut roomy, &target, &camera).expect("drawn");
    let whole = roomy.read_mesh().expect("read");
    assert_eq!(whole.counters.patches_dropped, 0);
    assert!(!roomy.grow(&whole.counters).expect("fine"));
    for capacity in [Capacity { vertices: 1, indices: 3 }, Capacity { vertices: 5_000, indices: 1 << 20 }] {
        let mut tight = with(capacity);
        draw(&gpu, &mut tight, &target, &camera).expect("drawn");
        let counters = tight.read_counters().expect("read");
        assert!(counters.patches_dropped > 0);
        assert_eq!(counters.patches_dropped + counters.expand_x, counters.patches_visible);
        assert!(counters.index_count <= capacity.indices);
        assert_eq!(counters.vertices_needed, whole.counters.vertices_needed);
        assert!(tight.grow(&counters).expect("grows"));
        draw(&gpu, &mut tight, &target, &camera).expect("drawn");
        let grown = tight.read_mesh().expect("read");
        assert_eq!(grown.counters.patches_dropped, 0);
        assert_eq!((&grown.vertices, &grown.triangles), (&whole.vertices, &whole.triangles));
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_frame_that_is_prepared_and_never_recorded_loses_nothing() {
    let gpu = common::gpu();
    let terrain = Terrain::new(&common::terrain("procedural:dunes?size=257"), Prefilter::Subsample);
    let scene = Scene { n: 31, cull: false, ..Scene::default() };
    let target = Offscreen::new(&gpu.device, [64, 64]).expect("small");
    let at = |x: f64| Camera {
        eye_m: glam::DVec3::new(x, 3_000.0, 200.0),
        yaw_deg: 0.0,
        pitch_deg: -20.0,
        fov_deg: 60.0,
        ..Camera::default()
    };
    let make =
        || Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene).expect("drawable");
    let mut straight = make();
    draw(&gpu, &mut straight, &target, &at(4_000.0)).expect("drawn");
    let mut wandering = make();
    wandering.prepare(&at(1_000.0), target.size).expect("prepared");
    draw(&gpu, &mut wandering, &target, &at(2_000.0)).expect("drawn");
    wandering.prepare(&at(6_000.0), target.size).expect("prepared");
    draw(&gpu, &mut wandering, &target, &at(4_000.0)).expect("drawn");
    let bytes = |r: &Renderer| bytemuck::cast_slice::<_, u8>(&r.read_mesh().expect("read").vertices).to_vec();
    assert!(Mesh::from_gpu(&straight.read_mesh().expect("read")).triangles.len() > 100);
    assert_eq!(bytes(&straight), bytes(&wandering));
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn standing_still_uploads_no_control_data_and_a_shift_at_most_64_bytes_a_level() {
    let gpu = common::gpu();
    let terrain = Terrain::new(&common::terrain("procedural:mountains?size=513"), Prefilter::Subsample);
    let scene = Scene { n: 31, ..Scene::default() };
    let target = Offscreen::new(&gpu.device, [64, 64]).expect("small");
    let mut renderer =
        Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene).expect("drawable");
    let mut frame = |x: f64, y: f64| {
        let eye_m = glam::DVec3::new(x, y, 3_000.0);
        let camera = Camera { eye_m, yaw_deg: 0.0, pitch_deg: -20.0, fov_deg: 60.0, ..Camera::default() };
        let upload = renderer.prepare(&camera, target.size).expect("prepared");
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        renderer.record_mesh(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        upload
    };
    frame(7_500.0, 7_500.0);
    let still = frame(7_500.0, 7_500.0);
    assert_eq!((still.control_bytes, still.height_bytes, still.shifts), (0, 0, 0));
    let mut shifted = 0;
    for k in 0..80 {
        let t = f64::from(k);
        let u = frame(7_500.0 + 37.0 * t, 7_500.0 - 53.0 * t);
        assert!(u.control_bytes <= 64 * u.shifts, "{u:?}");
        assert!(u.height_bytes <= 4 * u.height_bound_samples, "{u:?}");
        shifted += u.shifts;
    }
    assert!(shifted > 40);
}
