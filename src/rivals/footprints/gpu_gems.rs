//! GPU-based geometry clipmaps: a few static vertex buffers shared by all levels.
//!
//! Asirvatham and Hoppe, *Terrain Rendering Using GPU-Based Geometry Clipmaps*, GPU Gems 2, chapter 2,
//! 2005, as Fruehstueck 2008, section 2.3.1 describes it: m x m blocks with m = (n + 1) / 4 vertices a
//! side, ring fix-ups of m x 3, an L-shaped interior trim, and an outer ring of degenerate triangles.

use super::Footprint;
use crate::clipmap::ClipmapShape;

/// Grid coordinates within a block: the height comes from a texture.
type Vertex = [u16; 2];

/// Scale, origin and texture origin of a block, set for each draw: two float4.
const BLOCK_BYTES: u64 = 32;

struct Buffers {
    vertices: Vec<Vertex>,
    indices: Vec<u16>,
}

pub(super) fn footprint(shape: ClipmapShape) -> Footprint {
    let n = shape.n();
    let side = n.div_ceil(4);
    let parts = [
        grid(side, side),                                // the block
        grid(side, 3),                                   // fix-up, east and west
        grid(3, side),                                   // fix-up, south and north
        merge(grid(2 * side + 1, 2), grid(2, 2 * side)), // interior trim
        degenerate_ring(n),
    ];
    let vertices: u64 = parts.iter().map(|p| p.vertices.len() as u64).sum();
    let bytes: usize = parts.iter().map(|p| size_of_val(&p.vertices[..]) + size_of_val(&p.indices[..])).sum();
    // Draws of a level: 12 blocks, the fix-ups (one draw), the trim, the degenerate ring; the finest
    // level has 4 blocks, fix-ups and a trim more in its middle.
    let draws = 15 * u64::from(shape.levels()) + 6;
    Footprint {
        n,
        levels: shape.levels(),
        method: "gpu-gems-2",
        control_points: None,
        control_points_built: None,
        vertices,
        bytes_start: bytes as u64,
        bytes_per_frame: draws * BLOCK_BYTES,
        bytes_every_frame: draws * BLOCK_BYTES,
        bytes_a_sample: 0,
    }
}

fn grid(width: u32, height: u32) -> Buffers {
    let coordinate = |v: u32| u16::try_from(v).unwrap_or(u16::MAX);
    let vertices: Vec<Vertex> =
        (0..height).flat_map(|y| (0..width).map(move |x| [coordinate(x), coordinate(y)])).collect();
    let at = |x: u32, y: u32| coordinate(y * width + x);
    let mut indices = Vec::new();
    for y in 0..height - 1 {
        for x in 0..width - 1 {
            indices.extend([at(x, y), at(x + 1, y), at(x, y + 1)]);
            indices.extend([at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]);
        }
    }
    Buffers { vertices, indices }
}

fn merge(mut a: Buffers, b: Buffers) -> Buffers {
    let shift = u16::try_from(a.vertices.len()).unwrap_or(u16::MAX);
    a.vertices.extend(b.vertices);
    a.indices.extend(b.indices.into_iter().map(|i| i + shift));
    a
}

/// One vertex a sample of the perimeter; a degenerate triangle over every second one.
fn degenerate_ring(n: u32) -> Buffers {
    let last = u16::try_from(n - 1).unwrap_or(u16::MAX);
    let mut vertices: Vec<Vertex> = Vec::new();
    vertices.extend((0..last).map(|x| [x, 0]));
    vertices.extend((0..last).map(|y| [last, y]));
    vertices.extend((0..last).map(|x| [last - x, last]));
    vertices.extend((0..last).map(|y| [0, last - y]));
    let count = u16::try_from(vertices.len()).unwrap_or(u16::MAX);
    let indices = (0..count).step_by(2).flat_map(|i| [i, i + 1, (i + 2) % count]).collect();
    Buffers { vertices, indices }
}
