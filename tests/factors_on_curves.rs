//! Factors by error on curved bases: closed meshes across chart borders, and true bounds along the normal.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

mod common;

use std::collections::BTreeSet;

use glam::DVec3;
use tessclip::clipmap::Rect;
use tessclip::gpu::Offscreen;
use tessclip::measure::{Mesh, check_closed, invariants::draw};
use tessclip::pyramid::{FIGURES, blocks_at};
use tessclip::quads::{Patch, block_nodes, rank};
use tessclip::surface::{Base, Ellipsoid};
use tessclip::{Camera, Factors, Prefilter, Renderer, Scene, Terrain};

/// Rank of the finest nodes that a patch owns; 9 where there are only corners.
fn finest_rank(patch: &Patch) -> u32 {
    let own = patch.by_error.unwrap();
    block_nodes().filter(|node| own.has(*node)).map(rank).min().unwrap()
}

/// Draws all patches of a closed surface from everywhere; tells of which ranks patches' finest nodes were.
fn check(name: &str, terrain: &Terrain, n: u32, cameras: &[Camera], euler: i64) -> BTreeSet<u32> {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [320, 200]).unwrap();
    let mut finest = BTreeSet::new();
    for factors in [
        Factors::ByError { pixel_error: Some(1.0), budget: None },
        Factors::ByError { pixel_error: None, budget: Some(9_000) },
    ] {
        let scene = Scene { n, factors, cull: false, drop_fine_levels: false, ..Scene::default() };
        let mut renderer =
            Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, &scene).unwrap();
        for (k, camera) in cameras.iter().enumerate() {
            draw(&gpu, &mut renderer, &target, camera).unwrap();
            let read = renderer.read_mesh().unwrap();
            assert_eq!(read.counters.patches_dropped, 0);
            finest.extend(read.drawn().iter().map(finest_rank));
            let mesh = Mesh::from_gpu(&read);
            let told = format!("{name}, {factors:?}, camera {k} {camera:?}");
            let faults = check_closed(&mesh);
            assert_eq!((faults.open_edges, faults.not_finite), (0, 0), "{told}: {faults:?}");
            assert_eq!(faults.euler, euler, "{told}");
        }
    }
    finest
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_planet_is_closed_with_factors_by_error() {
    let terrain =
        Terrain::globe(vec![common::terrain("procedural:planet?size=513")], Ellipsoid::WGS84).unwrap();
    let corner = (1.0_f64 / 2.0_f64.sqrt()).atan().to_degrees();
    let places = [[0.0, 90.0], [180.0, 0.0], [45.0, 0.0], [45.0, corner], [-135.0, -corner], [45.7, 44.6]];
    let cameras: Vec<_> = places
        .iter()
        .enumerate()
        .map(|(k, [lon, lat])| terrain.camera([*lon, *lat, [2e4, 4e5, 3e6][k % 3], 30.0, -40.0], 60.0))
        .collect();
    let finest = check("planet", &terrain, 511, &cameras, 2);
    assert!(finest.len() >= 4, "{finest:?}");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_torus_is_closed_with_factors_by_error() {
    // Rings whose charts end within a block.
    let grid = common::terrain("procedural:dunes?width=301&height=200");
    let base = Base::Torus { major_m: 4_000.0, minor_m: 1_200.0 };
    let terrain = Terrain::on(&grid, base, Prefilter::Subsample).unwrap();
    let mut cameras = Vec::new();
    for x in [0.0, 2_999.0, 8_970.0] {
        for y in [0.0, 1_990.0, 4_100.0] {
            cameras.push(terrain.camera([x, y, 300.0, 0.0, -20.0], 60.0));
        }
    }
    let finest = check("torus", &terrain, 511, &cameras, 0);
    assert!(finest.len() >= 4, "{finest:?}");
}

/// A right triangle of a block in nodes from its south-west corner: right angle, then ends of the hypotenuse.
type Right = [[i32; 2]; 3];

/// Shares of a triangle's corners in a point of its plane.
fn corner_shares([a, b, c]: Right, p: [i32; 2]) -> [f64; 3] {
    let cross = |a: [i32; 2], b: [i32; 2], c: [i32; 2]| {
        f64::from(b[0] - a[0]) * f64::from(c[1] - a[1]) - f64::from(b[1] - a[1]) * f64::from(c[0] - a[0])
    };
    [cross(p, b, c), cross(a, p, c), cross(a, b, p)].map(|part| part / cross(a, b, c))
}

fn drawn(corners: [DVec3; 3], shares: [f64; 3]) -> DVec3 {
    corners[0] * shares[0] + corners[1] * shares[1] + corners[2] * shares[2]
}

/// The triangle around a node that the node of a rank would bisect; of rank 0, one that none would.
fn around([x, y]: [i32; 2], rank: usize) -> Right {
    let mut right: Right =
        if x + y <= 16 { [[0, 0], [16, 0], [0, 16]] } else { [[16, 16], [0, 16], [16, 0]] };
    for _ in rank..8 {
        let [apex, a, b] = right;
        let middle = [0, 1].map(|i| (a[i] + b[i]) / 2);
        let half = [middle, apex, a];
        let inside = corner_shares(half, [x, y]).iter().all(|share| *share >= 0.0);
        right = if inside { half } else { [middle, b, apex] };
    }
    right
}

/// A few triangles of a block with a rank.
fn triangles(rank: usize) -> Vec<Right> {
    let mut found: Vec<Right> = [[1, 2], [6, 1], [9, 4], [13, 3], [3, 9], [5, 14], [10, 11], [15, 14]]
        .map(|p| around(p, rank))
        .into();
    if rank == 0 {
        // Of the uniform grid as well, where its diagonal is the other one.
        found.extend([[[2, 4], [3, 4], [2, 5]], [[12, 10], [11, 10], [12, 9]]]);
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Greatest normal component of what is left out of the true surface, against the figure and the chord.
fn worst_share(terrain: &Terrain, sides: f64) -> f64 {
    let curved = terrain.curved.as_ref().unwrap();
    let (radius_m, angle) = curved.surface.bend();
    let [low, high] = curved.height_range().unwrap().map(f64::from);
    let bend = sides * 0.55 * (radius_m + low.abs().max(high.abs())) * angle * angle;
    let mut worst = 0.0_f64;
    for (chart, source) in curved.sources.iter().enumerate() {
        let lattice = source.lattice();
        let point = |base: [i32; 2]| {
            let (p, up) = curved.surface.base(chart, base.map(f64::from));
            (p + up * f64::from(source.sample(0, base)), up)
        };
        for level in 0..=lattice.coarsest_level() {
            let size = blocks_at(lattice, level);
            let last = lattice.last_at(level);
            for (bx, by) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
                let mut figures = Vec::new();
                source.read_deviations(level, Rect { lo: [bx, by], hi: [bx, by] }, &mut figures);
                // Where the data ends within a block, triangles are bisected until none straddles its end:
                // only the smallest ones are sure to be there.
                let whole = [bx, by].iter().zip(lattice.last).all(|(b, last)| (16 * b + 16) << level <= last);
                let ranks = if whole { FIGURES } else { 1 };
                for rank in 0..ranks {
                    let exponent = level as usize + rank.div_ceil(2);
                    let bound = f64::from(figures[0].metres(rank)) + bend * 4.0_f64.powi(exponent as i32);
                    for right in triangles(rank) {
                        let nodes = right.map(|p| [16 * bx + p[0], 16 * by + p[1]]);
                        if nodes.iter().any(|p| p[0] > last[0] || p[1] > last[1]) {
                            continue;
                        }
                        let corners = nodes.map(|p| lattice.base(level, p));
                        let heights = corners.map(|p| point(p).0);
                        // A few places in each: on its edges and off them.
                        for (u, v) in [(1, 1), (1, 2), (2, 1), (2, 2), (1, 3), (3, 1), (0, 2), (2, 0)] {
                            let p = [0, 1].map(|i| {
                                let off = |k: usize| corners[k][i] - corners[0][i];
                                corners[0][i] + (off(1) * u + off(2) * v) / 4
                            });
                            let shares = corner_shares(corners, p);
                            if shares.iter().any(|share| *share < 0.0) {
                                continue;
                            }
                            let (truth, up) = point(p);
                            let off = (truth - drawn(heights, shares)).dot(up).abs();
                            worst = worst.max((off - 1e-6) / bound.max(1e-9));
                        }
                    }
                }
            }
        }
    }
    worst
}

/// Positions deviate in all directions: their distance at equal parameter, where nothing is mixed.
#[test]
fn figures_bound_the_distance_of_positions() {
    let grid = tessclip::heights::PositionGrid::parse("overhang?size=203").unwrap();
    let terrain = Terrain::sampled(grid.clone());
    let lattice = terrain.source.lattice();
    let at = |p: [i32; 2]| DVec3::from_array(grid.xyz_m[p[1] as usize * grid.width + p[0] as usize]);
    let (mut worst, mut tried) = (0.0_f64, 0);
    // Whole blocks; where the data ends within one, triangles are bisected besides.
    let blocks = lattice.last.map(|last| last / 16);
    for block in (0..blocks[1]).flat_map(|y| (0..blocks[0]).map(move |x| [x, y])) {
        let mut figures = Vec::new();
        terrain.source.read_deviations(0, Rect { lo: block, hi: block }, &mut figures);
        for node in (0..=16).flat_map(|y| (0..=16).map(move |x| [x, y])) {
            let here = |p: [i32; 2]| at([16 * block[0] + p[0], 16 * block[1] + p[1]]);
            for rank in 1..FIGURES {
                let right = around(node, rank);
                let off = (here(node) - drawn(right.map(here), corner_shares(right, node))).length();
                let figure = f64::from(figures[0].metres(rank));
                worst = worst.max((off - 1e-9) / figure.max(1e-12));
                tried += 1;
            }
        }
    }
    eprintln!("positions: worst distance is {worst:.3} of its bound, {tried} tried");
    assert!(worst <= 1.0 && worst > 0.5, "{worst}");
}

#[test]
fn figures_and_chords_bound_the_deviation_along_the_normal() {
    let globe =
        Terrain::globe(vec![common::terrain("procedural:planet?size=257")], Ellipsoid::WGS84).unwrap();
    let grid = common::terrain("procedural:dunes?width=301&height=200");
    let torus = Base::Torus { major_m: 4_000.0, minor_m: 1_200.0 };
    let torus = Terrain::on(&grid, torus, Prefilter::Subsample).unwrap();
    for (name, terrain, sides, least) in [("globe", globe, 1.0, 0.5), ("torus", torus, 2.0, 0.1)] {
        let share = worst_share(&terrain, sides);
        eprintln!("{name}: worst deviation is {share:.3} of its bound");
        assert!(share <= 1.0, "{name}: {share}");
        // The torus' cells are taken to be as long as along its outside and to bend as across its tube.
        assert!(share > least, "{name}: a bound this loose says nothing: {share}");
    }
}
