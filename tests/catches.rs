//! Every checker is shown failing: a mesh with one fault is caught, whichever fault it is.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use tessclip::gpu::{GpuMesh, Offscreen};
use tessclip::measure::invariants::{CheckRow, Effort, check_gpu, draw, gpu_faults, sorted_triangles};
use tessclip::measure::{Faults, Mesh, check_mesh};
use tessclip::quads::{OuterSpan, Patch, patches};
use tessclip::reference::Placement;
use tessclip::{Camera, Prefilter, Renderer, Scene, Terrain};

struct Case {
    terrain: Terrain,
    placement: Placement,
    mesh: GpuMesh,
}

fn case() -> Case {
    let gpu = common::gpu();
    let terrain =
        Terrain::new(&common::terrain("procedural:mountains?width=203&height=150"), Prefilter::LowPass);
    let scene = Scene { n: 31, cull: false, ..Scene::default() };
    let mut renderer =
        Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene).expect("drawable");
    let target = Offscreen::new(&gpu.device, [32, 32]).expect("small");
    let ground = terrain.ground_height_m(3_000.0, 2_250.0).map_or(0.0, f64::from);
    let eye_m = glam::DVec3::new(3_000.0, 2_250.0, ground + 20.0);
    draw(
        &gpu,
        &mut renderer,
        &target,
        &Camera { eye_m, yaw_deg: 0.0, pitch_deg: 0.0, fov_deg: 60.0, ..Camera::default() },
    )
    .expect("drawn");
    let placement = renderer.placement().expect("prepared").clone();
    Case { placement, mesh: renderer.read_mesh().expect("read"), terrain }
}

impl Case {
    fn faults(&self, change: impl FnOnce(&mut GpuMesh)) -> Faults {
        let mut mesh = self.mesh.clone();
        change(&mut mesh);
        gpu_faults(&mesh, &self.placement, &self.terrain)
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_whole_mesh_passes_and_each_fault_is_caught() {
    let case = case();
    assert!(case.faults(|_| ()).none(), "{:?}", case.faults(|_| ()));

    let inner = case.mesh.patches[case.mesh.patches.len() / 2];
    let (first, count) = (inner.first_index as usize / 3, inner.patch().triangle_count() as usize);
    let dropped = case.faults(|m| drop(m.triangles.drain(first..first + count)));
    assert!(dropped.open_edges > 0 && dropped.area_error > 1e-6, "{dropped:?}");

    let flipped = case.faults(|m| m.triangles[first].swap(0, 1));
    assert!(flipped.misoriented == 1 && flipped.open_edges > 0, "{flipped:?}");

    let moved = case.faults(|m| m.vertices[inner.first_vertex as usize].position[2] += 0.5);
    assert!(moved.open_edges > 0, "{moved:?}");

    let nan = case.faults(|m| m.vertices[inner.first_vertex as usize].position[2] = f32::NAN);
    assert!(nan.not_finite > 0, "{nan:?}");

    let twice = case.faults(|m| m.triangles.push(m.triangles[first]));
    assert!(twice.open_edges > 0 && twice.area_error > 1e-6, "{twice:?}");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_wrong_outer_factor_is_caught() {
    let case = case();
    let windows = &case.placement.windows;
    let good: Vec<Patch> = patches(windows).into_iter().map(|(_, p)| p).collect();
    let domain = windows.domain();
    let spacing = case.placement.spacing_m;
    let corner =
        |p: [i32; 2]| [0, 1].map(|a| f64::from((p[a] - case.placement.anchor[a]) as f32 * spacing[a]));
    let check = |list: &[Patch]| {
        let mesh = Mesh::from_twin(&case.placement, case.terrain.source.as_ref(), list, [0.0; 3]);
        check_mesh(&mesh, [corner(domain.lo), corner(domain.hi)], 0.01)
    };
    assert!(check(&good).none());
    let mut bad = good.clone();
    let doubled = bad.iter_mut().find(|p| p.outer[0].extra() > 0).expect("a doubled edge");
    doubled.outer[0] = OuterSpan::default();
    let faults = check(&bad);
    assert!(faults.open_edges > 0 && faults.misoriented == 0, "{faults:?}");
}

#[test]
fn a_row_fails_beyond_its_bound_and_on_nan() {
    let mut row = CheckRow::new("test", "m", 1.0);
    row.add(1.0);
    assert!(row.pass && row.failed == 0);
    row.add(1.5);
    assert!(!row.pass && row.failed == 1);
    row.add(f64::NAN);
    assert_eq!((row.failed, row.tried), (2, 3));
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn holes_leave_the_rest_of_the_mesh_conforming() {
    let gpu = common::gpu();
    let mut grid = common::terrain("procedural:mountains?width=203&height=150");
    let mut valid = vec![true; grid.width * grid.height];
    for (x, y) in [(100, 75), (101, 75), (102, 80), (0, 0), (202, 149), (60, 20)] {
        valid[y * grid.width + x] = false;
    }
    grid.valid = Some(valid);
    let terrain = Terrain::new(&grid, Prefilter::Subsample);
    let scene = Scene { n: 31, cull: false, ..Scene::default() };
    let mut renderer =
        Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene).expect("drawable");
    let target = Offscreen::new(&gpu.device, [32, 32]).expect("small");
    let eye_m = glam::DVec3::new(3_000.0, 2_250.0, 4_000.0);
    draw(
        &gpu,
        &mut renderer,
        &target,
        &Camera { eye_m, yaw_deg: 0.0, pitch_deg: -90.0, fov_deg: 60.0, ..Camera::default() },
    )
    .expect("drawn");
    let placement = renderer.placement().expect("prepared").clone();
    let mesh = Mesh::from_gpu(&renderer.read_mesh().expect("read"));
    let all: Vec<Patch> = patches(&placement.windows).into_iter().map(|(_, p)| p).collect();
    let anchor = renderer.read_mesh().expect("read").anchor_m;
    let twin = Mesh::from_twin(&placement, terrain.source.as_ref(), &all, anchor);
    assert_eq!(sorted_triangles(&mesh), sorted_triangles(&twin));
    let full = patches(&placement.windows).iter().map(|(_, p)| p.triangle_count() as usize).sum::<usize>();
    assert!(mesh.triangles.len() < full, "nothing was left out");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_brief_check_of_a_cliff_holds() {
    let gpu = common::gpu();
    for spec in ["procedural:cliff?width=90&height=40", "procedural:checkerboard?size=70&amp=1000000"] {
        for row in check_gpu(&gpu, &common::terrain(spec), Effort::Brief).expect("drawable") {
            assert!(row.pass, "{spec}: {row:?}");
        }
    }
}
