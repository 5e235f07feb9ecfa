//! Meshes of whole surfaces read back from the GPU: closed, conforming and turned outwards wherever the
//! camera stands, at and around every special place.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use std::collections::HashMap;

use tessclip::gpu::Offscreen;
use tessclip::heights::{NodataPolicy, PositionGrid};
use tessclip::measure::{Mesh, check_closed, invariants::draw};
use tessclip::surface::{Base, Ellipsoid};
use tessclip::{Factors, Prefilter, Renderer, Scene, Terrain};

/// Longitudes and latitudes of poles, date line, cube corners and borders, and beside them.
fn special_places() -> Vec<[f64; 2]> {
    let corner = (1.0_f64 / 2.0_f64.sqrt()).atan().to_degrees();
    let mut out = vec![[0.0, 90.0], [37.0, -90.0], [180.0, 0.0], [-180.0, 12.0], [12.3, 45.6]];
    for lon in [45.0, 135.0, -45.0, -135.0] {
        for lat in [0.0, corner, -corner] {
            out.push([lon, lat]);
            out.push([lon + 0.7, lat - 0.4]);
        }
    }
    for lat in [89.99, 45.0, 44.5, -45.0] {
        out.push([0.0, lat]);
        out.push([91.0, lat]);
    }
    out
}

fn check(name: &str, terrain: &Terrain, n: u32, morph: bool, cameras: &[tessclip::Camera], euler: i64) {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [64, 64]).unwrap();
    let make = |drop_fine_levels| {
        let scene = Scene { n, morph, cull: false, drop_fine_levels, ..Scene::default() };
        Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, &scene).unwrap()
    };
    let (mut renderer, mut dropping) = (make(false), make(true));
    for (k, camera) in cameras.iter().enumerate() {
        // Every third with fine levels dropped by height, as a small picture asks for.
        let renderer = if k % 3 == 2 { &mut dropping } else { &mut renderer };
        draw(&gpu, renderer, &target, camera).unwrap();
        let read = renderer.read_mesh().unwrap();
        assert_eq!(read.counters.patches_dropped, 0);
        let faults = check_closed(&Mesh::from_gpu(&read));
        assert_eq!(faults.open_edges, 0, "{name}: camera {k} {camera:?}: {faults:?}");
        assert_eq!(faults.not_finite, 0, "{name}: camera {k}");
        assert_eq!(faults.euler, euler, "{name}: camera {k} {camera:?}");
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_planet_is_closed_from_everywhere() {
    let grid = common::terrain("procedural:planet?size=257");
    let terrain = Terrain::globe(vec![grid], Ellipsoid::WGS84).unwrap();
    let mut cameras = Vec::new();
    for (k, [lon, lat]) in special_places().into_iter().enumerate() {
        let height = [9e3, 4e5, 3e6, 2e7][k % 4];
        cameras.push(terrain.camera([lon, lat, height, 30.0, -40.0], 60.0));
    }
    check("planet", &terrain, 31, false, &cameras, 2);
    check("planet, morphing", &terrain, 63, true, &cameras, 2);
    check("planet", &terrain, 255, false, &cameras[..6], 2);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_finer_region_stays_conforming_in_the_globe() {
    let globe = common::terrain("procedural:planet?size=257");
    // A patch of finer mountains across the date line and a cube border, blended into the globe.
    let mut fine = common::terrain("procedural:mountains?size=513");
    fine.georeference.degrees = Some(tessclip::heights::Degrees {
        west: 177.0,
        south: 42.0,
        step: [0.01, 0.01],
        metres_per_degree: [8e4, 1.1e5],
    });
    let terrain = Terrain::globe(vec![globe, fine], Ellipsoid::WGS84).unwrap();
    let poses = [[179.99, 45.0], [-179.5, 44.9], [177.0, 42.0], [-178.0, 47.0], [175.0, 45.01], [0.0, 0.0]];
    let cameras: Vec<_> = poses.map(|[x, y]| terrain.camera([x, y, 5e3, 0.0, -30.0], 60.0)).to_vec();
    check("globe with a region", &terrain, 63, false, &cameras, 2);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_torus_is_closed_from_everywhere() {
    let grid = common::terrain("procedural:dunes?width=301&height=200");
    let base = Base::Torus { major_m: 4_000.0, minor_m: 1_200.0 };
    let terrain = Terrain::on(&grid, base, Prefilter::Subsample).unwrap();
    let mut cameras = Vec::new();
    for x in [0.0, 4.0, 2_999.0, 3_000.0, 6_000.0, 8_970.0, 9_000.0] {
        for y in [0.0, 1_990.0, 2_000.0, 4_100.0] {
            cameras.push(terrain.camera([x, y, 300.0, 0.0, -20.0], 60.0));
        }
    }
    check("torus", &terrain, 31, false, &cameras, 0);
    check("torus, morphing", &terrain, 63, true, &cameras[..8], 0);
}

/// Surfaces with borders: every inner edge is shared by two triangles, border edges form closed loops; with uniform
/// factors and with those that go by error.
fn check_open(name: &str, terrain: &Terrain, cameras: &[tessclip::Camera], loops: usize, euler: i64) {
    let uniform = Scene { n: 31, cull: false, drop_fine_levels: false, ..Scene::default() };
    check_open_with(name, terrain, &uniform, cameras, loops, euler);
    // Several charts need a wider layout.
    let n = if terrain.graph().is_glued() { 511 } else { 127 };
    let factors = Factors::ByError { pixel_error: Some(2.0), budget: Some(6_000) };
    let by_error = Scene { n, factors, ..uniform };
    check_open_with(name, terrain, &by_error, cameras, loops, euler);
}

fn check_open_with(
    name: &str,
    terrain: &Terrain,
    scene: &Scene,
    cameras: &[tessclip::Camera],
    loops: usize,
    euler: i64,
) {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [64, 64]).unwrap();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, scene).unwrap();
    for camera in cameras {
        draw(&gpu, &mut renderer, &target, camera).unwrap();
        let mesh = Mesh::from_gpu(&renderer.read_mesh().unwrap());
        let mut next: HashMap<u32, u32> = HashMap::new();
        let mut edges = std::collections::HashSet::new();
        for t in &mesh.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                assert!(edges.insert((a, b)), "{name}: an edge twice the same way, {camera:?}");
            }
        }
        for (a, b) in &edges {
            if !edges.contains(&(*b, *a)) {
                assert!(next.insert(*a, *b).is_none(), "{name}: two borders meet, {camera:?}");
            }
        }
        let border = next.len() as i64;
        let mut found = 0;
        while let Some(start) = next.keys().next().copied() {
            let mut at = start;
            while let Some(to) = next.remove(&at) {
                at = to;
            }
            assert_eq!(at, start, "{name}: an open border, {camera:?}");
            found += 1;
        }
        assert_eq!(found, loops, "{name}: {camera:?}");
        let edges = (edges.len() as i64 + border) / 2;
        assert_eq!(mesh.vertices.len() as i64 - edges + mesh.triangles.len() as i64, euler, "{name}");
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_cylinder_has_two_borders() {
    let grid = common::terrain("procedural:mountains?width=203&height=150");
    for inside in [false, true] {
        let base = Base::Cylinder { radius_m: 5_000.0, inside };
        let terrain = Terrain::on(&grid, base, Prefilter::Subsample).unwrap();
        let mut cameras = Vec::new();
        for x in [0.0, 30.0, 2_010.0, 3_000.0, 6_060.0] {
            for y in [0.0, 2_222.0, 4_470.0] {
                cameras.push(terrain.camera([x, y, 500.0, 0.0, -20.0], 60.0));
            }
        }
        check_open("cylinder", &terrain, &cameras, 2, 0);
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn open_surfaces_have_one_border() {
    let grid = common::terrain("procedural:mountains?width=203&height=150");
    let sphere = Terrain::on(&grid, "sphere:6371000".parse().unwrap(), Prefilter::LowPass).unwrap();
    let over = Terrain::sampled(PositionGrid::parse("overhang?size=203").unwrap());
    for (name, terrain) in [("sphere", &sphere), ("overhang", &over)] {
        let mut cameras = Vec::new();
        for x in [0.0, 30.0, 2_010.0, 3_000.0, 6_060.0] {
            for y in [0.0, 2_222.0, 4_470.0] {
                cameras.push(terrain.camera([x, y, 4_000.0, 0.0, -20.0], 60.0));
            }
        }
        check_open(name, terrain, &cameras, 1, 1);
    }
    let geographic = common::data("srtm/N46E008.tif");
    if let Some(path) = geographic {
        let grid =
            tessclip::open_terrain(&path, &Default::default()).unwrap().with_nodata(NodataPolicy::Fill);
        let terrain = Terrain::on(&grid, "wgs84".parse().unwrap(), Prefilter::Subsample).unwrap();
        let cameras: Vec<_> = [[8.0, 46.0], [8.5, 46.5], [9.0, 47.0]]
            .map(|[x, y]| terrain.camera([x, y, 4_000.0, 0.0, -20.0], 60.0))
            .to_vec();
        check_open("SRTM on WGS84", &terrain, &cameras, 1, 1);
    }
}

#[test]
fn an_open_seam_is_noticed() {
    let mut mesh = Mesh {
        vertices: vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]],
        levels: vec![0; 4],
        triangles: vec![[0, 1, 2], [3, 2, 1], [0, 3, 1], [0, 2, 3]],
    };
    assert_eq!((check_closed(&mesh).open_edges, check_closed(&mesh).euler), (0, 2));
    mesh.triangles[2].swap(1, 2);
    assert!(check_closed(&mesh).open_edges > 0, "a triangle turned inwards");
    mesh.triangles.pop();
    assert!(check_closed(&mesh).open_edges > 0, "a hole");
}
