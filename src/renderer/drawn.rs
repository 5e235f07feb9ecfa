//! The surface as it was drawn, asked place by place on the CPU: levels, factors and geomorph of a frame.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;

use super::Renderer;
use crate::clipmap::{ChartWindows, Node, Rect};
use crate::gpu::{GpuError, PatchRecord, packed_charts, read_buffer};
use crate::quads::{BlockKind, ByError, PATCH_CELLS, Patch, chart_spans, slots_per_level};
use crate::reference::{Placement, cell_triangles, coarse_ends};
use crate::scene::{Cell, Spot, Terrain, Triangle};

/// Chart, level and place in the level's lattice of blocks.
type Block = (u32, u32, [i32; 2]);

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
    /// reads the patch records of the last submitted frame back and waits for the GPU: never in a frame.
    ///
    /// # Errors
    /// When no frame was prepared, or the device fails.
    pub fn drawn(&self) -> Result<DrawnSurface, GpuError> {
        let records = if self.plan.variant.by_error {
            let slots = (slots_per_level(self.shape) * self.lanes()) as usize;
            read_buffer(&self.device, &self.queue, &self.buffers.patches, slots)?
        } else {
            Vec::new()
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
    /// With the factors that all patch records of its frame have. Patches that were culled have none there: they
    /// count as drawn with uniform ones.
    pub(super) fn with_records(self, records: &[PatchRecord]) -> Self {
        let patches = records.iter().map(PatchRecord::patch).filter(|p| p.by_error.is_some());
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
        let patch = match self.by_error.get(&block) {
            Some(whole) => step_of(whole, node),
            None => cell_of(&self.windows, chart, level, node),
        };
        let nodes = patch.bases(own.lattice);
        let points: Vec<_> = nodes.iter().map(|base| self.vertex_m(chart, level, *base)).collect();
        let triangles = cell_triangles(&patch, [0, 0]).into_iter().map(|t| {
            let [a, b, c] = t.map(|ix| points[ix as usize]);
            Triangle {
                nodes: t.map(|ix| nodes[ix as usize]),
                corners: a.zip(b).zip(c).map(|((a, b), c)| [a, b, c]),
            }
        });
        let [lo, hi] = [patch.rect.lo, patch.rect.hi].map(|node| own.lattice.base(level, node));
        Some(Cell { level, lo, hi, triangles: triangles.collect() })
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

/// The one step of a patch by error that holds a node's cell, as a patch of its own.
fn step_of(whole: &Patch, node: [i32; 2]) -> Patch {
    let Some(factors) = whole.by_error else { return *whole };
    let steps = whole.steps();
    let at = [0, 1].map(|a: usize| node[a].abs_diff(whole.rect.lo[a]) >> factors.step);
    let lo = [0, 1].map(|a: usize| whole.rect.lo[a] + (at[a] << factors.step).cast_signed());
    let hi = [0, 1].map(|a: usize| (lo[a] + (1 << factors.step)).min(whole.rect.hi[a]));
    let is_last = [0, 1].map(|a: usize| at[a] + 1 == steps[a]);
    let mut own = ByError { step: factors.step, ..ByError::default() };
    for (side, on_border) in [at[1] == 0, is_last[1], at[0] == 0, is_last[0]].into_iter().enumerate() {
        if on_border {
            own.log2[side] = [factors.log2_at(side, at[side / 2]); 2];
            own.lost[side] = if is_last[side / 2] { factors.lost[side] } else { 0 };
        }
    }
    Patch { rect: Rect { lo, hi }, by_error: Some(own), ..*whole }
}

#[cfg(test)]
mod tests {
    use super::{cell_of, step_of};
    use crate::clipmap::{ChartGraph, ChartWindows, ClipmapShape, Lattice};
    use crate::quads::{Patch, by_error, chart_patches, most_step};
    use crate::reference::cell_triangles;

    type Node = [i32; 2];

    /// Base nodes of the triangles of one cell of a patch with these vertices.
    fn triangles(patch: &Patch, bases: &[Node], cell: [u32; 2]) -> Vec<[Node; 3]> {
        cell_triangles(patch, cell).into_iter().map(|t| t.map(|ix| bases[ix as usize])).collect()
    }

    /// Those of a patch of one cell.
    fn all_triangles(patch: &Patch, lattice: Lattice) -> Vec<[Node; 3]> {
        triangles(patch, &patch.bases(lattice), [0, 0])
    }

    /// The cells of a patch's own grid, and the low node of each.
    fn cells(patch: &Patch) -> Vec<([u32; 2], Node)> {
        let [w, h] = patch.steps();
        let low =
            |at: [u32; 2]| [0, 1].map(|a: usize| patch.rect.lo[a] + (at[a] << patch.step()).cast_signed());
        (0..h).flat_map(|y| (0..w).map(move |x| [x, y])).map(|at| (at, low(at))).collect()
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
                        for (at, low) in cells(&patch) {
                            let alone = cell_of(&windows, chart, patch.level, low);
                            let wanted = triangles(&patch, &bases, at);
                            divided += usize::from(wanted.len() > 2);
                            assert_eq!(all_triangles(&alone, lattice), wanted, "{patch:?} {at:?}");
                        }
                    }
                }
            }
        }
        assert!(divided > 500, "{divided}");
    }

    #[test]
    fn a_step_alone_has_the_triangles_it_has_in_its_patch() {
        let mut divided = 0;
        for (last, centre) in [([530, 401], [265.0, 200.0]), ([299, 216], [10.0, 210.0])] {
            let lattice = Lattice { last };
            let shape = ClipmapShape::covering_by_blocks(127, lattice).unwrap();
            let windows = ChartWindows::place(&ChartGraph::single(lattice), shape, 0, centre, 0);
            let own = &windows.charts[0];
            // Any field of steps: neighbours differ.
            let step = |level: u32, block: [i32; 2]| {
                let mixed = 7 * level.cast_signed() + 5 * block[0] + 3 * block[1] + block[0] * block[1];
                mixed.rem_euclid(5).cast_unsigned().min(most_step(own, level, block))
            };
            for (_, patch) in chart_patches(&windows) {
                let whole = by_error(own, &patch, &step);
                let bases = whole.bases(lattice);
                for (at, low) in cells(&whole) {
                    let wanted = triangles(&whole, &bases, at);
                    divided += usize::from(wanted.len() > 2);
                    // Any cell of the step finds it.
                    let high =
                        [0, 1].map(|a: usize| (low[a] + (1 << whole.step()) - 1).min(whole.rect.hi[a] - 1));
                    for node in [low, high] {
                        let alone = step_of(&whole, node);
                        assert_eq!(all_triangles(&alone, lattice), wanted, "{whole:?} {at:?} {node:?}");
                    }
                }
            }
        }
        assert!(divided > 200, "{divided}");
    }
}
