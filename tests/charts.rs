//! Glued charts: names of nodes, levels across borders, and one conforming surface over all of them.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

use std::collections::HashMap;

use tessclip::clipmap::{ChartGraph, ChartWindows, Node, Side, thirds};
use tessclip::quads::{OuterSpan, Patch, chart_patches};
use tessclip::reference::cell_triangles;

/// Chart and base index of a node's canonical name.
type Name = (usize, [i32; 2]);

/// Base nodes of a patch's vertices in the order of its expansion.
fn nodes(windows: &ChartWindows, patch: &Patch) -> Vec<Node> {
    let lattice = windows.charts[patch.chart as usize].lattice;
    patch.bases(lattice).into_iter().map(|base| Node { chart: patch.chart as usize, base }).collect()
}

/// Edges that do not belong to exactly two triangles, one in each direction; and vertices - edges + faces.
fn faults(windows: &ChartWindows) -> (usize, i64) {
    let all: Vec<Patch> = chart_patches(windows).into_iter().map(|(_, p)| p).collect();
    faults_of(windows, &all)
}

fn faults_of(windows: &ChartWindows, patches: &[Patch]) -> (usize, i64) {
    let mut edges: HashMap<(Name, Name), (u32, u32)> = HashMap::new();
    let mut faces = 0;
    let mut vertices = std::collections::HashSet::new();
    for patch in patches {
        let names: Vec<_> = nodes(windows, patch)
            .into_iter()
            .map(|n| windows.graph.canonical(n))
            .map(|n| (n.chart, n.base))
            .collect();
        let mirrored = windows.graph.charts[patch.chart as usize].mirrored;
        let [w, h] = patch.cells();
        for y in 0..h {
            for x in 0..w {
                for t in cell_triangles(patch, [x, y]) {
                    let mut t = t.map(|ix| names[ix as usize]);
                    if mirrored {
                        t.swap(1, 2);
                    }
                    faces += 1;
                    vertices.extend(t);
                    for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                        assert_ne!(a, b, "a degenerate triangle");
                        let count = edges.entry((a.min(b), a.max(b))).or_default();
                        if a < b { count.0 += 1 } else { count.1 += 1 }
                    }
                }
            }
        }
    }
    let open = edges.values().filter(|c| **c != (1, 1)).count();
    (open, vertices.len() as i64 - edges.len() as i64 + faces)
}

/// Greatest difference of levels across any border, cell by cell of the finest lattice.
fn worst_step(windows: &ChartWindows) -> u32 {
    let mut worst = 0;
    let levels = windows.shape().levels();
    for (chart, c) in windows.graph.charts.iter().enumerate() {
        for side in Side::ALL {
            let Some(next) = c.neighbours[side as usize] else { continue };
            let last = c.lattice.last[side.along()];
            // `beyond` seen from either side says which levels reach the border where.
            let level_at = |of: usize, side: Side, t: i32| {
                (0..levels)
                    .find(|l| windows.beyond(of, side, *l).is_some_and(|i| i[0] <= t && t < i[1]))
                    .expect("the coarsest level covers everything")
            };
            for t in 0..last {
                let (a, b) = (level_at(chart, side, t), level_at(next.chart, next.side, t));
                worst = worst.max(a.abs_diff(b));
            }
        }
    }
    worst
}

/// Special places of a chart: corners, borders, just beside them, the middle, and pseudo-random ones.
fn places(last: [i32; 2], random: u32) -> Vec<[f64; 2]> {
    let along = |l: i32| {
        let l = f64::from(l);
        [0.0, 0.3, 1.0, 3.7, l * 0.1, l * 0.5, l * 0.63, l - 2.2, l - 0.4, l]
    };
    let mut out: Vec<[f64; 2]> =
        along(last[0]).iter().flat_map(|x| along(last[1]).map(|y| [*x, y])).collect();
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..random {
        out.push([next() * f64::from(last[0]), next() * f64::from(last[1])]);
    }
    out
}

#[test]
fn a_border_node_has_one_canonical_name_and_all_charts_find_it() {
    for graph in [ChartGraph::cube(8), ChartGraph::grid(&[5, 7, 6], &[4, 4, 3], [true, true])] {
        let mut by_name: HashMap<(usize, [i32; 2]), usize> = HashMap::new();
        for (chart, c) in graph.charts.iter().enumerate() {
            for y in 0..=c.lattice.last[1] {
                for x in 0..=c.lattice.last[0] {
                    let node = Node { chart, base: [x, y] };
                    let names = graph.names(node);
                    for other in &names {
                        assert_eq!(graph.canonical(*other), graph.canonical(node));
                        assert_eq!(graph.names(*other).len(), names.len());
                    }
                    let name = graph.canonical(node);
                    *by_name.entry((name.chart, name.base)).or_default() += 1;
                }
            }
        }
        let cells: i64 = graph.charts.iter().map(|c| i64::from(c.lattice.last[0] * c.lattice.last[1])).sum();
        let euler = by_name.len() as i64 - 2 * cells + cells;
        assert_eq!(euler, if graph.charts.len() == 6 { 2 } else { 0 });
    }
}

#[test]
fn the_cube_is_one_conforming_surface_from_everywhere() {
    for (n, size) in [(31, 64), (31, 128), (63, 256)] {
        let graph = ChartGraph::cube(size);
        let shape = graph.shape(n, None).unwrap();
        for home in 0..6 {
            let random = if size == 64 { 40 } else { 4 };
            for (k, centre) in places([size, size], random).into_iter().enumerate() {
                if size > 64 && k % 7 != home % 7 {
                    continue;
                }
                let finest = if k % 5 == 4 { 1 } else { 0 };
                let windows = ChartWindows::place(&graph, shape, home, centre, finest);
                assert!(worst_step(&windows) <= 1, "levels differ by two: n {n}, {home} {centre:?}");
                assert_eq!(faults(&windows), (0, 2), "n {n} size {size} home {home} centre {centre:?}");
            }
        }
    }
}

#[test]
fn rings_of_any_size_conform() {
    for (u, v) in [(122, 157), (192, 192), (200, 600), (500, 90)] {
        let graph = ChartGraph::grid(&thirds(u), &thirds(v), [true, true]);
        let shape = graph.shape(31, None).unwrap();
        for home in 0..9 {
            for (k, centre) in places(graph.charts[home].lattice.last, 6).into_iter().enumerate() {
                if k % 3 != home % 3 {
                    continue;
                }
                let windows = ChartWindows::place(&graph, shape, home, centre, 0);
                assert!(worst_step(&windows) <= 1);
                assert_eq!(faults(&windows), (0, 0), "{u} {v} home {home} {centre:?}");
            }
        }
    }
}

#[test]
fn a_missing_doubling_is_noticed() {
    let graph = ChartGraph::cube(128);
    let shape = graph.shape(31, None).unwrap();
    let broken = places([128, 128], 0).into_iter().find_map(|centre| {
        let windows = ChartWindows::place(&graph, shape, 1, centre, 0);
        let mut all: Vec<Patch> = chart_patches(&windows).into_iter().map(|(_, p)| p).collect();
        let (patch, side) = all.iter().enumerate().find_map(|(k, p)| {
            let last = graph.charts[p.chart as usize].lattice.last_at(p.level);
            let on_border = |s: &Side| {
                let axis = 1 - s.along();
                if s.is_high() { p.rect.hi[axis] == last[axis] } else { p.rect.lo[axis] == 0 }
            };
            let side = Side::ALL.into_iter().find(|s| on_border(s) && p.outer[*s as usize].log2 > 0)?;
            Some((k, side))
        })?;
        all[patch].outer[side as usize] = OuterSpan::default();
        Some(faults_of(&windows, &all).0)
    });
    assert!(broken.expect("somewhere a patch meets a finer chart") > 0);
}

#[test]
fn small_windows_are_refused_where_charts_are_glued() {
    assert!(ChartGraph::cube(64).shape(15, None).unwrap_err().to_string().contains("31"));
    assert!(ChartGraph::cube(64).shape(31, Some(1)).unwrap_err().to_string().contains("do not cover"));
}
