//! Rust's side of the structures of shaders/curved; tests/shaders.rs compares both member by member.

use bytemuck::{Pod, Zeroable};

use crate::clipmap::{ChartWindows, MAX_LEVELS};

const LEVELS: usize = MAX_LEVELS as usize;

/// One level of the curve uniform (`CurveLevel` in WGSL); members are documented there.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "documented beside the WGSL members of the same names")]
pub struct GpuCurveLevel {
    pub hi: [i32; 3],
    pub unit_m: f32,
    pub lo: [i32; 3],
    pub slack_m: f32,
    pub rest_m: [f32; 3],
    pub terms: u32,
}

/// Curve uniform (`Curve` in WGSL).
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "documented beside the WGSL members of the same names")]
pub struct GpuCurve {
    pub levels: [GpuCurveLevel; LEVELS],
    pub shifted: [[u32; 4]; 3],
    pub horizon_scale: [f32; 3],
    pub horizon: f32,
    pub horizon_eye: [f32; 3],
    pub chart_count: u32,
    pub block_shift: u32,
    pub record_side: u32,
    pub anchor_side: u32,
    pub spare: u32,
}

/// One chart (`Chart` in WGSL).
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "documented beside the WGSL members of the same names")]
pub struct GpuChart {
    pub last: [i32; 2],
    pub finest: u32,
    pub flags: u32,
    pub neighbours: [u32; 4],
    pub anchor: [i32; 2],
    pub eye: [f32; 2],
    pub origins: [[i32; 2]; LEVELS],
}

/// All charts as the GPU reads them.
#[must_use]
pub(crate) fn packed_charts(windows: &ChartWindows) -> Vec<GpuChart> {
    let half = i32::try_from(windows.shape().n() / 2).unwrap_or_default();
    let one = |(number, own): (usize, &crate::clipmap::Windows)| {
        let chart = &windows.graph.charts[number];
        let mut origins = [[0; 2]; LEVELS];
        for (slot, origin) in origins.iter_mut().zip(&own.origins) {
            *slot = *origin;
        }
        let anchor = [0, 1].map(|a| own.origins[0][a] + half);
        GpuChart {
            last: own.lattice.last,
            finest: own.finest,
            flags: u32::from(chart.mirrored),
            neighbours: chart
                .neighbours
                .map(|n| n.map_or(0, |n| n.chart as u32 | (n.side as u32) << 8 | 1 << 16)),
            anchor,
            eye: [0, 1].map(|a| (windows.centres[number][a] - f64::from(anchor[a])) as f32),
            origins,
        }
    };
    windows.charts.iter().enumerate().map(one).collect()
}
