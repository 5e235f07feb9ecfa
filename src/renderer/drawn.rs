//! The surface as it was drawn, asked place by place on the CPU: levels, factors and geomorph of a frame.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;

use super::Renderer;
use crate::clipmap::{ChartWindows, Lattice, Node, Rect};
use crate::gpu::{GpuError, PatchNodes, packed_charts, read_buffer};
use crate::quads::{BlockKind, PATCH_CELLS, Patch, chart_spans};
use crate::reference::{Leaf, Placement, cell_triangles, coarse_ends, leaf_at};
use crate::scene::{Cell, Spot, Terrain, Triangle};

/// Chart, level and place in the level's lattice of blocks.
type Block = (u32, u32, [i32; 2]);

/// What is drawn over a part of a patch, in base nodes.
struct Part {
    lo: [i32; 2],
    hi: [i32; 2],
    triangles: Vec<[[i32; 2]; 3]>,
}

/// The surface as it was drawn: levels, factors, geomorph and all.
///
/// It holds where the frame's windows stood, not their samples: of a streamed terrain it asks for what has arrived
/// by now.
#[derive(Clone)]
pub struct DrawnSurface {
    terrain: Terrain,
    windows: ChartWindows,
    glued: bool,
    /// World metres that a plane's positions are relative to.
    anchor_m: DVec3,
    /// Where each chart's mesh stands.
    placements: Vec<Placement>,
    /// Patches whose factors went by their error.
    by_error: Arc<HashMap<Block, Patch>>,
}

impl Renderer {
    /// The surface of the last prepared frame. Where factors are uniform it follows from the windows; by error it
    /// reads the patches' vertices of the last submitted frame back and waits for the GPU: never in a frame.
    ///
    /// # Errors
    /// When no frame was prepared, or the device fails.
    pub fn drawn(&self) -> Result<DrawnSurface, GpuError> {
        let records: Vec<PatchNodes> = match &self.buffers.by_error {
            Some(by_error) => {
                let slots = self.patch_slots() as usize;
                read_buffer(&self.device, &self.queue, &by_error.leaves, slots)?
            }
            None => Vec::new(),
        };
        let nothing = || GpuError::Readback { reason: "no frame was prepared".into() };
        Ok(self.drawn_by_windows().ok_or_else(nothing)?.with_records(&records))
    }

    /// The same from the windows alone, with uniform factors.
    pub(super) fn drawn_by_windows(&self) -> Option<DrawnSurface> {
        let state = self.state.as_ref()?;
        let windows = state.windows.clone();
        let placements = match &state.placement {
            Some(placement) => vec![placement.clone()],
            // Of a chart only what the geomorph's weight takes.
            None => packed_charts(&windows)
                .iter()
                .zip(&windows.charts)
                .map(|(chart, own)| Placement {
                    windows: own.clone(),
                    anchor: chart.anchor,
                    anchor_height_m: 0.0,
                    spacing_m: [1.0; 2],
                    eye_samples: chart.eye,
                    morph: self.scene.morph,
                    fades: Default::default(),
                })
                .collect(),
        };
        Some(DrawnSurface {
            terrain: self.terrain.clone(),
            glued: windows.graph.is_glued(),
            windows,
            anchor_m: state.anchor_m,
            placements,
            by_error: Arc::default(),
        })
    }
}

impl DrawnSurface {
    /// With the vertices that the patches of its frame have, slot by slot. Those that were culled have none, or an
    /// earlier frame's, there: they count as drawn with uniform factors.
    pub(super) fn with_records(self, records: &[PatchNodes]) -> Self {
        let patches = records.iter().filter(|r| r.visible & 1 == 1).map(PatchNodes::patch);
        let by_error = patches.map(|p| ((p.chart, p.level, block_of(p.rect.lo)), p)).collect();
        Self { by_error: Arc::new(by_error), ..self }
    }

    /// The drawn surface under or over a world point; `None` where nothing is drawn (outside the data, voids).
    /// Culled patches count as drawn.
    #[must_use]
    pub fn at(&self, p: DVec3) -> Option<Spot> {
        let stand = self.terrain.stand(p)?;
        self.terrain.spot(&stand, &|chart, at| self.cell(chart, at))
    }

    /// The cell drawn at base coordinates of a chart: of the finest level whose window holds them.
    fn cell(&self, chart: usize, at: [f64; 2]) -> Option<Cell> {
        let own = &self.windows.charts[chart];
        let level = (own.finest..own.shape.levels()).find(|level| {
            let r = own.covered(*level);
            let holds = |a: usize| f64::from(r.lo[a]) <= at[a] && at[a] <= f64::from(r.hi[a]);
            r.has_area() && holds(0) && holds(1)
        })?;
        let area = own.loaded(level);
        let scale = f64::from(1_u32 << level);
        let node = [0, 1].map(|a: usize| ((at[a] / scale) as i32).clamp(area.lo[a], area.hi[a] - 1));
        let block = (u32::try_from(chart).unwrap_or_default(), level, block_of(node));
        // On curved bases the line through the foot may pass beside the leaf that holds it.
        let around = self.terrain.curved.is_some();
        let by_error = self.by_error.get(&block).and_then(|whole| leaf_of(whole, own.lattice, at, around));
        let part = by_error.unwrap_or_else(|| {
            let patch = cell_of(&self.windows, chart, level, node);
            let nodes = patch.bases(own.lattice);
            let [lo, hi] = [patch.rect.lo, patch.rect.hi].map(|node| own.lattice.base(level, node));
            let triangles = cell_triangles(&patch, [0, 0]).into_iter();
            Part { lo, hi, triangles: triangles.map(|t| t.map(|ix| nodes[ix as usize])).collect() }
        });
        let mut known: Vec<([i32; 2], Option<DVec3>)> = Vec::new();
        let mut point = |base: [i32; 2]| {
            if let Some((_, point)) = known.iter().find(|(node, _)| *node == base) {
                return *point;
            }
            let point = self.vertex_m(chart, level, base);
            known.push((base, point));
            point
        };
        let triangles = part.triangles.into_iter().map(|nodes| {
            let [a, b, c] = nodes.map(&mut point);
            Triangle { nodes, corners: a.zip(b).zip(c).map(|((a, b), c)| [a, b, c]) }
        });
        Some(Cell { level, lo: part.lo, hi: part.hi, triangles: triangles.collect() })
    }

    /// World position of the vertex that a patch of `level` has at a base node; `None` over a void.
    fn vertex_m(&self, chart: usize, level: u32, base: [i32; 2]) -> Option<DVec3> {
        let Some(curved) = &self.terrain.curved else {
            let (p, valid) = self.placements[0].position(self.terrain.source.as_ref(), level, base);
            return valid.then(|| self.anchor_m + DVec3::from_array(p.map(f64::from)));
        };
        let node = Node { chart, base };
        let (node, owner) = match self.glued {
            true => self.windows.owner(node),
            false => (node, self.windows.charts[chart].owner(level, base)),
        };
        let lattice = self.windows.charts[node.chart].lattice;
        let index = lattice.node(owner, node.base);
        let position = |level, index| curved.position(node.chart, level, index).map(|(p, _)| p);
        let own = position(owner, index)?;
        let placement = &self.placements[node.chart];
        if !placement.morph || owner + 1 >= self.windows.shape().levels() {
            return Some(own);
        }
        let weight = f64::from(placement.morph_weight(owner, node.base));
        if weight == 0.0 {
            return Some(own);
        }
        // Positions are blended here, not heights: the coarser cell's edge is straight.
        match coarse_ends(index, lattice.last_at(owner)).map(|end| position(owner + 1, end)) {
            [Some(a), Some(b)] => Some(own * (1.0 - weight) + (a + b) * (0.5 * weight)),
            _ => Some(own),
        }
    }
}

/// Block of a level's node.
fn block_of(node: [i32; 2]) -> [i32; 2] {
    node.map(|v| v.div_euclid(PATCH_CELLS.cast_signed()))
}

/// One cell of a level as a patch of its own, with uniform factors: its sides are divided as those of the patch
/// that has it, because both go by the edge alone.
fn cell_of(windows: &ChartWindows, chart: usize, level: u32, node: [i32; 2]) -> Patch {
    let rect = Rect { lo: node, hi: node.map(|v| v + 1) };
    let outer = chart_spans(windows, chart, level, rect);
    let chart = u32::try_from(chart).unwrap_or_default();
    Patch { chart, level, kind: BlockKind::M, rect, outer, by_error: None }
}

/// The leaf of a patch by error that holds base coordinates, and those beyond its edges within the patch where what
/// lies around is asked for. The corners are those of the leaf alone.
fn leaf_of(whole: &Patch, lattice: Lattice, at: [f64; 2], around: bool) -> Option<Part> {
    let leaf = leaf_at(whole, cells_from(whole, lattice, at))?;
    let mut places = leaf.triangles.clone();
    let beyond = beyond_edges(&leaf).into_iter().filter(|_| around).filter_map(|at| leaf_at(whole, at));
    // Beyond a side there is the leaf itself again.
    places.extend(beyond.filter(|other| other.corners != leaf.corners).flat_map(|other| other.triangles));
    let base = |place: [u32; 2]| whole.base_at(lattice, place);
    let [a, b, c] = leaf.corners.map(|node| base(node.map(|v| 2 * v)));
    let lo = [0, 1].map(|k: usize| a[k].min(b[k]).min(c[k]));
    let hi = [0, 1].map(|k: usize| a[k].max(b[k]).max(c[k]));
    Some(Part { lo, hi, triangles: places.into_iter().map(|t| t.map(base)).collect() })
}

/// Base coordinates in a patch as cells from its low corner; the data's last cell may be narrower than others.
fn cells_from(patch: &Patch, lattice: Lattice, at: [f64; 2]) -> [f64; 2] {
    let first = lattice.base(patch.level, patch.rect.lo);
    let last = lattice.base(patch.level, patch.rect.hi.map(|v| v - 1));
    let end = lattice.base(patch.level, patch.rect.hi);
    [0, 1].map(|a: usize| {
        let into_last = (at[a] - f64::from(last[a])) / f64::from(end[a] - last[a]);
        if into_last > 0.0 {
            return f64::from(patch.cells()[a] - 1) + into_last;
        }
        (at[a] - f64::from(first[a])) / f64::from(1_u32 << patch.level)
    })
}

/// Places a little beyond the middles of a leaf's edges, in cells as its corners are.
fn beyond_edges(leaf: &Leaf) -> [[f64; 2]; 3] {
    let [a, b, c] = leaf.corners.map(|node| node.map(f64::from));
    [(a, b, c), (b, c, a), (c, a, b)].map(|(from, to, opposite)| {
        [0, 1].map(|k: usize| {
            let middle = (from[k] + to[k]) * 0.5;
            middle + (middle - opposite[k]) * 0.01
        })
    })
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeSet, HashSet};

    use super::{cell_of, cells_from, leaf_of};
    use crate::clipmap::{ChartGraph, ChartWindows, ClipmapShape, Lattice, Rect};
    use crate::quads::{
        BLOCK_NODES, PATCH_CELLS, Patch, block_nodes, by_error, chart_patches, closed, full_cells,
    };
    use crate::reference::{cell_triangles, leaf_triangles};

    type Node = [i32; 2];

    /// Base nodes of the triangles of one cell of a patch with these vertices.
    fn triangles(patch: &Patch, bases: &[Node], cell: [u32; 2]) -> Vec<[Node; 3]> {
        cell_triangles(patch, cell).into_iter().map(|t| t.map(|ix| bases[ix as usize])).collect()
    }

    #[test]
    fn a_cell_alone_has_the_triangles_it_has_in_its_patch() {
        let ring = ChartGraph::grid(&[40, 40, 41], &[33, 33, 34], [true, true]);
        let plane = ChartGraph::single(Lattice { last: [122, 89] });
        let mut divided = 0;
        for (graph, n) in [(ring, 31), (plane, 15), (ChartGraph::cube(32), 31)] {
            let shape = graph.shape(n, None).unwrap();
            let far = graph.charts.len() - 1;
            for (home, centre) in [(0, [3.0, 1.0]), (0, [20.2, 29.9]), (far, [31.0, 16.0])] {
                for finest in 0..2 {
                    let windows = ChartWindows::place(&graph, shape, home, centre, finest);
                    for (_, patch) in chart_patches(&windows) {
                        let chart = patch.chart as usize;
                        let lattice = windows.charts[chart].lattice;
                        let bases = patch.bases(lattice);
                        let [w, h] = patch.cells();
                        for at in (0..h).flat_map(|y| (0..w).map(move |x| [x, y])) {
                            let low = [0, 1].map(|a: usize| patch.rect.lo[a] + at[a].cast_signed());
                            let alone = cell_of(&windows, chart, patch.level, low);
                            let wanted = triangles(&patch, &bases, at);
                            divided += usize::from(wanted.len() > 2);
                            let found = triangles(&alone, &alone.bases(lattice), [0, 0]);
                            assert_eq!(found, wanted, "{patch:?} {at:?}");
                        }
                    }
                }
            }
        }
        assert!(divided > 500, "{divided}");
    }

    /// Any field of own nodes: from block to block nothing, a few or all.
    fn own_nodes(lattice: Lattice, level: u32, block: Node) -> [u32; BLOCK_NODES] {
        let lo = block.map(|v| v * PATCH_CELLS.cast_signed());
        let last = lattice.last_at(level);
        let hi = [0, 1].map(|a: usize| (lo[a] + PATCH_CELLS.cast_signed()).min(last[a]));
        let cells = [0, 1].map(|a: usize| lo[a].abs_diff(hi[a]));
        let seed = 7 * level + 6 * block[0].unsigned_abs() + 3 * block[1].unsigned_abs();
        let chance = [0, 0, 10, 60, 1024][seed as usize % 5];
        let mut rows = [0; BLOCK_NODES];
        for [x, y] in block_nodes() {
            let mixed = (seed * 289 + 17 * y + x).wrapping_mul(2_654_435_761) >> 22;
            rows[y as usize] |= u32::from(mixed < chance) << x;
        }
        closed(cells, full_cells(lattice, level, Rect { lo, hi }), rows)
    }

    /// Undirected edges of triangles.
    fn edges(triangles: &[[Node; 3]]) -> Vec<[Node; 2]> {
        let each = triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
        each.map(|[p, q]| [p.min(q), p.max(q)]).collect()
    }

    /// Looks a patch's triangles up one by one; tells how many are parts of a leaf.
    fn check_leaves(whole: &Patch, lattice: Lattice) -> usize {
        let bases = whole.bases(lattice);
        let all: Vec<_> = leaf_triangles(whole).iter().map(|t| t.map(|ix| bases[ix as usize])).collect();
        let known: HashSet<_> = all.iter().copied().collect();
        let [first, end] = [whole.rect.lo, whole.rect.hi].map(|p| lattice.base(whole.level, p));
        let on_side =
            |[p, q]: [Node; 2]| (0..2).any(|k| p[k] == q[k] && (p[k] == first[k] || p[k] == end[k]));
        let mut divided = 0;
        for t in &all {
            let middle = [0, 1].map(|k| t.iter().map(|p| f64::from(p[k])).sum::<f64>() / 3.0);
            let alone = leaf_of(whole, lattice, middle, false).unwrap();
            assert!(alone.triangles.contains(t), "{whole:?} {t:?}");
            assert!(alone.triangles.iter().all(|t| known.contains(t)), "{whole:?} {t:?}");
            divided += usize::from(alone.triangles.len() > 1);
            let nodes: Vec<_> = alone.triangles.iter().flatten().collect();
            let least = [0, 1].map(|k: usize| nodes.iter().map(|p| p[k]).min().unwrap());
            let most = [0, 1].map(|k: usize| nodes.iter().map(|p| p[k]).max().unwrap());
            assert_eq!([alone.lo, alone.hi], [least, most]);
            // With what lies around every edge of the leaf but those on sides has triangles on both sides.
            let wide = leaf_of(whole, lattice, middle, true).unwrap();
            assert_eq!(wide.triangles[..alone.triangles.len()], alone.triangles[..]);
            assert!(wide.triangles.iter().all(|t| known.contains(t)), "{whole:?} {t:?}");
            assert_eq!(wide.triangles.iter().collect::<BTreeSet<_>>().len(), wide.triangles.len());
            let around = edges(&wide.triangles);
            for edge in edges(&alone.triangles).into_iter().filter(|edge| !on_side(*edge)) {
                assert_eq!(around.iter().filter(|e| **e == edge).count(), 2, "{whole:?} {t:?}");
            }
        }
        divided
    }

    #[test]
    fn a_leaf_alone_has_the_triangles_it_has_in_its_patch() {
        let mut divided = 0;
        for (last, centre) in [([530, 401], [265.0, 200.0]), ([299, 216], [10.0, 210.0])] {
            let lattice = Lattice { last };
            let shape = ClipmapShape::covering_by_blocks(127, lattice).unwrap();
            let windows = ChartWindows::place(&ChartGraph::single(lattice), shape, 0, centre, 0);
            let own = |level: u32, block: Node| own_nodes(lattice, level, block);
            for (_, patch) in chart_patches(&windows) {
                divided += check_leaves(&by_error(&windows.charts[0], &patch, &own), lattice);
            }
        }
        assert!(divided > 200, "{divided}");
    }

    /// Places on sides, corners and lines between cells, or rounding beside them, have a leaf as well.
    #[test]
    fn every_place_has_a_leaf() {
        let lattice = Lattice { last: [299, 216] };
        let shape = ClipmapShape::covering_by_blocks(127, lattice).unwrap();
        let windows = ChartWindows::place(&ChartGraph::single(lattice), shape, 0, [290.0, 210.0], 0);
        let own = |level: u32, block: Node| own_nodes(lattice, level, block);
        for (_, patch) in chart_patches(&windows) {
            let whole = by_error(&windows.charts[0], &patch, &own);
            let [lo, hi] = [patch.rect.lo, patch.rect.hi].map(|p| lattice.base(patch.level, p));
            for k in 0..33_i32 * 33 {
                let at = [0, 1].map(|a: usize| {
                    let share = f64::from([k % 33, k / 33][a]) / 32.0;
                    let beside = [0.0, 1e-12, -1e-12][k as usize % 3];
                    f64::from(lo[a]) + share * f64::from(hi[a] - lo[a]) + beside
                });
                let part = leaf_of(&whole, lattice, at, false).unwrap();
                let holds =
                    |a: usize| f64::from(part.lo[a]) <= at[a] + 1e-9 && at[a] - 1e-9 <= f64::from(part.hi[a]);
                assert!(holds(0) && holds(1), "{whole:?} {at:?}");
            }
            let end = cells_from(&whole, lattice, hi.map(f64::from));
            assert_eq!(end, whole.cells().map(f64::from));
        }
    }
}
