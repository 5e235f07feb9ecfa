//! What lies in the toroidal windows after a flight: samples and bounds, against the pyramid itself.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use tessclip::clipmap::Rect;
use tessclip::gpu::Offscreen;
use tessclip::measure::invariants::draw;
use tessclip::pyramid::VOID;
use tessclip::{Camera, Prefilter, Renderer, Scene, Terrain};

/// A renderer after a winding flight with teleports, over data with voids.
fn flown(n: u32) -> Renderer {
    let gpu = common::gpu();
    let mut grid = common::terrain("procedural:mountains?width=300&height=211");
    let mut valid = vec![true; grid.width * grid.height];
    valid.iter_mut().skip(5_000).step_by(97).for_each(|v| *v = false);
    grid.valid = Some(valid);
    let terrain = Terrain::new(&grid, Prefilter::LowPass);
    let scene = Scene { n, ..Scene::default() };
    let mut renderer =
        Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene).expect("drawable");
    let target = Offscreen::new(&gpu.device, [32, 32]).expect("small");
    for k in 0..40 {
        let t = f64::from(k);
        let jump = if k % 13 == 0 { 4_000.0 } else { 0.0 };
        let eye_m = glam::DVec3::new(900.0 + 190.0 * t - jump, 6_000.0 - 133.0 * t + jump, 3_000.0);
        let camera = Camera { eye_m, yaw_deg: 0.0, pitch_deg: -20.0, fov_deg: 60.0, ..Camera::default() };
        draw(&gpu, &mut renderer, &target, &camera).expect("drawn");
    }
    renderer
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn displace_samples_leaves_every_loaded_sample_at_its_toroidal_address() {
    for n in [15_u32, 63] {
        let renderer = flown(n);
        let samples = renderer.read_samples().expect("read");
        let windows = &renderer.placement().expect("prepared").windows;
        let side = i32::try_from(n).expect("small") + 1;
        for level in 0..windows.shape.levels() {
            let area = windows.loaded(level);
            for y in area.lo[1]..=area.hi[1] {
                for x in area.lo[0]..=area.hi[0] {
                    let at = (i32::try_from(level).expect("small") * side + y.rem_euclid(side)) * side
                        + x.rem_euclid(side);
                    let got = samples[usize::try_from(at).expect("positive")];
                    assert_eq!(
                        got.to_bits(),
                        renderer.source().sample(level, [x, y]).to_bits(),
                        "{level} {x} {y}"
                    );
                }
            }
        }
        assert!(samples.iter().all(|h| h.is_finite()));
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn bound_blocks_are_the_lowest_and_highest_loaded_samples() {
    for n in [15_u32, 63] {
        let renderer = flown(n);
        let bounds = renderer.read_block_bounds().expect("read");
        let windows = &renderer.placement().expect("prepared").windows;
        let side = (i32::try_from(n).expect("small") + 1) / 8;
        for level in 0..windows.shape.levels() {
            let area = windows.loaded(level);
            for by in area.lo[1].div_euclid(16)..=area.hi[1].div_euclid(16) {
                for bx in area.lo[0].div_euclid(16)..=area.hi[0].div_euclid(16) {
                    let block = Rect { lo: [bx * 16, by * 16], hi: [bx * 16 + 16, by * 16 + 16] };
                    let mut held = Vec::new();
                    renderer.source().read(level, block.intersect(area), &mut held);
                    held.retain(|h| *h != VOID);
                    let low = held.iter().copied().fold(VOID, f32::min);
                    let high = held.iter().copied().fold(-VOID, f32::max);
                    let at = (i32::try_from(level).expect("small") * side + by.rem_euclid(side)) * side
                        + bx.rem_euclid(side);
                    assert_eq!(
                        bounds[usize::try_from(at).expect("positive")],
                        [low, high],
                        "{level} {bx} {by}"
                    );
                }
            }
        }
    }
}
