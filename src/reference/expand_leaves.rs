//! Twin of shaders/expand_leaves.wgsl: the triangles of a patch whose vertices are chosen one by one, by plain
//! recursion over the bisection.

use std::collections::HashMap;

use crate::quads::{ByError, Patch, side_place};

/// A triangle of the bisection, nodes counter-clockwise from its right angle.
type Corners = [[u32; 2]; 3];

/// Half cells east and north of a patch's low corner.
type Place = [u32; 2];

/// What every block begins as.
const ROOTS: [Corners; 2] = [[[0, 0], [16, 0], [0, 16]], [[16, 16], [0, 16], [16, 0]]];

/// A triangle of the bisection that no own node halves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// Its nodes, counter-clockwise from its right angle.
    pub corners: [[u32; 2]; 3],
    /// What is drawn of it, counter-clockwise: one triangle, and one more for every extra vertex on its edges.
    /// Corners are places for [`Patch::base_at`].
    pub triangles: Vec<[[u32; 2]; 3]>,
}

/// Triangles of a patch whose factors go by error, counter-clockwise; they count its vertices as
/// [`Patch::bases`] does. None of a patch with uniform factors.
#[must_use]
pub fn leaf_triangles(patch: &Patch) -> Vec<[u32; 3]> {
    let Some(bisection) = Bisection::of(patch) else { return Vec::new() };
    let mut leaves = Vec::new();
    for root in ROOTS {
        bisection.collect(root, &mut leaves);
    }
    let places = bisection.by_error.places(bisection.cells);
    let indices: HashMap<Place, u32> = places.into_iter().zip(0..).collect();
    let all = leaves.into_iter().flat_map(|leaf| bisection.fan(leaf));
    all.map(|t| t.map(|place| indices[&place])).collect()
}

/// The leaf over a place in cells from a patch's low corner; over an edge, either of both. `None` where factors
/// are uniform.
#[must_use]
pub fn leaf_at(patch: &Patch, at: [f64; 2]) -> Option<Leaf> {
    let bisection = Bisection::of(patch)?;
    let at = [0, 1].map(|a: usize| at[a].clamp(0.0, f64::from(bisection.cells[a])));
    let mut roots = ROOTS;
    if at[0] + at[1] > 16.0 {
        roots.reverse();
    }
    let corners = roots.into_iter().find_map(|root| bisection.find(root, at))?;
    Some(Leaf { corners, triangles: bisection.fan(corners) })
}

/// A patch's own nodes as a tree of triangles.
struct Bisection<'a> {
    by_error: &'a ByError,
    cells: [u32; 2],
}

impl<'a> Bisection<'a> {
    fn of(patch: &'a Patch) -> Option<Self> {
        patch.by_error.as_ref().map(|by_error| Self { by_error, cells: patch.cells() })
    }

    /// True when nothing of a triangle lies inside the patch.
    fn is_outside(&self, t: Corners) -> bool {
        (0..2).any(|a| t.iter().all(|corner| corner[a] >= self.cells[a]))
    }

    /// Both halves of a triangle that is no leaf, that on the left of its right angle last. One whose middle lies
    /// outside reaches beyond the data's end and is halved as well.
    fn halves(&self, [a, b, c]: Corners) -> Option<[Corners; 2]> {
        let sum = [0, 1].map(|k: usize| b[k] + c[k]);
        if sum.iter().any(|v| !v.is_multiple_of(2)) {
            return None; // half a cell: the finest there is
        }
        let middle = sum.map(|v| v / 2);
        let is_outside = (0..2).any(|k| middle[k] > self.cells[k]);
        (is_outside || self.by_error.has(middle)).then_some([[middle, a, b], [middle, c, a]])
    }

    /// True when all corners are vertices; what reaches beyond the data's end is no leaf.
    fn is_whole(&self, t: Corners) -> bool {
        t.iter().all(|corner| self.by_error.has(*corner))
    }

    /// Appends the leaves in a triangle.
    fn collect(&self, t: Corners, out: &mut Vec<Corners>) {
        if self.is_outside(t) {
            return;
        }
        if let Some(halves) = self.halves(t) {
            for half in halves {
                self.collect(half, out);
            }
        } else if self.is_whole(t) {
            out.push(t);
        }
    }

    /// The leaf of a triangle that is next to a place, which the triangle holds but for rounding; `None` where it
    /// has no leaves. A place beside the line between two halves may count to the wrong one, and that may lie
    /// outside: then the other one has it.
    fn find(&self, t: Corners, at: [f64; 2]) -> Option<Corners> {
        if self.is_outside(t) {
            return None;
        }
        let Some(mut halves) = self.halves(t) else { return self.is_whole(t).then_some(t) };
        let [right, middle] = [t[0], halves[0][0]].map(|node| node.map(f64::from));
        let from_right = |p: [f64; 2]| [p[0] - right[0], p[1] - right[1]];
        let (line, off) = (from_right(middle), from_right(at));
        if line[0] * off[1] - line[1] * off[0] > 0.0 {
            halves.reverse();
        }
        halves.into_iter().find_map(|half| self.find(half, at))
    }

    /// A leaf's triangles. An edge with extra vertices is fanned from the corner opposite to it. Where both legs
    /// have some (in roots, and in corners where the data ends), the leg along x is; the last of its triangles has
    /// the other leg, which is fanned from the first vertex beside the right angle.
    fn fan(&self, [a, b, c]: Corners) -> Vec<[Place; 3]> {
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|edge| self.chain(edge));
        let over = |apex: Place, chain: &[Place]| {
            let all = chain.windows(2).map(|e| [apex, e[0], e[1]]);
            all.collect::<Vec<_>>()
        };
        let [right, from, to] = [a, b, c].map(doubled);
        if bc.len() > 2 {
            // On a side: then both legs lie aslant inside.
            return over(right, &bc);
        }
        if a[1] == b[1] {
            [over(to, &ab[1..]), over(ab[1], &ca)].concat()
        } else {
            let last = ca.len() - 2;
            [over(from, &ca[..=last]), over(ca[last], &ab)].concat()
        }
    }

    /// Vertices along an edge from one node to another: where it lies on a side, with the extra ones between.
    fn chain(&self, [from, to]: [[u32; 2]; 2]) -> Vec<Place> {
        let mut out = vec![doubled(from)];
        if let Some(side) = self.side_of(from, to) {
            let along = side / 2;
            let (start, end) = (2 * from[along], 2 * to[along]);
            let between = (start.min(end) + 1..start.max(end)).filter(|j| self.by_error.has_extra(side, *j));
            out.extend(between.map(|j| side_place(self.cells, side, j)));
            if start > end {
                out[1..].reverse();
            }
        }
        out.push(doubled(to));
        out
    }

    /// Side that an edge lies on.
    fn side_of(&self, from: [u32; 2], to: [u32; 2]) -> Option<usize> {
        (0..4).find(|side| {
            let across = 1 - side / 2;
            let line = if side % 2 == 1 { self.cells[across] } else { 0 };
            from[across] == line && to[across] == line
        })
    }
}

/// Where a node stands.
fn doubled(node: [u32; 2]) -> Place {
    node.map(|v| 2 * v)
}
