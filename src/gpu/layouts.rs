//! Rust's side of shaders/shared/structs.wgsl; tests/shaders.rs compares both member by member.

use bytemuck::{Pod, Zeroable};

use crate::clipmap::{LPosition, MAX_LEVELS, Rect, Windows};
use crate::quads::{
    BLOCK_NODES, BlockKind, ByError, ControlQuad, L_QUADS, OuterSpan, Patch, control_points, control_quads,
    l_quads, patch_slots,
};

/// Frame uniform (`Frame` in WGSL); members are documented there.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "documented beside the WGSL members of the same names")]
pub struct GpuFrame {
    pub clip_from_near: [[f32; 4]; 4],
    pub planes: [[f32; 4]; 5],
    pub eye_from_anchor_m: [f32; 3],
    pub fog_per_m: f32,
    pub sun_direction: [f32; 3],
    pub ambient: f32,
    pub fog_color: [f32; 3],
    pub anchor_height_m: f32,
    pub height_range_m: [f32; 2],
    pub sample_step_m: f32,
    pub sea_level: f32,
    pub spacing_m: [f32; 2],
    pub eye_samples: [f32; 2],
    pub anchor: [i32; 2],
    pub last: [i32; 2],
    pub level_count: u32,
    pub finest: u32,
    pub n: u32,
    pub slots_per_level: u32,
    pub window_cells: u32,
    pub vertex_capacity: u32,
    pub index_capacity: u32,
    pub shifted_levels: u32,
    pub origins: [[i32; 4]; MAX_LEVELS as usize],
}

/// What never changes of a control quad (`ControlQuad` in WGSL).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "documented beside the WGSL members of the same names")]
pub struct GpuControlQuad {
    pub kind: u32,
    pub first_patch: u32,
    pub patches_east: u32,
}

/// One patch as the culling pass leaves it (`PatchRecord` in WGSL).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "documented beside the WGSL members of the same names")]
pub struct PatchRecord {
    pub cell: [i32; 2],
    pub shape: u32,
    pub outer_sn: u32,
    pub outer_we: u32,
    pub first_vertex: u32,
    pub first_index: u32,
    pub visible: u32,
}

/// Indirect arguments and what the frame needed (`Counters` in WGSL).
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "documented beside the WGSL members of the same names")]
pub struct Counters {
    pub index_count: u32,
    pub instance_count: u32,
    pub first_index: u32,
    pub base_vertex: i32,
    pub first_instance: u32,
    pub wire_vertex_count: u32,
    pub wire_instance_count: u32,
    pub wire_first_vertex: u32,
    pub wire_first_instance: u32,
    pub expand_x: u32,
    pub expand_y: u32,
    pub expand_z: u32,
    pub vertices_needed: u32,
    pub indices_needed: u32,
    pub patches_visible: u32,
    pub patches_dropped: u32,
    pub threshold_px: f32,
}

/// One patch whose factors go by error, as the passes leave it: the first 32 words that a slot has of the
/// buffer `leaves`. Of those that are not visible only `visible` is written, as 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct PatchNodes {
    /// Low corner in the level's lattice.
    pub cell: [i32; 2],
    /// As in [`PatchRecord`].
    pub shape: u32,
    /// As in [`PatchRecord`], with its mark.
    pub visible: u32,
    /// Where its vertices begin.
    pub first_vertex: u32,
    /// Where its indices begin.
    pub first_index: u32,
    /// Count of its vertices.
    pub vertices: u32,
    /// Count of its triangles.
    pub triangles: u32,
    /// Own nodes: bit x of row y.
    pub rows: [u32; BLOCK_NODES],
    /// Extras of the south, north, west and east side: bit j, in half cells.
    pub extras: [u32; 4],
    /// Nothing yet.
    pub spare: [u32; 3],
}

impl PatchNodes {
    /// The patch they describe.
    #[must_use]
    pub fn patch(&self) -> Patch {
        let by_error = ByError { rows: self.rows, extras: self.extras };
        Patch { by_error: Some(by_error), ..plain_patch(self.cell, self.shape) }
    }
}

/// A patch without its factors, by its low corner and shape.
fn plain_patch(cell: [i32; 2], shape: u32) -> Patch {
    let [w, h] = [shape & 0xff, (shape >> 8) & 0xff];
    let kind = match (shape >> 24) & 15 {
        0 => BlockKind::M,
        1 => BlockKind::R,
        2 => BlockKind::L,
        _ => BlockKind::Fill,
    };
    let hi = [cell[0] + w as i32, cell[1] + h as i32];
    Patch {
        chart: shape >> 28,
        level: (shape >> 16) & 0xff,
        kind,
        rect: Rect { lo: cell, hi },
        outer: Default::default(),
        by_error: None,
    }
}

impl PatchRecord {
    /// The record of a patch, as the culling pass writes it for a visible one. Factors by error are not part
    /// of it.
    #[must_use]
    pub fn of(patch: &Patch) -> Self {
        let [w, h] = patch.cells();
        let span = |s: OuterSpan| s.from | s.to << 5 | s.log2 << 10;
        let outer = if patch.by_error.is_some() { Default::default() } else { patch.outer };
        let [south, north, west, east] = outer.map(span);
        Self {
            cell: patch.rect.lo,
            shape: w | h << 8 | patch.level << 16 | (patch.kind as u32) << 24 | patch.chart << 28,
            outer_sn: south | north << 16,
            outer_we: west | east << 16,
            first_vertex: 0,
            first_index: 0,
            visible: 1,
        }
    }

    /// The patch a record describes, with uniform factors.
    #[must_use]
    pub fn patch(&self) -> Patch {
        let span = |bits: u32| {
            let s = OuterSpan { from: bits & 31, to: (bits >> 5) & 31, log2: (bits >> 10) & 15 };
            if s.to == s.from { OuterSpan::default() } else { s }
        };
        let spans = [self.outer_sn, self.outer_sn >> 16, self.outer_we, self.outer_we >> 16];
        Patch { outer: spans.map(span), ..plain_patch(self.cell, self.shape) }
    }
}

/// Limits of a frame's choice of factors (`Choice` in WGSL); members are documented there.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "documented beside the WGSL members of the same names")]
pub struct GpuChoice {
    pub half_px: [f32; 2],
    pub reference_px: f32,
    pub reference_bin: f32,
    pub budget: u32,
    pub bend_m: f32,
    pub spare: [u32; 2],
}

/// Control points of all lanes as the GPU reads them: `x | y << 16`, 4 bytes a point.
pub(crate) fn packed_points(windows: &Windows, lanes: usize) -> Vec<u32> {
    let one: Vec<u32> = control_points(windows.shape).iter().map(|p| p[0] | p[1] << 16).collect();
    one.repeat(lanes)
}

/// The unchanging part of a level's quads; the same for all levels.
pub(crate) fn packed_quads(windows: &Windows) -> Vec<GpuControlQuad> {
    let quads = control_quads(windows.shape, LPosition { high_x: false, high_y: false });
    quads
        .iter()
        .zip(patch_slots(windows.shape, &quads))
        .map(|(q, (first_patch, across))| GpuControlQuad {
            kind: q.kind as u32,
            first_patch,
            patches_east: across[0],
        })
        .collect()
}

fn pack_corners(q: &ControlQuad) -> u32 {
    u32::from_le_bytes(q.corners)
}

/// Corners of all quads of one level, 4 bytes a quad.
pub(crate) fn packed_corners(windows: &Windows, level: u32) -> Vec<u32> {
    let l = windows.l_position_of_data(level);
    control_quads(windows.shape, l).iter().map(pack_corners).collect()
}

/// Corners of the L's quads alone: all a shift rewrites.
pub(crate) fn packed_l_corners(windows: &Windows, level: u32) -> [u32; L_QUADS] {
    l_quads(windows.shape, windows.l_position_of_data(level)).map(|q| pack_corners(&q))
}
