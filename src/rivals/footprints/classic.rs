//! Classic geometry clipmaps: full vertex grids kept by the CPU.
//!
//! Losasso and Hoppe, *Geometry Clipmaps*, 2004, as Brettell 2005 built it: every level holds n x n
//! vertices (x, y, z and the coarser level's z), updated toroidally; index strips are rebuilt by the
//! CPU for each frame.

use super::Footprint;
use crate::clipmap::{ClipmapShape, height_bound};

/// x, y, z, z of the next coarser level.
type Vertex = [f32; 4];

pub(super) fn footprint(shape: ClipmapShape) -> Footprint {
    let n = shape.n();
    let mut vertices = 0_u64;
    let mut vertex_bytes = 0_u64;
    let mut index_bytes = 0_u64;
    for level in 0..shape.levels() {
        let grid = vertex_grid(n, level);
        let indices = ring_indices(shape, level);
        vertices += grid.len() as u64;
        vertex_bytes += size_of_val(&grid[..]) as u64;
        index_bytes += size_of_val(&indices[..]) as u64;
    }
    let refilled = height_bound(n, 2, 2) * size_of::<Vertex>() as u64;
    Footprint {
        n,
        levels: shape.levels(),
        method: "classic",
        control_points: None,
        control_points_built: None,
        vertices,
        bytes_start: vertex_bytes + index_bytes,
        bytes_per_frame: refilled + index_bytes,
        bytes_every_frame: index_bytes,
        bytes_a_sample: size_of::<Vertex>() as u64,
    }
}

fn vertex_grid(n: u32, level: u32) -> Vec<Vertex> {
    let step = (1_u32 << level) as f32;
    (0..n).flat_map(|y| (0..n).map(move |x| [x as f32 * step, y as f32 * step, 0.0, 0.0])).collect()
}

/// Triangle strips row by row, two degenerate indices between rows; rings leave out the hole.
fn ring_indices(shape: ClipmapShape, level: u32) -> Vec<u32> {
    let n = shape.n();
    let (hole_lo, hole_hi) = (shape.m(), 3 * shape.m() + 1);
    let mut indices = Vec::new();
    let mut strip = |y: u32, from: u32, to: u32| {
        indices.push((y + 1) * n + from);
        for x in from..=to {
            indices.extend([(y + 1) * n + x, y * n + x]);
        }
        indices.push(y * n + to);
    };
    for y in 0..n - 1 {
        if level > 0 && (hole_lo..hole_hi).contains(&y) {
            strip(y, 0, hole_lo);
            strip(y, hole_hi, n - 1);
        } else {
            strip(y, 0, n - 1);
        }
    }
    indices
}
