//! How much GPU memory a scene takes: one function of its shape, for the plan and for the allocation.

use serde::Serialize;

use super::curve::{GpuChart, GpuCurve};
use super::layouts::{Counters, GpuChoice, GpuControlQuad, GpuFrame, PatchNodes, PatchRecord};
use super::shaders::Ground;
use crate::clipmap::{ClipmapShape, MAX_CHARTS, MAX_LEVELS};
use crate::pyramid::FIGURES;
use crate::quads::{CONTROL_POINTS, PATCH_CELLS, QUADS_PER_LEVEL, slots_per_level};
use crate::surface::{ANCHOR_WORDS, RECORD_WORDS};

/// Most lanes there are: levels of all charts.
pub(crate) const MAX_LANES: usize = MAX_CHARTS * MAX_LEVELS as usize;

/// Words of a block's deviations.
pub(crate) const DEVIATION_WORDS: usize = FIGURES.div_ceil(2);
/// Words of a block's grades: three for all, then five a row of 17 nodes and a column of each side, eight bits each.
const GRADE_WORDS: u64 = 3 + 19 * 5;
/// Words of a patch's leaves, as the expansion reads them.
const LEAF_WORDS: u64 = 96;

/// Room for expanded vertices and indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// Vertices, 16 bytes each.
    pub vertices: u32,
    /// Indices, 4 bytes each.
    pub indices: u32,
}

impl Capacity {
    /// Room for every patch of every level at once: nothing can be dropped on one chart. Of glued charts,
    /// the one under the camera draws whole windows and those around it no more than halves: three times
    /// one chart's room is ample, and a reported overflow makes it grow all the same.
    #[must_use]
    pub fn worst_case(shape: ClipmapShape, charts: u32) -> Self {
        let cells = u64::from(shape.cells()).pow(2);
        let ring = cells - u64::from(2 * shape.m() + shape.unit()).pow(2);
        let all = cells + ring * u64::from(shape.levels() - 1);
        let slots = u64::from(slots_per_level(shape) * shape.levels());
        // A patch adds one row and column of vertices and at most one doubled cell a side: 4 x 16.
        let per_patch = u64::from(4 * PATCH_CELLS + 1 + 2 * PATCH_CELLS);
        let clamp = |v: u64| u32::try_from(v).unwrap_or(u32::MAX);
        Self {
            vertices: clamp((all + slots * per_patch) * u64::from(charts.min(3))),
            indices: clamp(
                3 * (2 * all + u64::from(8 * shape.n()) * u64::from(shape.levels()))
                    * u64::from(charts.min(3)),
            ),
        }
    }

    /// Room for what factors by error draw. No patch has other vertices than its nodes and, beside a finer
    /// level, the half cells between them: those it has with uniform factors. Under a budget the mesh has no
    /// more triangles than that, or than its coarsest form: two a patch and one for each vertex that a
    /// neighbour adds; 18 are allowed for, and 512 where the data's end cuts a block, of which no window holds
    /// more than a row and a column. Where voids keep patches from being coarse, the budget may not be met.
    #[must_use]
    pub fn by_error(shape: ClipmapShape, charts: u32, budget: Option<u32>, has_voids: bool) -> Self {
        let all = Self::worst_case(shape, charts);
        let Some(budget) = budget.filter(|_| !has_voids) else { return all };
        let levels = shape.levels() * charts.min(3);
        let slots = slots_per_level(shape) * levels;
        let cut = 2 * ((shape.n() + 1) / PATCH_CELLS) * levels;
        let coarsest = slots.saturating_mul(18).saturating_add(cut.saturating_mul(2 * PATCH_CELLS.pow(2)));
        let triangles = budget.max(coarsest);
        // A patch of t triangles has at most t + 2 vertices.
        let vertices = triangles.saturating_add(2 * slots);
        Self { vertices: all.vertices.min(vertices), indices: all.indices.min(triangles.saturating_mul(3)) }
    }

    /// What of it fits into buffers of at most `most` bytes.
    #[must_use]
    pub fn fitted(self, most: u64) -> Self {
        let clamp = |v: u64| u32::try_from(v).unwrap_or(u32::MAX);
        Self {
            vertices: self.vertices.min(clamp(most / 16)).max(1),
            indices: self.indices.min(clamp(most / 4)).max(3),
        }
    }
}

/// What the sizes of buffers follow from, besides the clipmap's shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// What samples are.
    pub ground: Ground,
    /// Charts of the base surface.
    pub charts: u32,
    /// Samples travel as two bytes.
    pub short: bool,
    /// Blocks of samples have bounds.
    pub bounds: bool,
    /// Blocks have deviations.
    pub deviations: bool,
    /// Patches leave nodes out by them.
    pub by_error: bool,
    /// What a frame refills is marked.
    pub refill: bool,
    /// Bounds of visible patches are drawn.
    pub boxes: bool,
    /// Cells of a block of the base surface, a power of two.
    pub block_cells: u32,
}

impl Extent {
    /// A plane with samples of four bytes.
    pub const PLANE: Self = Self {
        ground: Ground::Plane,
        charts: 1,
        short: false,
        bounds: true,
        deviations: false,
        by_error: false,
        refill: false,
        boxes: false,
        block_cells: 16,
    };

    /// Bytes of a sample in a window.
    #[must_use]
    pub fn sample_bytes(self) -> u64 {
        if self.ground == Ground::Plane { 4 } else { 16 }
    }

    /// Bytes of a sample on its way there.
    #[must_use]
    pub fn staged_bytes(self) -> u64 {
        match (self.ground, self.short) {
            (Ground::Points, _) => 12,
            (_, true) => 2,
            (_, false) => 4,
        }
    }

    /// Blocks a side of a lane's toroidal table of records: those in a window, and both ragged ends.
    /// Positions need none.
    #[must_use]
    pub(crate) fn record_side(self, shape: ClipmapShape) -> u32 {
        if self.ground == Ground::Curved { (shape.n() + 1) / self.block_cells + 3 } else { 0 }
    }

    /// The same for anchors: a power of two, because every vertex looks its anchor up.
    #[must_use]
    pub(crate) fn anchor_side(self, shape: ClipmapShape) -> u32 {
        ((shape.n() + 1) / self.block_cells + 3).next_power_of_two()
    }
}

/// Blocks of bounds a side of a lane: of 16 cells on a plane, of 4 elsewhere, and twice the window's
/// width, so that both ragged ends fit.
pub(crate) fn bounds_side(shape: ClipmapShape, ground: Ground) -> u32 {
    2 * (shape.n() + 1) / if ground == Ground::Plane { 16 } else { 4 }
}

/// A buffer's name, which is also its name in the shaders, and its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct BufferSize {
    /// Name of the binding.
    pub name: &'static str,
    /// Bytes allocated.
    pub bytes: u64,
}

/// All buffers of a scene in the order of their binding numbers; what is not listed is not allocated.
#[must_use]
pub fn buffer_sizes(shape: ClipmapShape, extent: Extent, capacity: Capacity) -> Vec<BufferSize> {
    let lanes = u64::from(shape.levels()) * u64::from(extent.charts);
    let side = u64::from(shape.n()) + 1;
    let slots = u64::from(slots_per_level(shape)) * lanes;
    let vertices = u64::from(capacity.vertices);
    let bounds_bytes = if extent.ground == Ground::Plane { 8 } else { 32 };
    let bounds_blocks = u64::from(bounds_side(shape, extent.ground)).pow(2);
    let mut sizes = vec![
        ("frame", size_of::<GpuFrame>() as u64),
        ("control_points", lanes * CONTROL_POINTS as u64 * 4),
        ("control_quads", (QUADS_PER_LEVEL * size_of::<GpuControlQuad>()) as u64),
        ("samples", lanes * side * side * extent.sample_bytes()),
    ];
    if extent.bounds {
        sizes.push(("block_bounds", lanes * bounds_blocks * bounds_bytes));
    }
    sizes.extend([
        ("patches", slots * size_of::<PatchRecord>() as u64),
        ("visible_slots", slots * 4),
        ("counters", size_of::<Counters>() as u64),
        ("vertices", vertices * 16),
        ("indices", u64::from(capacity.indices) * 4),
        ("quad_corners", lanes * QUADS_PER_LEVEL as u64 * 4),
        ("staging", lanes * (side * side * extent.staged_bytes() + 40)),
    ]);
    if extent.ground != Ground::Plane {
        sizes.extend([
            ("curve", size_of::<GpuCurve>() as u64),
            ("charts", u64::from(extent.charts) * size_of::<GpuChart>() as u64),
            ("anchors", lanes * u64::from(extent.anchor_side(shape)).pow(2) * ANCHOR_WORDS as u64 * 16),
            ("shades", vertices * 4),
        ]);
    }
    if extent.ground == Ground::Curved {
        let records = u64::from(extent.record_side(shape)).pow(2);
        sizes.push(("records", lanes * records * RECORD_WORDS as u64 * 16));
    }
    let blocks = lanes * u64::from((shape.n() + 1) / PATCH_CELLS).pow(2);
    if extent.deviations {
        let figures = blocks * DEVIATION_WORDS as u64 * 4;
        sizes.extend([("choice", size_of::<GpuChoice>() as u64), ("deviations", figures)]);
    }
    if extent.by_error {
        sizes.extend([("wishes", blocks * 4), ("weights", 1_024 * 4)]);
    }
    if extent.refill {
        sizes.push(("held_before", (MAX_LANES * size_of::<[i32; 4]>()) as u64));
    }
    if extent.by_error {
        sizes.extend([
            ("grades", blocks * GRADE_WORDS * 4),
            ("fresh", blocks * 16),
            ("leaves", slots * (size_of::<PatchNodes>() as u64 + LEAF_WORDS * 4)),
        ]);
    }
    if extent.boxes {
        sizes.push(("box_arguments", 16));
    }
    sizes.into_iter().map(|(name, bytes)| BufferSize { name, bytes: bytes.max(16) }).collect()
}
