//! The quadtree of chunks with what is known of each beforehand (Ulrich 2002).

use rayon::prelude::*;

use crate::rivals::Ground;
use crate::rivals::geomipmap::grid::{cell_error, height_range, joined};
use crate::rivals::stage::Stand;

/// A chunk: level 0 has every sample, each further one half of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Node {
    /// log2 of the samples between its vertices.
    pub level: u32,
    /// Chunks of this level from the south-west.
    pub at: [u32; 2],
}

/// Nodes of one level.
struct Level {
    /// East and north; nodes beyond the data do not exist.
    count: [u32; 2],
    /// Number of the first one.
    first: u32,
}

/// Per chunk its error and the range of heights under it.
pub(crate) struct Tables {
    /// Cells a side of a chunk.
    pub cells: u32,
    last: [i32; 2],
    /// From the leaves to the root.
    levels: Vec<Level>,
    /// Metres; no less than the children's.
    errors: Vec<f32>,
    ranges: Vec<[f32; 2]>,
}

impl Tables {
    /// Measures every chunk against all samples under it.
    #[must_use]
    pub fn of(ground: &Ground, cells: u32) -> Self {
        let last = ground.last();
        let mut tables = Self { cells, last, levels: Vec::new(), errors: Vec::new(), ranges: Vec::new() };
        loop {
            let level = tables.levels.len() as u32;
            let first = tables.errors.len() as u32;
            let count = last.map(|l| l.max(1).unsigned_abs().div_ceil(cells << level));
            tables.levels.push(Level { count, first });
            let made: Vec<(f32, [f32; 2])> = (0..count[0] * count[1])
                .into_par_iter()
                .map(|k| tables.measure(ground, Node { level, at: [k % count[0], k / count[0]] }))
                .collect();
            for (error, range) in made {
                tables.errors.push(error);
                tables.ranges.push(range);
            }
            if count == [1, 1] {
                return tables;
            }
        }
    }

    /// Error and heights of a node whose children are known.
    fn measure(&self, ground: &Ground, node: Node) -> (f32, [f32; 2]) {
        let (lo, hi) = self.extent(node);
        if node.level == 0 {
            return (0.0, height_range(ground, lo, hi));
        }
        let step = 1_i32 << node.level;
        // Rows at once: the coarsest levels have fewer nodes than there are cores.
        let own = (0..self.cells.cast_signed())
            .into_par_iter()
            .map(|row| {
                let y = lo[1] + row * step;
                if y >= hi[1] {
                    return 0.0;
                }
                (lo[0]..hi[0])
                    .step_by(step as usize)
                    .map(|x| cell_error(ground, [x, y], step))
                    .fold(0.0, f32::max)
            })
            .reduce(|| 0.0, f32::max);
        let known = |child: Node| {
            let k = self.number(child) as usize;
            (self.errors[k], self.ranges[k])
        };
        let start = (own, [f32::INFINITY, f32::NEG_INFINITY]);
        self.children(node).map(known).fold(start, |(e, r), (error, range)| (e.max(error), joined(r, range)))
    }

    /// The root.
    pub(super) fn root(&self) -> Node {
        Node { level: self.levels.len() as u32 - 1, at: [0, 0] }
    }

    /// Nodes east and north on a level.
    pub(super) fn count(&self, level: u32) -> [u32; 2] {
        self.levels[level as usize].count
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.errors.len()
    }

    /// Number of a node.
    pub(super) fn number(&self, node: Node) -> u32 {
        let level = &self.levels[node.level as usize];
        level.first + node.at[1] * level.count[0] + node.at[0]
    }

    /// Node of a number.
    pub(super) fn node(&self, number: u32) -> Node {
        let level = self.levels.partition_point(|l| l.first <= number) - 1;
        let Level { count, first } = self.levels[level];
        let rest = number - first;
        Node { level: level as u32, at: [rest % count[0], rest / count[0]] }
    }

    /// Children that exist; a leaf has none.
    pub(super) fn children(&self, node: Node) -> impl Iterator<Item = Node> + '_ {
        let below = node.level.checked_sub(1);
        let all = [[0, 0], [1, 0], [0, 1], [1, 1]].into_iter();
        below.into_iter().flat_map(move |level| {
            let count = self.count(level);
            all.clone()
                .map(move |corner| Node { level, at: [0, 1].map(|a| 2 * node.at[a] + corner[a]) })
                .filter(move |child| child.at[0] < count[0] && child.at[1] < count[1])
        })
    }

    /// First sample of a node.
    pub(super) fn low(&self, node: Node) -> [i32; 2] {
        node.at.map(|v| (v * (self.cells << node.level)).cast_signed())
    }

    /// First and last sample.
    fn extent(&self, node: Node) -> ([i32; 2], [i32; 2]) {
        let lo = self.low(node);
        let side = (self.cells << node.level).cast_signed();
        (lo, [0, 1].map(|a| (lo[a] + side).min(self.last[a])))
    }

    /// True when a node may be seen.
    pub(super) fn is_seen(&self, node: Node, stand: &Stand) -> bool {
        let (lo, hi) = self.extent(node);
        stand.sees(lo, hi, self.ranges[self.number(node) as usize])
    }

    /// True when a node's error is too large on screen, seen from the nearest point of its box.
    pub(super) fn is_too_coarse(&self, node: Node, stand: &Stand, pixel_error: f64) -> bool {
        let (lo, hi) = self.extent(node);
        let k = self.number(node) as usize;
        stand.error_px(self.errors[k], stand.distance_m(lo, hi, self.ranges[k])) > pixel_error
    }

    /// Bytes of all tables.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&self.errors[..]) + size_of_val(&self.ranges[..])) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::super::patterns::pattern;
    use super::*;
    use crate::rivals::geomipmap::check;

    #[test]
    fn errors_equal_those_of_the_triangles_drawn_and_are_nested() {
        for (w, h) in [(37, 22), (2, 2), (2, 40), (9, 9), (33, 34)] {
            let ground = check::rough(w, h);
            let tables = Tables::of(&ground, 8);
            for number in 0..tables.nodes() as u32 {
                let node = tables.node(number);
                assert_eq!(tables.number(node), number);
                let numbers = pattern(8, [0; 4]);
                let step = 1 << node.level;
                let triangles = check::triangles(&numbers, 8, tables.low(node), step, ground.last());
                let below =
                    tables.children(node).map(|c| f64::from(tables.errors[tables.number(c) as usize]));
                let worst = below.fold(check::slow_error(&ground, &triangles), f64::max);
                let error = f64::from(tables.errors[number as usize]);
                assert!((error - worst).abs() < 1e-4, "{w} x {h}, {node:?}: {error}, {worst}");
            }
        }
    }

    #[test]
    fn children_tile_their_parent() {
        let ground = check::rough(331, 262);
        let tables = Tables::of(&ground, 8);
        assert_eq!(tables.count(tables.root().level), [1, 1]);
        for number in 0..tables.nodes() as u32 {
            let node = tables.node(number);
            let area = |n: Node| {
                let (lo, hi) = tables.extent(n);
                i64::from(hi[0] - lo[0]) * i64::from(hi[1] - lo[1])
            };
            let range = tables.ranges[number as usize];
            if node.level > 0 {
                assert_eq!(tables.children(node).map(area).sum::<i64>(), area(node));
            }
            let (lo, hi) = tables.extent(node);
            assert_eq!(height_range(&ground, lo, hi), range);
        }
    }
}
