//! Expansion with any factors: the twin alone, then the GPU against the twin.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use tessclip::clipmap::{ClipmapShape, Rect, Windows};
use tessclip::gpu::{Offscreen, PatchRecord};
use tessclip::measure::invariants::draw;
use tessclip::quads::{BlockKind, OuterSpan, Patch};
use tessclip::reference::{Placement, expand, unpack_normal};
use tessclip::{Camera, Prefilter, Renderer, Scene, Terrain};

fn spans() -> impl Strategy<Value = OuterSpan> {
    (0..16_u32, 0..=16_u32, 0..=4_u32).prop_map(|(from, len, log2)| OuterSpan { from, to: from + len, log2 })
}

fn patch_strategy() -> impl Strategy<Value = Patch> {
    (1..=16_i32, 1..=16_i32, prop::array::uniform4(spans())).prop_map(|(w, h, outer)| {
        let rect = Rect { lo: [2, 3], hi: [2 + w, 3 + h] };
        let clip = |s: OuterSpan, cells: i32| {
            let to = s.to.min(u32::try_from(cells).expect("positive"));
            if s.from >= to || s.log2 == 0 { OuterSpan::default() } else { OuterSpan { to, ..s } }
        };
        let outer = [clip(outer[0], w), clip(outer[1], w), clip(outer[2], h), clip(outer[3], h)];
        Patch { chart: 0, level: 5, kind: BlockKind::M, rect, outer, by_error: None }
    })
}

fn terrain() -> Terrain {
    // 19 cells of level 5 on each side.
    Terrain::new(&common::terrain("procedural:mountains?size=641"), Prefilter::LowPass)
}

fn placement(terrain: &Terrain) -> Placement {
    let lattice = terrain.source.lattice();
    let shape = ClipmapShape::new(63, 6, lattice).expect("in range");
    Placement {
        // All finer levels inactive: level 5 is the finest, so every vertex is its own level's.
        windows: Windows::place(shape, lattice, [320.0, 320.0], 5),
        anchor: [0, 0],
        anchor_height_m: 0.0,
        spacing_m: [1.0, 1.0],
        eye_samples: [0.0, 0.0],
        morph: false,
        fades: Default::default(),
    }
}

proptest! {
    #[test]
    fn any_factors_tile_the_patch_without_degenerate_triangles(patch in patch_strategy()) {
        let terrain = terrain_once();
        let e = expand(&placement(terrain), terrain.source.as_ref(), &patch);
        prop_assert_eq!(e.vertices.len() as u32, patch.vertex_count());
        prop_assert_eq!(e.triangles.len() as u32, patch.triangle_count());
        let mut area = 0;
        let mut used = vec![false; e.base.len()];
        for t in &e.triangles {
            let [a, b, c] = t.map(|ix| e.base[ix as usize]);
            let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            prop_assert!(cross > 0, "{:?}", t);
            area += cross;
            t.iter().for_each(|ix| used[*ix as usize] = true);
        }
        let [w, h] = patch.cells();
        prop_assert_eq!(area, i32::try_from(2 * w * h * 32 * 32).expect("small"));
        prop_assert!(used.iter().all(|u| *u), "a vertex is not used");
    }
}

fn terrain_once() -> &'static Terrain {
    static TERRAIN: std::sync::OnceLock<Terrain> = std::sync::OnceLock::new();
    TERRAIN.get_or_init(terrain)
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_gpu_expands_any_factors_as_the_twin_does() {
    let gpu = common::gpu();
    let terrain = terrain_once();
    let scene = Scene { n: 63, levels: Some(6), ..Scene::default() };
    let mut renderer =
        Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, &scene).expect("drawable");
    let target = Offscreen::new(&gpu.device, [32, 32]).expect("small");
    // So high that only the coarsest level is active.
    let eye = glam::DVec3::new(9_600.0, 9_600.0, 400_000.0);
    let camera = Camera { eye_m: eye, yaw_deg: 0.0, pitch_deg: -90.0, fov_deg: 60.0, ..Camera::default() };
    draw(&gpu, &mut renderer, &target, &camera).expect("drawable");
    let placement = renderer.placement().expect("prepared").clone();
    assert_eq!(placement.windows.finest, 5);
    let largest = std::cell::Cell::new(0);
    let mut runner = TestRunner::new(Config { cases: 64, failure_persistence: None, ..Config::default() });
    runner
        .run(&prop::collection::vec(patch_strategy(), 1..5), |list| {
            let mut records = Vec::new();
            let (mut vertices, mut indices) = (0, 0);
            for patch in &list {
                records.push(PatchRecord {
                    first_vertex: vertices,
                    first_index: indices,
                    ..PatchRecord::of(patch)
                });
                prop_assert_eq!(records.last().map(PatchRecord::patch), Some(*patch));
                vertices += patch.vertex_count();
                indices += 3 * patch.triangle_count();
                largest
                    .set(patch.outer.iter().map(|s| (s.to - s.from) << s.log2).fold(largest.get(), u32::max));
            }
            let (got_vertices, got_indices) = renderer.expand_only(&records).expect("expanded");
            for (patch, record) in list.iter().zip(&records) {
                let twin = expand(&placement, terrain.source.as_ref(), patch);
                for (k, v) in twin.vertices.iter().enumerate() {
                    let got = got_vertices[record.first_vertex as usize + k];
                    prop_assert_eq!(got.position, v.position);
                    prop_assert_eq!(got.packed >> 24, v.packed >> 24);
                    let (a, b) = (
                        unpack_normal(got.packed),
                        placement.normal(terrain.source.as_ref(), 5, twin.base[k]),
                    );
                    let cosine: f32 = (0..3).map(|i| a[i] * b[i]).sum();
                    prop_assert!(cosine > 0.999_99, "normal is off: {:?} {:?}", a, b);
                }
                let triples = |list: Vec<u32>| {
                    let mut t: Vec<[u32; 3]> = list
                        .chunks_exact(3)
                        .map(|c| {
                            let k = (0..3).min_by_key(|&i| c[i]).unwrap_or(0);
                            [c[k], c[(k + 1) % 3], c[(k + 2) % 3]]
                        })
                        .collect();
                    t.sort_unstable();
                    t
                };
                let from = record.first_index as usize;
                let count = 3 * patch.triangle_count() as usize;
                let wanted: Vec<u32> =
                    twin.triangles.iter().flatten().map(|ix| ix + record.first_vertex).collect();
                prop_assert_eq!(triples(got_indices[from..from + count].to_vec()), triples(wanted));
            }
            Ok(())
        })
        .expect("the GPU agrees with the twin");
    assert!(largest.get() > 64, "no factor beyond the hardware limit was tried");
}
