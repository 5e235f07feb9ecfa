//! Charts: lattices glued along their borders, for base surfaces that one lattice cannot cover.
//!
//! Every border runs the same way in both charts that share it, so a node keeps its index along it.
//! One clipmap stands in each chart. A chart the camera is not over is entered at its nearest point,
//! and holds a level only where that level's window could reach it from the camera. Levels on both
//! sides of a border then differ by one at most (tests/charts.rs tries it), which is all that the
//! doubling of shared edges needs. Fruehstueck 2008, section 3.5.3, runs one instance of the algorithm
//! for each chart in reach likewise.

use super::{ClipmapError, ClipmapShape, Lattice, Rect, Windows};

/// Most charts a surface may have: what four bits of a patch record can name.
pub const MAX_CHARTS: usize = 9;

/// A side of a chart, in the order of a patch's sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Side {
    /// Second index 0.
    South = 0,
    /// Second index last.
    North = 1,
    /// First index 0.
    West = 2,
    /// First index last.
    East = 3,
}

impl Side {
    /// All four.
    pub const ALL: [Self; 4] = [Self::South, Self::North, Self::West, Self::East];

    /// Axis that counts along the side.
    #[must_use]
    pub fn along(self) -> usize {
        usize::from(matches!(self, Self::West | Self::East))
    }

    /// True on the side of the last index.
    #[must_use]
    pub fn is_high(self) -> bool {
        matches!(self, Self::North | Self::East)
    }
}

/// What lies beyond a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Neighbour {
    /// Number of the chart.
    pub chart: usize,
    /// Its side that is glued here.
    pub side: Side,
}

/// One chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chart {
    /// Its base lattice.
    pub lattice: Lattice,
    /// What lies beyond each side, in the order of [`Side::ALL`]; `None` where the surface ends.
    pub neighbours: [Option<Neighbour>; 4],
    /// True when its indices turn clockwise seen from outside the surface.
    pub mirrored: bool,
}

/// All charts of a surface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChartGraph {
    /// The charts, by number.
    pub charts: Vec<Chart>,
}

/// A base node of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    /// Number of the chart.
    pub chart: usize,
    /// Base index.
    pub base: [i32; 2],
}

impl ChartGraph {
    /// One chart with open borders.
    #[must_use]
    pub fn single(lattice: Lattice) -> Self {
        Self { charts: vec![Chart { lattice, neighbours: [None; 4], mirrored: false }] }
    }

    /// `columns` x `rows` charts of the given cells each, glued into a ring wherever that axis is
    /// periodic. A periodic axis needs three charts of like size, so that no chart meets another on two
    /// sides and levels differ by one at most; see [`thirds`].
    #[must_use]
    pub fn grid(columns: &[i32], rows: &[i32], periodic: [bool; 2]) -> Self {
        let count = [columns.len(), rows.len()];
        let number = |at: [usize; 2]| at[1] * count[0] + at[0];
        let beyond = |at: [usize; 2], side: Side| {
            let axis = 1 - side.along();
            let (n, v) = (count[axis], at[axis]);
            let ends = if side.is_high() { v + 1 == n } else { v == 0 };
            if ends && !periodic[axis] {
                return None;
            }
            let mut next = at;
            next[axis] = if side.is_high() { (v + 1) % n } else { (v + n - 1) % n };
            let opposite = match side {
                Side::South => Side::North,
                Side::North => Side::South,
                Side::West => Side::East,
                Side::East => Side::West,
            };
            Some(Neighbour { chart: number(next), side: opposite })
        };
        let charts = (0..count[1])
            .flat_map(|y| (0..count[0]).map(move |x| [x, y]))
            .map(|at| Chart {
                lattice: Lattice { last: [columns[at[0]], rows[at[1]]] },
                neighbours: Side::ALL.map(|s| beyond(at, s)),
                mirrored: false,
            })
            .collect();
        Self { charts }
    }

    /// The six faces of a cube of `size` cells a side, numbered and turned as `surface::Face`.
    #[must_use]
    pub fn cube(size: i32) -> Self {
        use crate::surface::Face;
        let charts = Face::ALL
            .map(|face| {
                let neighbours = Side::ALL.map(|side| {
                    // The side lies across one of the face's axes; beyond it is the face on that axis.
                    let axis = face.axes()[1 - side.along()];
                    let next = Face { axis, positive: side.is_high() };
                    let ours = next.axes().iter().position(|a| *a == face.axis).unwrap_or(0);
                    let glued = match (ours, face.positive) {
                        (0, false) => Side::West,
                        (0, true) => Side::East,
                        (_, false) => Side::South,
                        (_, true) => Side::North,
                    };
                    Some(Neighbour { chart: next.number(), side: glued })
                });
                Chart { lattice: Lattice { last: [size, size] }, neighbours, mirrored: face.mirrored() }
            })
            .to_vec();
        Self { charts }
    }

    /// True when any two charts are glued.
    #[must_use]
    pub fn is_glued(&self) -> bool {
        self.charts.iter().any(|c| c.neighbours.iter().any(Option::is_some))
    }

    /// A clipmap shape for all charts; without `levels`, the fewest whose coarsest window covers any
    /// chart whole.
    ///
    /// # Errors
    /// As [`ClipmapShape::new`]; glued charts need n of at least 31, or levels could differ by two.
    pub fn shape(&self, n: u32, levels: Option<u32>) -> Result<ClipmapShape, ClipmapError> {
        self.shape_of(n, levels, false)
    }

    /// As [`ChartGraph::shape`], laid out in whole blocks ([`ClipmapShape::covering_by_blocks`]).
    ///
    /// # Errors
    /// As [`ChartGraph::shape`]; n must be 127 or more, on glued charts 511.
    pub fn shape_by_blocks(&self, n: u32, levels: Option<u32>) -> Result<ClipmapShape, ClipmapError> {
        self.shape_of(n, levels, true)
    }

    fn shape_of(&self, n: u32, levels: Option<u32>, blocks: bool) -> Result<ClipmapShape, ClipmapError> {
        let given = |levels, lattice| {
            let shape = ClipmapShape::new(n, levels, lattice)?;
            if blocks { shape.by_blocks() } else { Ok(shape) }
        };
        let longest =
            self.charts.iter().map(|c| c.lattice.last).fold([1, 1], |m, l| [m[0].max(l[0]), m[1].max(l[1])]);
        let lattice = Lattice { last: longest };
        let covering = match blocks {
            true => ClipmapShape::covering_by_blocks(n, lattice)?,
            false => ClipmapShape::covering(n, lattice)?,
        };
        if !self.is_glued() {
            return match levels {
                Some(levels) => given(levels, lattice),
                None => Ok(covering),
            };
        }
        // Of the layout, in its units.
        let least = 32 * covering.unit() - 1;
        if n < least {
            return Err(ClipmapError::GluedWindowSize { n, least });
        }
        // Sixteen levels of a small window need not reach around a large surface.
        let reach = covering.reach() << (covering.levels() - 1);
        if reach < i64::from(longest[0].max(longest[1])) {
            return Err(ClipmapError::GluedWindowSize { n, least: (2 * n + 1).min(1023) });
        }
        // Where the surface is closed, everything must be covered: fewer levels would leave holes.
        match levels {
            Some(levels) if levels < covering.levels() => {
                Err(ClipmapError::GluedLevelCount { levels, least: covering.levels() })
            }
            Some(levels) => given(levels, lattice),
            None => Ok(covering),
        }
    }

    /// Sides of its chart that a node lies on.
    pub fn sides(&self, node: Node) -> impl Iterator<Item = Side> + '_ {
        let last = self.charts[node.chart].lattice.last;
        Side::ALL.into_iter().filter(move |s| {
            let axis = 1 - s.along();
            node.base[axis] == if s.is_high() { last[axis] } else { 0 }
        })
    }

    /// The same node as the chart beyond `side` counts it.
    #[must_use]
    pub fn across(&self, node: Node, side: Side) -> Option<Node> {
        let next = self.charts[node.chart].neighbours[side as usize]?;
        let last = self.charts[next.chart].lattice.last;
        let across = 1 - next.side.along();
        let mut base = [0; 2];
        base[next.side.along()] = node.base[side.along()];
        base[across] = if next.side.is_high() { last[across] } else { 0 };
        Some(Node { chart: next.chart, base })
    }

    /// All names of a node, its own first: one inside a chart, two on a border, three or four at a
    /// corner.
    #[must_use]
    pub fn names(&self, node: Node) -> Vec<Node> {
        let mut out = vec![node];
        let mut done = 0;
        while done < out.len() {
            let at = out[done];
            for side in self.sides(at) {
                if let Some(next) = self.across(at, side)
                    && !out.contains(&next)
                {
                    out.push(next);
                }
            }
            done += 1;
        }
        out
    }

    /// The one name all charts agree on: that in the chart of the lowest number.
    #[must_use]
    pub fn canonical(&self, node: Node) -> Node {
        self.names(node).into_iter().min_by_key(|n| n.chart).unwrap_or(node)
    }

    /// Where the clipmap of each chart stands for a camera over `centre` of chart `home`, and how far
    /// away that is, both in base cells. The home chart has the centre itself; a chart beside it the
    /// point of the shared border nearest to it; the others the point nearest to the entry of a chart
    /// between. Distances are the greatest leg of the way, along one axis: a sum would make levels
    /// differ by two across borders behind the first.
    #[must_use]
    pub fn entries(&self, home: usize, centre: [f64; 2]) -> Vec<([f64; 2], f64)> {
        let last = |chart: usize| self.charts[chart].lattice.last.map(f64::from);
        let mut best: Vec<Option<([f64; 2], f64)>> = vec![None; self.charts.len()];
        best[home] = Some(([0, 1].map(|a| centre[a].clamp(0.0, last(home)[a])), 0.0));
        // Two borders lead from any chart to any other; a third round would find nothing nearer.
        for _ in 0..2 {
            for chart in 0..self.charts.len() {
                let Some((p, away)) = best[chart] else { continue };
                for side in Side::ALL {
                    let Some(next) = self.charts[chart].neighbours[side as usize] else { continue };
                    let axis = 1 - side.along();
                    let before = if side.is_high() { last(chart)[axis] - p[axis] } else { p[axis] };
                    let across = 1 - next.side.along();
                    let mut q = [0.0; 2];
                    q[next.side.along()] = p[side.along()];
                    q[across] = if next.side.is_high() { last(next.chart)[across] } else { 0.0 };
                    let away = away.max(before);
                    if best[next.chart].is_none_or(|(_, known)| away < known) {
                        best[next.chart] = Some((q, away));
                    }
                }
            }
        }
        best.into_iter().map(|found| found.unwrap_or(([0.0; 2], f64::INFINITY))).collect()
    }
}

/// Windows of all charts: a pure function of the camera's place, as [`Windows`] is.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartWindows {
    /// How the charts are glued.
    pub graph: ChartGraph,
    /// Windows of each chart, by number.
    pub charts: Vec<Windows>,
    /// Chart the camera is over.
    pub home: usize,
    /// Point of each chart its windows stand around, in base cells.
    pub centres: Vec<[f64; 2]>,
}

impl ChartWindows {
    /// Places the windows of all charts around `centre` of chart `home`, in base cells.
    #[must_use]
    pub fn place(
        graph: &ChartGraph,
        shape: ClipmapShape,
        home: usize,
        centre: [f64; 2],
        finest: u32,
    ) -> Self {
        let reach = shape.reach() as f64;
        let entries = graph.entries(home, centre);
        let glued = graph.is_glued();
        let charts = graph
            .charts
            .iter()
            .zip(&entries)
            .map(|(chart, (entry, away))| {
                let mut own = finest.min(shape.levels() - 1);
                while own + 1 < shape.levels() && *away > reach * f64::from(1_u32 << own) {
                    own += 1;
                }
                let mut windows = Windows::place(shape, chart.lattice, *entry, own);
                windows.sleeps = glued;
                windows.apron = chart.neighbours.map(|n| n.is_some());
                windows
            })
            .collect();
        let centres = entries.into_iter().map(|(p, _)| p).collect();
        Self { graph: graph.clone(), charts, home, centres }
    }

    /// Window size and level count, the same in all charts.
    #[must_use]
    pub fn shape(&self) -> ClipmapShape {
        self.charts[0].shape
    }

    /// Finest drawn level whose window holds a base node of a chart, border included.
    #[must_use]
    pub fn finest_at(&self, node: Node) -> u32 {
        let windows = &self.charts[node.chart];
        (windows.finest..windows.shape.levels())
            .find(|l| windows.covered(*l).contains(node.base))
            .unwrap_or(windows.shape.levels())
    }

    /// Chart and level whose samples own a node: the finest that holds it, of those the chart of the
    /// lowest number. All patches around the node decide alike.
    #[must_use]
    pub fn owner(&self, node: Node) -> (Node, u32) {
        self.graph
            .names(node)
            .into_iter()
            .map(|n| (n, self.finest_at(n)))
            .min_by_key(|(n, level)| (*level, n.chart))
            .unwrap_or((node, 0))
    }

    /// The part of a chart's side along which the chart beyond draws `level` or finer, as base indices
    /// along the side.
    #[must_use]
    pub fn beyond(&self, chart: usize, side: Side, level: u32) -> Option<[i32; 2]> {
        let next = self.graph.charts[chart].neighbours[side as usize]?;
        let windows = &self.charts[next.chart];
        if level < windows.finest {
            return None;
        }
        let covered: Rect = windows.covered(level);
        let across = 1 - next.side.along();
        let reaches = if next.side.is_high() {
            covered.hi[across] == windows.lattice.last[across]
        } else {
            covered.lo[across] == 0
        };
        let along = next.side.along();
        (covered.has_area() && reaches).then(|| [covered.lo[along], covered.hi[along]])
    }
}

/// A periodic axis of `cells` cells cut into three charts of like size.
#[must_use]
pub fn thirds(cells: i32) -> [i32; 3] {
    [cells / 3, (cells + 1) / 3, (cells + 2) / 3]
}
