//! Factors by error on curved bases: closed meshes across chart borders, and true bounds along the normal.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

mod common;

use std::collections::BTreeSet;

use glam::DVec3;
use tessclip::clipmap::Rect;
use tessclip::gpu::Offscreen;
use tessclip::measure::{Mesh, check_closed, invariants::draw};
use tessclip::pyramid::{STEPS, blocks_at};
use tessclip::surface::{Base, Ellipsoid};
use tessclip::{Camera, Factors, Prefilter, Renderer, Scene, Terrain};

/// Draws all patches of a closed surface from everywhere; tells which steps appeared.
fn check(name: &str, terrain: &Terrain, n: u32, cameras: &[Camera], euler: i64) -> BTreeSet<u32> {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [320, 200]).unwrap();
    let mut steps = BTreeSet::new();
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
            steps.extend(read.patches.iter().map(|p| p.patch().step()));
            let mesh = Mesh::from_gpu(&read);
            let told = format!("{name}, {factors:?}, camera {k} {camera:?}");
            let faults = check_closed(&mesh);
            assert_eq!((faults.open_edges, faults.not_finite), (0, 0), "{told}: {faults:?}");
            assert_eq!(faults.euler, euler, "{told}");
        }
    }
    steps
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
    let steps = check("planet", &terrain, 511, &cameras, 2);
    assert!(steps.len() >= 3, "{steps:?}");
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
    let steps = check("torus", &terrain, 511, &cameras, 0);
    assert!(steps.len() >= 3, "{steps:?}");
}

/// Greatest normal component of what a step leaves of the true surface, against the figure and the chord.
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
            for (bx, by) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
                let mut figures = Vec::new();
                source.read_deviations(level, Rect { lo: [bx, by], hi: [bx, by] }, &mut figures);
                for k in 0..STEPS as u32 {
                    let exponent = level + k;
                    let bound =
                        f64::from(figures[0].metres(k as usize)) + bend * 4.0_f64.powi(exponent as i32);
                    let cells = 1 << (4 - k);
                    // A few cells of a block and a few places in each: along the diagonal and off it.
                    for (cx, cy) in [(0, 0), (cells / 2, cells - 1), (cells - 1, cells / 3)] {
                        let node = |x: i32, y: i32| {
                            [(bx * cells + x, 0), (by * cells + y, 1)]
                                .map(|(v, a): (i32, usize)| (v << exponent).min(lattice.last[a]))
                        };
                        let (lo, hi) = (node(cx, cy), node(cx + 1, cy + 1));
                        if hi[0] <= lo[0] || hi[1] <= lo[1] {
                            continue;
                        }
                        let span = [hi[0] - lo[0], hi[1] - lo[1]];
                        for (u, v) in [(1, 1), (1, 3), (2, 2), (3, 1), (3, 3), (2, 0), (0, 2)] {
                            let p = [lo[0] + span[0] * u / 4, lo[1] + span[1] * v / 4];
                            let (s, t) = (
                                f64::from(p[0] - lo[0]) / f64::from(span[0]),
                                f64::from(p[1] - lo[1]) / f64::from(span[1]),
                            );
                            let at = |q: [i32; 2]| point(q).0;
                            let (sw, se, nw, ne): (DVec3, DVec3, DVec3, DVec3) =
                                (at(lo), at([hi[0], lo[1]]), at([lo[0], hi[1]]), at(hi));
                            let drawn = if s + t <= 1.0 {
                                sw + (se - sw) * s + (nw - sw) * t
                            } else {
                                ne + (nw - ne) * (1.0 - s) + (se - ne) * (1.0 - t)
                            };
                            let (truth, up) = point(p);
                            let off = (truth - drawn).dot(up).abs();
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
    for y in 0..=lattice.last[1] {
        for x in 0..=lattice.last[0] {
            for exponent in 1..=4 {
                let lo = [x, y].map(|v| (v - i32::from(v == 202)) >> exponent << exponent);
                let hi = [0, 1].map(|a| (lo[a] + (1 << exponent)).min(lattice.last[a]));
                let [s, t] = [x - lo[0], y - lo[1]].map(f64::from);
                let (s, t) = (s / f64::from(hi[0] - lo[0]), t / f64::from(hi[1] - lo[1]));
                let (sw, se, nw, ne) = (at(lo), at([hi[0], lo[1]]), at([lo[0], hi[1]]), at(hi));
                let drawn = if s + t <= 1.0 {
                    sw + (se - sw) * s + (nw - sw) * t
                } else {
                    ne + (nw - ne) * (1.0 - s) + (se - ne) * (1.0 - t)
                };
                let off = (at([x, y]) - drawn).length();
                let block = lo.map(|v| v >> 4);
                let mut figures = Vec::new();
                terrain.source.read_deviations(0, Rect { lo: block, hi: block }, &mut figures);
                let figure = f64::from(figures[0].metres(exponent as usize));
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
