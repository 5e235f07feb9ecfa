//! Which chunks are drawn: refinement from the root, breadth first, as Brandstetter 2007, section 3.4, with
//! Ulrich's errors for the threshold; then neighbours are told what their edges lack (section 3.5).
//!
//! An edge of 2^k segments cannot match a neighbour more than k levels coarser: such neighbours are split
//! until they are near enough, which the paper leaves open.

use super::tables::{Node, Tables};
use crate::rivals::geomipmap::grid::beside;
use crate::rivals::stage::Stand;

/// What became of a node this frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Something above it is drawn or out of view.
    Unreached,
    /// Out of view.
    Culled,
    /// Its children stand for it.
    Split,
    /// Drawn.
    Drawn,
}

/// A chunk to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chunk {
    /// Which one.
    pub node: Node,
    /// How many levels each neighbour is coarser: south, north, west, east.
    pub coarser: [u32; 4],
}

/// This frame's chunks.
pub(super) struct Refinement {
    states: Vec<State>,
    /// Nodes in view, parents before children.
    reached: Vec<Node>,
    /// What is drawn.
    pub chunks: Vec<Chunk>,
}

impl Refinement {
    /// Nothing chosen yet.
    pub fn new(tables: &Tables) -> Self {
        Self { states: vec![State::Unreached; tables.nodes()], reached: Vec::new(), chunks: Vec::new() }
    }

    /// Chooses for a camera; with `cull` off all chunks are in view.
    pub fn refine(&mut self, tables: &Tables, stand: &Stand, pixel_error: f64, cull: bool) {
        self.states.fill(State::Unreached);
        self.reached.clear();
        let in_view = |node: Node| !cull || tables.is_seen(node, stand);
        self.reach(tables, &in_view, tables.root());
        let mut k = 0;
        while k < self.reached.len() {
            let node = self.reached[k];
            if node.level > 0 && tables.is_too_coarse(node, stand, pixel_error) {
                self.split(tables, &in_view, node);
            }
            k += 1;
        }
        self.restrict(tables, &in_view);
        self.chunks.clear();
        for k in 0..self.reached.len() {
            let node = self.reached[k];
            if self.state(tables, node) == State::Drawn {
                let coarser =
                    [0, 1, 2, 3].map(|side| self.coarser(tables, node, side).map_or(0, |(_, by)| by));
                self.chunks.push(Chunk { node, coarser });
            }
        }
    }

    /// Splits neighbours that are too much coarser. Their children are appended to what was reached, so that
    /// those' neighbours are looked at in turn.
    fn restrict(&mut self, tables: &Tables, in_view: &impl Fn(Node) -> bool) {
        let most = tables.cells.ilog2();
        let mut k = 0;
        while k < self.reached.len() {
            let node = self.reached[k];
            for side in 0..4 {
                if self.state(tables, node) != State::Drawn {
                    break;
                }
                while let Some((over, by)) = self.coarser(tables, node, side) {
                    if by <= most {
                        break;
                    }
                    self.split(tables, in_view, over);
                }
            }
            k += 1;
        }
    }

    fn reach(&mut self, tables: &Tables, in_view: &impl Fn(Node) -> bool, node: Node) {
        let seen = in_view(node);
        self.states[tables.number(node) as usize] = if seen { State::Drawn } else { State::Culled };
        if seen {
            self.reached.push(node);
        }
    }

    fn split(&mut self, tables: &Tables, in_view: &impl Fn(Node) -> bool, node: Node) {
        self.states[tables.number(node) as usize] = State::Split;
        for child in tables.children(node) {
            self.reach(tables, in_view, child);
        }
    }

    fn state(&self, tables: &Tables, node: Node) -> State {
        self.states[tables.number(node) as usize]
    }

    /// The drawn chunk across a side when it is as coarse or coarser, and by how many levels. Finer ones see
    /// to the edge themselves, and one out of view has none to match.
    fn coarser(&self, tables: &Tables, node: Node, side: usize) -> Option<(Node, u32)> {
        let next = beside(node.at, side, tables.count(node.level))?;
        for by in 0..=tables.root().level - node.level {
            let over = Node { level: node.level + by, at: next.map(|v| v >> by) };
            match self.state(tables, over) {
                State::Unreached => {}
                State::Drawn => return Some((over, by)),
                State::Culled | State::Split => return None,
            }
        }
        None
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let lists = size_of_val(&self.reached[..]) + size_of_val(&self.chunks[..]);
        (size_of_val(&self.states[..]) + lists) as u64
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::patterns::pattern;
    use super::*;
    use crate::rivals::Ground;
    use crate::rivals::geomipmap::check;

    /// Flat but for two needles just west of the middle, where all four quadrants of the root meet.
    fn needles() -> Ground {
        check::ground(513, 513, |x, y| if x == 255 && (y == 255 || y == 257) { 100.0 } else { 0.0 })
    }

    fn assert_conforming(ground: &Ground, tables: &Tables, chunks: &[Chunk]) {
        let mut triangles = Vec::new();
        for c in chunks {
            let numbers = pattern(tables.cells, c.coarser);
            let (lo, step) = (tables.low(c.node), 1 << c.node.level);
            triangles.extend(check::triangles(&numbers, tables.cells, lo, step, ground.last()));
        }
        check::assert_conforming(&triangles, ground.last());
    }

    #[test]
    fn chunks_conform_and_tile_the_data() {
        for (w, h) in [(331, 262), (2, 2), (2, 500), (65, 65), (40, 33), (129, 70)] {
            let rough = check::rough(w, h);
            let ground = check::ground(w, h, |x, y| {
                let share = if 3 * x > w && 3 * y > h { 1.0 } else { 1e-3 };
                share * rough.height([x as i32, y as i32])
            });
            let tables = Tables::of(&ground, 8);
            let mut refinement = Refinement::new(&tables);
            for (x, pixel_error) in [(0.0, 1.0), (150.0, 30.0), (100.0, 200.0), (1e4, 0.3), (50.0, f64::NAN)]
            {
                refinement.refine(&tables, &check::stand(DVec3::new(x, 90.0, 60.0)), pixel_error, false);
                assert_conforming(&ground, &tables, &refinement.chunks);
            }
        }
    }

    #[test]
    fn the_quadtree_is_restricted_to_what_edges_can_match() {
        let ground = needles();
        let tables = Tables::of(&ground, 8);
        let mut refinement = Refinement::new(&tables);
        let stand = check::stand(DVec3::new(255.0, 255.0, 50.0));
        refinement.refine(&tables, &stand, 1.0, false);
        let most = refinement.chunks.iter().flat_map(|c| c.coarser).max();
        assert_eq!(most, Some(3), "nothing was at the limit");
        assert_conforming(&ground, &tables, &refinement.chunks);
        // Without the restriction a needle's chunk would lie beside one more than three levels coarser.
        let root = tables.root();
        let quadrants: Vec<Node> = tables.children(root).collect();
        let level = quadrants[1].level;
        assert!(level > 3 && !tables.is_too_coarse(quadrants[1], &stand, 1.0));
        assert_ne!(refinement.state(&tables, quadrants[1]), State::Drawn);
        assert!(refinement.chunks.iter().any(|c| c.node.level == 0));
    }

    #[test]
    fn chunks_in_view_match_those_in_view() {
        let ground = check::rough(331, 262);
        let tables = Tables::of(&ground, 8);
        let eye = DVec3::new(100.0, 100.0, 120.0);
        let mut refinement = Refinement::new(&tables);
        refinement.refine(&tables, &check::stand_seeing_east_of(eye, 150.0), 300.0, true);
        let chunks = &refinement.chunks;
        assert!(!chunks.is_empty());
        let covers = |c: &Chunk, p: [i32; 2]| {
            let lo = tables.low(c.node);
            let side = 8 << c.node.level;
            (0..2).all(|a| lo[a] <= p[a] && p[a] < lo[a] + side)
        };
        for y in (0..261).step_by(4) {
            for x in (0..330).step_by(4) {
                let over = chunks.iter().filter(|c| covers(c, [x, y])).count();
                assert!(over <= 1 && (over == 1 || x < 150), "[{x}, {y}] is covered {over} times");
            }
        }
        for c in chunks {
            assert!(c.coarser.iter().all(|by| *by <= 3));
        }
    }

    #[test]
    fn flat_data_is_one_chunk() {
        let tables = Tables::of(&check::ground(200, 90, |_, _| 5.0), 16);
        let mut refinement = Refinement::new(&tables);
        refinement.refine(&tables, &check::stand(DVec3::new(10.0, 10.0, 6.0)), 0.0, true);
        assert_eq!(refinement.chunks, [Chunk { node: tables.root(), coarser: [0; 4] }]);
    }
}
