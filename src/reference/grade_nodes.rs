//! Twin of shaders/grade_nodes.wgsl: how far a block's surface moves where a node, and all that needs it, is left
//! out.
//!
//! A node's diamond is the two triangles that it halves: without it they stay whole, and its grade is how far the
//! level's samples lie off them.

use std::collections::HashMap;

use crate::pyramid::BlockDeviation;
use crate::quads::{BLOCK_NODES, Diamond, block_nodes, children, diamond, is_forced, rank};

/// When a node is left out. Grades never fall from a node to its parents, so those above any threshold are closed.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub enum Grade {
    /// Always: it changes nothing, or is none of the block's.
    Never,
    /// Where so many metres of vertical deviation from the full-resolution samples are allowed.
    Metres(f64),
    /// At no threshold.
    Always,
}

/// Grades of a block's nodes, `[y][x]`. `heights` gives the level's own samples at its nodes, metres, `None` over
/// voids; `cells` and `full` are the block's (see [`crate::quads::full_cells`]), `figures` what is known of it.
#[must_use]
pub fn grades(
    heights: &dyn Fn([u32; 2]) -> Option<f64>,
    cells: [u32; 2],
    full: [u32; 2],
    figures: BlockDeviation,
) -> [[Grade; BLOCK_NODES]; BLOCK_NODES] {
    let figure = |rank: u32| {
        let metres = figures.metres(rank as usize);
        (metres < BlockDeviation::UNKNOWN.metres(0)).then_some(f64::from(metres))
    };
    let mut out = [[Grade::Never; BLOCK_NODES]; BLOCK_NODES];
    // Where there are voids that the level may not show, sides keep all their nodes: a finer level may put its own there.
    let keeps_sides = figure(1).is_none();
    let mut block = Block { heights, cells, full, keeps_sides, measured: HashMap::new() };
    let mut nodes: Vec<_> = block_nodes().filter(|node| block.has(*node)).collect();
    nodes.sort_by_key(|node| rank(*node));
    for node in nodes {
        let measured = block.measure(node);
        out[node[1] as usize][node[0] as usize] = match figure(0) {
            Some(finest) if !measured.always && measured.worst + finest > 0.0 => {
                let most = figure(rank(node)).unwrap_or(f64::INFINITY);
                Grade::Metres((measured.worst + finest).min(most))
            }
            Some(_) if !measured.always => Grade::Never,
            _ => Grade::Always,
        };
        block.measured.insert(node, measured);
    }
    out
}

/// What is known of a node.
#[derive(Clone, Copy, Default)]
struct Measured {
    /// Interval of deviations along the side alone that its edge, or edges of its cell, lie on; holds 0.
    side: Option<[f64; 2]>,
    /// Worst deviation where it or a node that needs it is left out, whatever extra vertices sides have.
    worst: f64,
    /// It is never left out.
    always: bool,
}

struct Block<'a> {
    heights: &'a dyn Fn([u32; 2]) -> Option<f64>,
    cells: [u32; 2],
    full: [u32; 2],
    keeps_sides: bool,
    /// Nodes of lower ranks.
    measured: HashMap<[u32; 2], Measured>,
}

impl Block<'_> {
    fn has(&self, node: [u32; 2]) -> bool {
        node[0] <= self.cells[0] && node[1] <= self.cells[1]
    }

    fn height(&self, node: [u32; 2]) -> Option<f64> {
        if self.has(node) { (self.heights)(node) } else { None }
    }

    /// True when an edge lies on a side.
    fn on_side(&self, [from, to]: [[u32; 2]; 2]) -> bool {
        (0..2).any(|a| from[a] == to[a] && (from[a] == 0 || from[a] == self.cells[a]))
    }

    /// Deviations of all nodes in a closed triangle from its plane, and whether some are void.
    fn deviations(&self, corners: [[u32; 2]; 3]) -> (Vec<f64>, bool) {
        let [a, b, c] = corners.map(|p| p.map(f64::from));
        let heights = corners.map(|p| self.height(p));
        let (mut found, mut voids) = (Vec::new(), false);
        for node in block_nodes() {
            let [x, y] = node.map(f64::from);
            let area = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
                (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
            };
            let all = area(a, b, c);
            let shares = [area([x, y], b, c), area([x, y], c, a), area([x, y], a, b)].map(|part| part / all);
            if shares.iter().any(|share| *share < 0.0) {
                continue;
            }
            match (self.height(node), heights) {
                (Some(own), [Some(p), Some(q), Some(r)]) => {
                    found.push(own - (p * shares[0] + q * shares[1] + r * shares[2]));
                }
                (Some(_), _) => found.push(0.0),
                (None, _) => voids = true,
            }
        }
        (found, voids)
    }

    /// Deviations of the nodes of an edge from the straight line.
    fn along(&self, [from, to]: [[u32; 2]; 2]) -> [f64; 2] {
        let axis = usize::from(from[0] == to[0]);
        let length = f64::from(to[axis] - from[axis]);
        let off = |at: u32| {
            let mut node = from;
            node[axis] = at;
            let share = f64::from(at - from[axis]) / length;
            match [node, from, to].map(|n| self.height(n)) {
                [Some(own), Some(a), Some(b)] => own - (a * (1.0 - share) + b * share),
                _ => 0.0,
            }
        };
        (from[axis]..=to[axis]).map(|at| [off(at); 2]).fold([0.0; 2], hull)
    }

    fn measure(&self, node: [u32; 2]) -> Measured {
        let is_corner = (0..2).all(|a| node[a] == 0 || node[a] == self.cells[a]);
        let Some(Diamond { ends, apexes }) = diamond(node).filter(|_| !is_corner) else {
            return Measured { always: true, ..Measured::default() };
        };
        let needing: Vec<_> = children(node).iter().filter_map(|c| self.measured.get(c)).copied().collect();
        // Nodes of the halves that lie in the data; where one reaches beyond it, the node is forced.
        let halves = apexes.iter().filter(|apex| self.has(**apex));
        let found: Vec<_> = halves.map(|apex| self.deviations([ends[0], ends[1], *apex])).collect();
        let valid = found.iter().any(|(deviations, _)| !deviations.is_empty());
        let void = found.iter().any(|(_, voids)| *voids);
        let all = found.iter().flat_map(|(deviations, _)| deviations);
        let [low, high] = all.map(|off| [*off; 2]).fold([0.0; 2], hull);
        let side = if rank(node).is_multiple_of(2) {
            // Those that need it are the middles of its cell's edges.
            needing.iter().filter_map(|c| c.side).reduce(hull)
        } else {
            self.on_side(ends).then(|| self.along(ends))
        };
        // What extra vertices on a side add is between nothing and what that side deviates by.
        let [side_low, side_high] = side.unwrap_or_default();
        let own = (high - side_low).max(side_high - low);
        Measured {
            side,
            worst: needing.iter().fold(own, |worst, c| worst.max(c.worst)),
            always: is_forced(self.cells, self.full, node)
                || (valid && void)
                || (self.keeps_sides && valid && self.on_side(ends))
                || needing.iter().any(|c| c.always),
        }
    }
}

/// The least interval that holds two.
fn hull(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}
