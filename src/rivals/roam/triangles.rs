//! Binary triangle trees over a square, kept conforming by forced splits: two roots, an arena of triangles
//! with the links of Duchaineau et al. 1997, and the vertices in use.

use std::sync::Arc;

use super::errors::{Bound, Errors, middle};
use crate::rivals::Ground;

/// No triangle.
pub(super) const NONE: u32 = u32::MAX;
/// In place of children: the triangle is not in use.
const FREE: u32 = u32::MAX - 1;
/// Priority of what is not in view: not drawn, and nothing is gained by splitting it.
pub(super) const OUT_OF_VIEW: f32 = -1.0;

/// A triangle of the trees. Links to neighbours are kept up to date for leaves only.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    /// Slots of its vertices, counter-clockwise from above: the right angle (apex), then the left and the
    /// right end of the hypotenuse.
    pub corners: [u32; 3],
    /// Neighbour across the edge from the apex to the left end.
    pub left: u32,
    /// Neighbour across the edge from the right end to the apex.
    pub right: u32,
    /// Neighbour across the hypotenuse.
    pub base: u32,
    pub parent: u32,
    /// First of two children, the left one; the right one is next to it.
    pub child: u32,
    pub bound: Bound,
    /// Error on screen, pixels, of a leaf in this frame; [`OUT_OF_VIEW`] if it is.
    pub priority: f32,
}

impl Triangle {
    pub fn is_leaf(&self) -> bool {
        self.child == NONE
    }
}

/// A conforming triangulation that lives from frame to frame.
pub(super) struct Triangulation {
    ground: Arc<Ground>,
    errors: Arc<Errors>,
    /// Pairs of siblings; the roots come first.
    pub triangles: Vec<Triangle>,
    /// First triangles of pairs not in use.
    free_pairs: Vec<u32>,
    /// Lattice places of the vertices, by slot. Each is the split vertex of one diamond, so a slot is taken
    /// when that is split and free when it is merged.
    pub vertices: Vec<[i32; 2]>,
    free_vertices: Vec<u32>,
    /// Slots taken since this was last emptied.
    pub changed: Vec<u32>,
    /// Triangles made since this was last emptied.
    pub fresh: Vec<u32>,
    /// Triangles of the triangulation.
    pub leaves: usize,
}

impl Triangulation {
    /// The two roots.
    pub fn new(ground: Arc<Ground>, errors: Arc<Errors>) -> Self {
        let side = errors.side();
        let vertices = vec![[0, 0], [side, 0], [0, side], [side, side]];
        let root = |corners: [u32; 3], base: u32| Triangle {
            corners,
            left: NONE,
            right: NONE,
            base,
            parent: NONE,
            child: NONE,
            bound: errors.bound(&ground, corners.map(|slot| vertices[slot as usize])),
            priority: OUT_OF_VIEW,
        };
        let triangles = vec![root([1, 3, 0], 1), root([2, 0, 3], 0)];
        Self {
            triangles,
            ground,
            errors,
            free_pairs: Vec::new(),
            changed: (0..4).collect(),
            vertices,
            free_vertices: Vec::new(),
            fresh: Vec::new(),
            leaves: 2,
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let slots = self.free_pairs.capacity()
            + self.free_vertices.capacity()
            + self.changed.capacity()
            + self.fresh.capacity();
        let triangles = self.triangles.capacity() * size_of::<Triangle>();
        (triangles + self.vertices.capacity() * size_of::<[i32; 2]>() + slots * size_of::<u32>()) as u64
    }

    pub fn at(&self, t: u32) -> &Triangle {
        &self.triangles[t as usize]
    }

    pub fn at_mut(&mut self, t: u32) -> &mut Triangle {
        &mut self.triangles[t as usize]
    }

    fn place(&self, slot: u32) -> [i32; 2] {
        self.vertices[slot as usize]
    }

    /// True for leaves whose hypotenuse has a vertex in its middle.
    pub fn can_split(&self, t: u32) -> bool {
        let triangle = self.at(t);
        let [_, left, right] = triangle.corners.map(|slot| self.place(slot));
        triangle.is_leaf() && (0..2).any(|a| left[a].abs_diff(right[a]) > 1)
    }

    /// Splits a leaf together with its neighbour across the hypotenuse; a coarser neighbour is split before
    /// that, so that the two form a diamond (forced split). Does nothing where nothing finer exists.
    pub fn split(&mut self, t: u32) {
        if !self.can_split(t) {
            return;
        }
        let base = self.at(t).base;
        if base != NONE && self.at(base).base != t {
            // Goes up a level each time, so no deeper than the trees are.
            self.split(base);
        }
        let Triangle { corners: [_, left, right], base, .. } = *self.at(t);
        let vertex = self.take_vertex(middle(self.place(left), self.place(right)));
        let first = self.halve(t, vertex);
        if base == NONE {
            return;
        }
        let other = self.halve(base, vertex);
        self.at_mut(first).right = other + 1;
        self.at_mut(other + 1).left = first;
        self.at_mut(first + 1).left = other;
        self.at_mut(other).right = first + 1;
    }

    /// Gives a leaf its children; returns the first. The links between the halves of a diamond are left open.
    fn halve(&mut self, t: u32, vertex: u32) -> u32 {
        let parent = *self.at(t);
        let [apex, left, right] = parent.corners;
        let first = self.take_pair();
        let child = |corners: [u32; 3], left: u32, right: u32, base: u32| Triangle {
            corners,
            left,
            right,
            base,
            parent: t,
            child: NONE,
            bound: self.errors.bound(&self.ground, corners.map(|slot| self.place(slot))),
            priority: OUT_OF_VIEW,
        };
        let low = child([vertex, apex, left], first + 1, NONE, parent.left);
        let high = child([vertex, right, apex], NONE, first, parent.right);
        *self.at_mut(first) = low;
        *self.at_mut(first + 1) = high;
        self.relink(parent.left, t, first);
        self.relink(parent.right, t, first + 1);
        self.at_mut(t).child = first;
        self.leaves += 1;
        self.fresh.extend([first, first + 1]);
        first
    }

    /// The triangles that would become leaves if `t` were merged, the lower number first and [`NONE`] for
    /// what lies outside the square; none unless all their children are leaves.
    pub fn diamond(&self, t: u32) -> Option<[u32; 2]> {
        let over_leaves = |t: u32| {
            let child = self.at(t).child;
            child < FREE && self.at(child).is_leaf() && self.at(child + 1).is_leaf()
        };
        if !over_leaves(t) {
            return None;
        }
        let base = self.at(t).base;
        (base == NONE || over_leaves(base)).then(|| [t.min(base), t.max(base)])
    }

    /// Merges the diamond that `t` is half of, if it can be merged.
    pub fn merge(&mut self, t: u32) {
        let Some(halves) = self.diamond(t) else { return };
        let vertex = self.at(self.at(t).child).corners[0];
        for half in halves.into_iter().filter(|half| *half != NONE) {
            self.join(half);
        }
        self.free_vertices.push(vertex);
    }

    fn join(&mut self, t: u32) {
        let first = self.at(t).child;
        let (left, right) = (self.at(first).base, self.at(first + 1).base);
        self.relink(left, first, t);
        self.relink(right, first + 1, t);
        let triangle = self.at_mut(t);
        triangle.left = left;
        triangle.right = right;
        triangle.child = NONE;
        self.at_mut(first).child = FREE;
        self.at_mut(first + 1).child = FREE;
        self.free_pairs.push(first);
        self.leaves -= 1;
    }

    /// Makes the triangle `at` a neighbour of `new` where it was one of `old`.
    fn relink(&mut self, at: u32, old: u32, new: u32) {
        if at == NONE {
            return;
        }
        let triangle = self.at_mut(at);
        for link in [&mut triangle.left, &mut triangle.right, &mut triangle.base] {
            if *link == old {
                *link = new;
            }
        }
    }

    fn take_pair(&mut self) -> u32 {
        if let Some(first) = self.free_pairs.pop() {
            return first;
        }
        let first = self.triangles.len() as u32;
        let unused = Triangle { child: FREE, ..self.triangles[0] };
        self.triangles.extend([unused; 2]);
        first
    }

    fn take_vertex(&mut self, place: [i32; 2]) -> u32 {
        let slot = match self.free_vertices.pop() {
            Some(slot) => {
                self.vertices[slot as usize] = place;
                slot
            }
            None => {
                self.vertices.push(place);
                self.vertices.len() as u32 - 1
            }
        };
        self.changed.push(slot);
        slot
    }

    /// Indices of the leaves in view, in the order of the trees, in which neighbours come close together. The
    /// apex is first: colours by level take the level of that vertex.
    pub fn list(&self, indices: &mut Vec<u32>) {
        indices.clear();
        let mut stack = vec![1, 0];
        while let Some(t) = stack.pop() {
            let triangle = self.at(t);
            if !triangle.is_leaf() {
                stack.extend([triangle.child + 1, triangle.child]);
            } else if triangle.priority >= 0.0 {
                indices.extend(triangle.corners);
            }
        }
    }

    /// Vertices in use.
    #[cfg(test)]
    pub fn vertex_count(&self) -> usize {
        self.vertices.len() - self.free_vertices.len()
    }
}
