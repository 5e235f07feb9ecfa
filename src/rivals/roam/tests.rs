//! Errors, trees and queues against slow twins, without a GPU.

use std::collections::HashMap;
use std::sync::Arc;

use super::errors::{Bound, Errors, middle};
use super::triangles::{NONE, OUT_OF_VIEW, Triangulation};
use super::{VERTEX_BYTES, runs};
use crate::Prefilter;
use crate::heights::HeightGrid;
use crate::rivals::Ground;
use crate::scene::Terrain;

const SIZES: [[usize; 2]; 6] = [[2, 2], [9, 9], [2, 50], [33, 27], [40, 5], [65, 65]];

/// Numbers that are the same in every run.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % sides
    }
}

fn ground(size: [usize; 2], height: impl Fn(usize, usize) -> f32) -> Arc<Ground> {
    let [w, h] = size;
    let heights = (0..w * h).map(|k| height(k % w, k / w)).collect();
    let grid = HeightGrid::new(w, h, heights).unwrap();
    Arc::new(Ground::of(&Terrain::new(&grid, Prefilter::default())).unwrap())
}

fn rough(size: [usize; 2]) -> Arc<Ground> {
    ground(size, |x, y| ((x * 7_919 + y * 104_729 + x * y * 31) % 997) as f32)
}

fn mesh(ground: &Arc<Ground>) -> Triangulation {
    Triangulation::new(ground.clone(), Arc::new(Errors::of(ground)))
}

fn leaves(mesh: &Triangulation) -> Vec<u32> {
    (0..mesh.triangles.len() as u32).filter(|t| mesh.at(*t).is_leaf()).collect()
}

fn places(mesh: &Triangulation, t: u32) -> [[i32; 2]; 3] {
    mesh.at(t).corners.map(|slot| mesh.vertices[slot as usize])
}

/// Twice the area, positive where corners turn counter-clockwise.
fn turn([a, b, c]: [[i32; 2]; 3]) -> i64 {
    let d = |p: [i32; 2], i: usize| i64::from(p[i] - a[i]);
    d(b, 0) * d(c, 1) - d(c, 0) * d(b, 1)
}

/// Panics unless leaves tile the square, share whole edges, and know their neighbours.
fn check(mesh: &Triangulation, side: i32) {
    let all = leaves(mesh);
    assert_eq!(all.len(), mesh.leaves);
    let mut edges = HashMap::new();
    let mut area = 0;
    for &t in &all {
        let [a, l, r] = mesh.at(t).corners;
        assert!(turn(places(mesh, t)) > 0, "triangles turn counter-clockwise");
        area += turn(places(mesh, t));
        let at = mesh.at(t);
        for (edge, to) in [((a, l), at.left), ((l, r), at.base), ((r, a), at.right)] {
            assert!(edges.insert(edge, (t, to)).is_none(), "an edge is used once a side");
        }
    }
    assert_eq!(area, 2 * i64::from(side) * i64::from(side));
    for (&(from, to), &(_, neighbour)) in &edges {
        let other = edges.get(&(to, from)).map_or(NONE, |(t, _)| *t);
        assert_eq!(other, neighbour, "links lead across the edge");
        let [p, q] = [from, to].map(|slot| mesh.vertices[slot as usize]);
        let on_border = (0..2).any(|a| p[a] == q[a] && (p[a] == 0 || p[a] == side));
        assert_eq!(neighbour == NONE, on_border, "only the border has one side");
    }
    // Euler: a disc.
    let border = edges.values().filter(|(_, n)| *n == NONE).count();
    let edge_count = (edges.len() - border) / 2 + border;
    assert_eq!(mesh.vertex_count() + all.len(), edge_count + 1);
}

#[test]
fn splits_and_merges_keep_the_mesh_conforming_and_lead_back_to_the_roots() {
    let ground = rough([33, 27]);
    let (mut mesh, side) = (mesh(&ground), 32);
    let mut dice = Dice(1);
    check(&mesh, side);
    for round in 0..40 {
        for _ in 0..20 {
            let all = leaves(&mesh);
            mesh.split(all[dice.roll(all.len())]);
        }
        check(&mesh, side);
        for _ in 0..10 * (round % 5) {
            let t = dice.roll(mesh.triangles.len()) as u32;
            mesh.merge(t);
        }
        check(&mesh, side);
    }
    while mesh.leaves > 2 {
        let before = mesh.leaves;
        for t in 0..mesh.triangles.len() as u32 {
            mesh.merge(t);
        }
        assert!(mesh.leaves < before, "some diamond can always be merged");
    }
    check(&mesh, side);
    assert_eq!(mesh.vertex_count(), 4);
    assert!(mesh.at(0).is_leaf() && mesh.at(1).is_leaf());
}

/// Splits until nothing finer exists.
fn split_whole(mesh: &mut Triangulation) {
    let mut before = 0;
    while mesh.leaves > before {
        before = mesh.leaves;
        for t in leaves(mesh) {
            mesh.split(t);
        }
    }
}

#[test]
fn errors_are_nested_and_those_of_the_slow_twin() {
    let ground = rough([17, 17]);
    let errors = Errors::of(&ground);
    let mut mesh = mesh(&ground);
    split_whole(&mut mesh);
    assert_eq!(mesh.leaves, 2 * 16 * 16);
    // All triangles of the trees are there now. The twin takes a maximum over children until nothing changes.
    let split = |t: u32| {
        let [_, left, right] = places(&mesh, t);
        middle(left, right)
    };
    let inner: Vec<u32> = (0..mesh.triangles.len() as u32).filter(|t| !mesh.at(*t).is_leaf()).collect();
    let mut twin: HashMap<[i32; 2], f32> = HashMap::new();
    for &t in &inner {
        let [_, left, right] = places(&mesh, t).map(|p| ground.height(p));
        twin.insert(split(t), (ground.height(split(t)) - 0.5 * (left + right)).abs());
    }
    let mut changed = true;
    while changed {
        changed = false;
        for &t in inner.iter().filter(|t| mesh.at(**t).parent != NONE) {
            let (own, parent) = (twin[&split(t)], split(mesh.at(t).parent));
            if twin[&parent] < own {
                twin.insert(parent, own);
                changed = true;
            }
        }
    }
    assert_eq!(twin.len(), 17 * 17 - 4);
    for (at, error) in twin {
        assert!((errors.at(at) - error).abs() <= 1e-3, "{at:?}: {} and {error}", errors.at(at));
    }
}

#[test]
fn errors_never_grow_towards_the_leaves_beyond_the_data_either() {
    for size in SIZES {
        let mut mesh = mesh(&rough(size));
        split_whole(&mut mesh);
        for t in 0..mesh.triangles.len() as u32 {
            let parent = mesh.at(t).parent;
            if parent != NONE && mesh.at(parent).bound.has_area() {
                assert!(mesh.at(t).bound.error_m <= mesh.at(parent).bound.error_m);
            }
        }
    }
}

#[test]
fn a_tilted_plane_has_no_error_even_where_the_data_ends() {
    for size in SIZES {
        let ground = ground(size, |x, y| 3.0 * x as f32 - 2.0 * y as f32);
        let mut mesh = mesh(&ground);
        split_whole(&mut mesh);
        for t in &mesh.triangles {
            assert!(t.bound.error_m < 1e-3, "{size:?}: {}", t.bound.error_m);
        }
    }
}

#[test]
fn bounds_hold_all_samples_of_their_triangles() {
    for size in SIZES {
        let ground = rough(size);
        let last = ground.last();
        let mut mesh = mesh(&ground);
        split_whole(&mut mesh);
        for t in 0..mesh.triangles.len() as u32 {
            let Bound { lo, hi, range_m, .. } = mesh.at(t).bound;
            let corners = places(&mesh, t).map(|p| [p[0].min(last[0]), p[1].min(last[1])]);
            if !mesh.at(t).bound.has_area() {
                assert_eq!(turn(corners), 0);
                continue;
            }
            assert!(turn(corners) > 0, "clamping turns no triangle over");
            let [a, b, c] = corners;
            for y in lo[1]..=hi[1] {
                for x in lo[0]..=hi[0] {
                    let p = [x, y];
                    if [[a, b, p], [b, c, p], [c, a, p]].into_iter().all(|s| turn(s) >= 0) {
                        let height = ground.height(p);
                        assert!(range_m[0] <= height && height <= range_m[1], "{size:?} {corners:?} {p:?}");
                    }
                }
            }
        }
    }
}

/// Error over distance from a place on the ground.
fn from(eye: [i32; 2]) -> impl Fn(&Bound) -> f32 + Sync {
    move |bound: &Bound| {
        if !bound.has_area() {
            return OUT_OF_VIEW;
        }
        let away = [0, 1].map(|a| (eye[a] - eye[a].clamp(bound.lo[a], bound.hi[a])) as f32);
        bound.error_m / away[0].hypot(away[1]).max(1e-3)
    }
}

#[test]
fn refinement_ends_within_the_threshold_from_wherever_it_begins() {
    for size in SIZES {
        let ground = rough(size);
        let mut mesh = mesh(&ground);
        let side = Errors::of(&ground).side();
        for k in 0..12 {
            let eye = [k * 7 - 5, 40 - k * 5];
            let view = from(eye);
            assert!(!mesh.refine(60.0, usize::MAX, &view));
            check(&mesh, side);
            for t in leaves(&mesh) {
                let priority = view(&mesh.at(t).bound);
                assert!(priority <= 60.0, "{priority}");
                assert_eq!(priority, mesh.at(t).priority);
            }
            // The same camera again changes nothing.
            let (vertices, count) = (mesh.changed.len(), mesh.leaves);
            assert!(!mesh.refine(60.0, usize::MAX, &view));
            assert_eq!((vertices, count), (mesh.changed.len(), mesh.leaves));
        }
        assert!(!mesh.refine(60.0, usize::MAX, &|_: &Bound| OUT_OF_VIEW));
        assert_eq!((mesh.leaves, mesh.vertex_count()), (2, 4));
        let mut indices = vec![0];
        mesh.list(&mut indices);
        assert!(indices.is_empty());
    }
}

#[test]
fn what_is_listed_tiles_the_data() {
    for size in SIZES {
        let ground = rough(size);
        let last = ground.last();
        let mut mesh = mesh(&ground);
        mesh.refine(25.0, usize::MAX, &from([3, 3]));
        let mut indices = Vec::new();
        mesh.list(&mut indices);
        let clamped = |slot: u32| {
            let [x, y] = mesh.vertices[slot as usize];
            [x.min(last[0]), y.min(last[1])]
        };
        let areas = indices.chunks(3).map(|t| turn([clamped(t[0]), clamped(t[1]), clamped(t[2])]));
        assert!(areas.clone().all(|area| area > 0));
        assert_eq!(areas.sum::<i64>(), 2 * i64::from(last[0]) * i64::from(last[1]));
    }
}

#[test]
fn flat_data_and_heights_without_measure_are_drawn() {
    for height in [0.0, -1e12, 1e12] {
        let mut mesh = mesh(&ground([20, 300], |x, y| if (x, y) == (7, 7) { height } else { 0.0 }));
        assert!(!mesh.refine(1.0, usize::MAX, &from([7, 7])));
        assert!(mesh.leaves >= 2);
        assert_eq!(height == 0.0, mesh.leaves == 2);
    }
}

#[test]
fn the_cap_stops_splits_and_is_told() {
    let mut mesh = mesh(&rough([65, 65]));
    assert!(mesh.refine(0.0, 100, &from([30, 30])));
    check(&mesh, 64);
    assert!((100..150).contains(&mesh.leaves), "{}", mesh.leaves);
}

#[test]
fn copies_are_made_a_run_at_a_time() {
    let mut copies = vec![[0; 3]];
    runs(&[2, 3, 4, 9, 11, 12], &mut copies);
    let expected = [[0, 2, 3], [3, 9, 1], [4, 11, 2]].map(|copy| copy.map(|slots| slots * VERTEX_BYTES));
    assert_eq!(copies, expected);
    runs(&[], &mut copies);
    assert!(copies.is_empty());
}
