//! Patches: pieces of control quads of at most 16 x 16 cells, clipped to the data.

use super::{
    BlockKind, ByError, ControlQuad, OuterSpan, chart_spans, control_points, control_quads, outer_spans,
};
use crate::clipmap::{ChartWindows, ClipmapShape, Lattice, Rect, Windows};

/// Cells per side of a patch: the unit of culling, expansion and drawing.
pub const PATCH_CELLS: u32 = 16;

/// One patch: where it lies and how its edges are divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Chart it belongs to; 0 where there is only one.
    pub chart: u32,
    /// Level it belongs to.
    pub level: u32,
    /// Block of the layout it was cut from.
    pub kind: BlockKind,
    /// Its corners in the level's lattice; always at least one cell.
    pub rect: Rect,
    /// Divisions of the south, north, west and east sides, where factors are uniform.
    pub outer: [OuterSpan; 4],
    /// Its vertices where they go by error.
    pub by_error: Option<ByError>,
}

impl Patch {
    /// Cells east and north.
    #[must_use]
    pub fn cells(&self) -> [u32; 2] {
        [0, 1].map(|a| self.rect.hi[a].abs_diff(self.rect.lo[a]))
    }

    /// Base sample at a place in half cells from its low corner: a node, or the middle of a side's cell.
    #[must_use]
    pub fn base_at(&self, lattice: Lattice, place: [u32; 2]) -> [i32; 2] {
        let node = [0, 1].map(|a: usize| self.rect.lo[a] + fit(place[a] / 2));
        let base = lattice.base(self.level, node);
        [0, 1].map(|a: usize| base[a] + fit((place[a] % 2) << self.level >> 1))
    }

    /// Base samples of its vertices in the order of its expansion. Uniform factors: the grid, then those that the
    /// south, north, west and east sides add. By error: see [`ByError::places`].
    #[must_use]
    pub fn bases(&self, lattice: Lattice) -> Vec<[i32; 2]> {
        let [w, h] = self.cells();
        if let Some(by_error) = &self.by_error {
            return by_error.places([w, h]).into_iter().map(|p| self.base_at(lattice, p)).collect();
        }
        let corner = |at: [u32; 2]| self.base_at(lattice, at.map(|v| 2 * v));
        let mut out: Vec<[i32; 2]> = (0..=h).flat_map(|y| (0..=w).map(move |x| [x, y])).map(corner).collect();
        for (side, span) in self.outer.into_iter().enumerate() {
            for at in 0..self.cells()[side / 2] {
                let start = corner([[at, 0], [at, h], [0, at], [w, at]][side]);
                for t in 1..span.segments(at) {
                    let mut p = start;
                    p[side / 2] += fit(t << self.level >> span.log2);
                    out.push(p);
                }
            }
        }
        out
    }

    /// Vertices its expansion writes: of uniform factors the grid, then the extra ones of its sides.
    #[must_use]
    pub fn vertex_count(&self) -> u32 {
        let [w, h] = self.cells();
        self.by_error.map_or_else(|| (w + 1) * (h + 1) + self.extra(), |b| b.vertex_count())
    }

    /// Triangles its expansion writes: of uniform factors two a cell, one more for every extra vertex.
    #[must_use]
    pub fn triangle_count(&self) -> u32 {
        let [w, h] = self.cells();
        self.by_error.map_or_else(|| 2 * w * h + self.extra(), |b| b.triangle_count([w, h]))
    }

    fn extra(&self) -> u32 {
        self.outer.iter().map(|span| span.extra()).sum()
    }
}

fn fit(v: u32) -> i32 {
    i32::try_from(v).unwrap_or(i32::MAX)
}

/// Patches east and north that a quad of the given cells is cut into.
#[must_use]
pub fn patches_across(quad_cells: [u32; 2]) -> [u32; 2] {
    quad_cells.map(|c| c.div_ceil(PATCH_CELLS))
}

/// Size of a control quad in cells.
fn quad_cells(points: &[[u32; 2]], quad: &ControlQuad) -> [u32; 2] {
    let lo = points[usize::from(quad.corners[0])];
    let hi = points[usize::from(quad.corners[3])];
    [hi[0] - lo[0], hi[1] - lo[1]]
}

/// First patch slot of each quad of a level, and patches east and north.
#[must_use]
pub fn patch_slots(shape: ClipmapShape, quads: &[ControlQuad]) -> Vec<(u32, [u32; 2])> {
    let points = control_points(shape);
    let mut first = 0;
    quads
        .iter()
        .map(|q| {
            let across = patches_across(quad_cells(&points, q));
            let slot = (first, across);
            first += across[0] * across[1];
            slot
        })
        .collect()
}

/// Patch slots every level has: the same for all levels and all places of the L.
#[must_use]
pub fn slots_per_level(shape: ClipmapShape) -> u32 {
    let l = crate::clipmap::LPosition { high_x: false, high_y: false };
    let slots = patch_slots(shape, &control_quads(shape, l));
    slots.last().map_or(0, |(first, across)| first + across[0] * across[1])
}

/// All patches drawn for these windows when nothing is culled, with their slot numbers.
#[must_use]
pub fn patches(windows: &Windows) -> Vec<(u32, Patch)> {
    patches_with(windows, |level, rect| outer_spans(windows, level, rect))
}

/// As [`patches`], for all charts; slots are numbered chart after chart.
#[must_use]
pub fn chart_patches(windows: &ChartWindows) -> Vec<(u32, Patch)> {
    let per_chart = slots_per_level(windows.shape()) * windows.shape().levels();
    let mut out = Vec::new();
    for (chart, own) in (0_u32..).zip(&windows.charts) {
        let all = patches_with(own, |level, rect| chart_spans(windows, chart as usize, level, rect));
        out.extend(all.into_iter().map(|(slot, p)| (chart * per_chart + slot, Patch { chart, ..p })));
    }
    out
}

fn patches_with(windows: &Windows, spans: impl Fn(u32, Rect) -> [OuterSpan; 4]) -> Vec<(u32, Patch)> {
    let shape = windows.shape;
    let points = control_points(shape);
    let per_level = slots_per_level(shape);
    let mut out = Vec::new();
    for level in windows.finest..shape.levels() {
        let quads = control_quads(shape, windows.l_position_of_data(level));
        let data = windows.loaded(level);
        let origin = windows.origins[level as usize];
        for (quad, (first, across)) in quads.iter().zip(patch_slots(shape, &quads)) {
            let is_finest = level == windows.finest;
            let drawn = match quad.kind {
                BlockKind::M | BlockKind::R => true,
                BlockKind::L => !is_finest,
                BlockKind::Fill => is_finest,
            };
            if !drawn {
                continue;
            }
            let at = |corner: u8| {
                let p = points[usize::from(corner)];
                [0, 1].map(|a| origin[a] + i32::try_from(p[a]).unwrap_or(i32::MAX))
            };
            let (lo, hi) = (at(quad.corners[0]), at(quad.corners[3]));
            for k in 0..across[0] * across[1] {
                let step = |a: usize, k: u32| {
                    let from = lo[a] + i32::try_from(k * PATCH_CELLS).unwrap_or(i32::MAX);
                    (from, (from + PATCH_CELLS as i32).min(hi[a]))
                };
                let (x, y) = (step(0, k % across[0]), step(1, k / across[0]));
                let rect = Rect { lo: [x.0, y.0], hi: [x.1, y.1] }.intersect(data);
                if rect.has_area() {
                    let outer = spans(level, rect);
                    let slot = level * per_level + first + k;
                    out.push((slot, Patch { chart: 0, level, kind: quad.kind, rect, outer, by_error: None }));
                }
            }
        }
    }
    out
}
