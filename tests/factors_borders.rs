//! Factors by error where a finer level ends: voids that only it shows, and its nodes on coarser leaves.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

mod common;
#[path = "common/made.rs"]
mod made;

use made::{Point, cameras, frame, renderer, scene};
use tessclip::clipmap::{Lattice, Rect};
use tessclip::gpu::{GpuMesh, Offscreen};
use tessclip::heights::HeightGrid;
use tessclip::quads::{BLOCK_NODES, BlockKind, ByError, Patch, closed};
use tessclip::reference::leaf_triangles;
use tessclip::{Factors, Prefilter, Scene, Terrain};

const SIZE: [usize; 2] = [400, 300];

/// Flat ground with at most one void sample.
fn plain(void: Option<Point>) -> Terrain {
    let mut grid = HeightGrid::new(SIZE[0], SIZE[1], vec![0.0; SIZE[0] * SIZE[1]]).unwrap();
    if let Some([x, y]) = void.map(|p| p.map(|v| usize::try_from(v).unwrap())) {
        let mut valid = vec![true; SIZE[0] * SIZE[1]];
        valid[y * SIZE[0] + x] = false;
        grid.valid = Some(valid);
    }
    Terrain::new(&grid, Prefilter::Subsample)
}

/// Area of one triangle on the base plane, in cells of level 0; collapsed ones have none.
fn area_of(mesh: &GpuMesh, t: [u32; 3], spacing_m: [f64; 2]) -> f64 {
    if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
        return 0.0;
    }
    let [a, b, c] = t.map(|ix| {
        let p = mesh.vertices[ix as usize].position;
        [0, 1].map(|k: usize| f64::from(p[k]) / spacing_m[k])
    });
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
}

/// Cells of level 0 that no triangle covers.
fn uncovered(mesh: &GpuMesh, spacing_m: [f64; 2]) -> f64 {
    let all = ((SIZE[0] - 1) * (SIZE[1] - 1)) as f64;
    all - mesh.triangles.iter().map(|t| area_of(mesh, *t, spacing_m)).sum::<f64>()
}

/// The coarser level does not have the void sample: a long triangle of its own beside it would be taken away
/// by the finer level's void vertex.
#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn one_void_at_a_levels_border_takes_no_more_than_its_cells_away() {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [64, 64]).unwrap();
    let whole = Scene { cull: false, drop_fine_levels: false, ..scene(127, Some(1.0), None) };
    let uniform = Scene { factors: Factors::Uniform, ..whole.clone() };
    let flat = plain(None);
    // Above the middle: level 0's window ends inside the data on every side.
    let camera = &cameras(&flat)[0];
    let mut first = renderer(&gpu, &flat, &whole);
    let good = frame(&gpu, &mut first, &target, camera);
    let left = uncovered(&good, flat.spacing_m);
    assert!(left.abs() < 1e-3, "{left} cells of what has no voids");
    let Rect { lo, hi } = first.windows().unwrap().charts[0].loaded(0);
    let inside = |p: Point| (0..2).all(|a| p[a] > 2 && p[a] + 3 < i32::try_from(SIZE[a]).unwrap());
    assert!(inside(lo) && inside(hi), "level 0 from {lo:?} to {hi:?}");
    for void in [[lo[0], lo[1] + 33], [hi[0], lo[1] + 45], [lo[0] + 51, lo[1]], [lo[0] + 17, hi[1]]] {
        assert!(void.iter().any(|v| v % 2 == 1), "level 1 has {void:?}");
        let terrain = plain(Some(void));
        let mut by_error = renderer(&gpu, &terrain, &whole);
        let mut mesh = frame(&gpu, &mut by_error, &target, camera);
        assert_eq!(by_error.windows().unwrap().charts[0].loaded(0), Rect { lo, hi });
        let full = frame(&gpu, &mut renderer(&gpu, &terrain, &uniform), &target, camera);
        let [lost, least] = [&mesh, &full].map(|mesh| uncovered(mesh, terrain.spacing_m));
        eprintln!("void at {void:?}: {lost} cells, {least} where factors are uniform");
        assert!(2 * mesh.triangles.len() < full.triangles.len(), "nothing is left out of the mesh");
        assert!(lost > 0.4, "the void is covered: {lost}");
        // And one cell of level 1.
        let most = least + 4.0 + 1e-3;
        assert!(lost <= most, "void at {void:?}: {lost} cells, {least} where factors are uniform");
        // What takes the longest triangle away is noticed.
        let spacing_m = terrain.spacing_m;
        let area = |k: usize| area_of(&mesh, mesh.triangles[k], spacing_m);
        let at = (0..mesh.triangles.len()).max_by(|a, b| area(*a).total_cmp(&area(*b))).unwrap();
        mesh.triangles[at] = [mesh.triangles[at][0]; 3];
        assert!(uncovered(&mesh, spacing_m) > most);
    }
}

/// Worst distance of a level-1 block's triangles from the level-0 samples over it.
fn worst_of(by_error: ByError, height: &dyn Fn(Point) -> f64) -> f64 {
    let (rect, outer) = (Rect { lo: [0; 2], hi: [16; 2] }, Default::default());
    let patch = Patch { chart: 0, level: 1, kind: BlockKind::M, rect, outer, by_error: Some(by_error) };
    let bases = patch.bases(Lattice { last: [32; 2] });
    let cross = |a: Point, b: Point, c: Point| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    // Own nodes and the finer level's stand at the same samples: coarser levels take every second one.
    let mut worst = 0.0_f64;
    for t in leaf_triangles(&patch) {
        let [a, b, c] = t.map(|ix| bases[ix as usize]);
        let area = f64::from(cross(a, b, c));
        for p in (0..=32).flat_map(|y| (0..=32).map(move |x| [x, y])) {
            let shares = [cross(b, c, p), cross(c, a, p), cross(a, b, p)];
            if shares.iter().all(|share| *share >= 0) {
                let [u, v, w] = shares.map(|share| f64::from(share) / area);
                worst = worst.max((u * height(a) + v * height(b) + w * height(c) - height(p)).abs());
            }
        }
    }
    worst
}

/// Why blocks that border a finer level are wished for twice as much (shaders/wish_factors.wgsl): a node of
/// that level moves the whole fan behind it by up to figure 0, away from samples as far off on the other
/// side.
#[test]
fn a_fan_beside_a_finer_level_deviates_by_up_to_twice_figure_0() {
    let height = |p: Point| match p {
        [15, 0] => -10.0,
        [15, 3] => 10.0,
        _ => 0.0,
    };
    let all = (0..33 * 33).map(|k| height([k % 33, k / 33]) as f32).collect();
    let terrain = Terrain::new(&HeightGrid::new(33, 33, all).unwrap(), Prefilter::Subsample);
    let mut figures = Vec::new();
    let first = Rect { lo: [0; 2], hi: [0; 2] };
    assert!(terrain.source.read_deviations(1, first, &mut figures));
    let figure = f64::from(figures[0].metres(0));
    // What the block has itself is flat: figure 0 is all that is known of it.
    assert!((10.0..10.2).contains(&figure), "{figure}");
    let corners = closed([16; 2], [16; 2], [0; BLOCK_NODES]);
    let whole = ByError { rows: corners, extras: [0; 4] };
    let fanned = ByError { extras: [1 << 15, 0, 0, 0], ..whole };
    let [alone, beside] = [whole, fanned].map(|by_error| worst_of(by_error, &height));
    assert!(alone <= figure, "{alone} of {figure}");
    assert!(beside > 1.5 * figure && beside <= 2.0 * figure, "{beside} of {figure}");
}
