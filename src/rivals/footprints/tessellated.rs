//! Ours: control points and quads (Song et al. 2016, Table 1, "Ours").

use super::Footprint;
use crate::clipmap::{ClipmapShape, Lattice, Windows, refill_strips};
use crate::gpu::layouts::{packed_corners, packed_l_corners, packed_points, packed_quads};
use crate::quads::FOOTPRINT_POINTS;

pub(super) fn footprint(shape: ClipmapShape) -> Footprint {
    let lattice = Lattice { last: [1 << 22; 2] };
    let place = |offset: f64| Windows::place(shape, lattice, [f64::from(1 << 21) + offset; 2], 0);
    let (before, after) = (place(0.0), place(2.0));
    let points = packed_points(&before, shape.levels() as usize);
    let quads = packed_quads(&before);
    let corners: Vec<u32> = (0..shape.levels()).flat_map(|l| packed_corners(&before, l)).collect();
    // A shift rewrites the corners of the L blocks that moved, and describes each strip in 16 bytes.
    let moved: Vec<u32> = (1..shape.levels())
        .filter(|&l| before.l_position_of_data(l) != after.l_position_of_data(l))
        .flat_map(|l| packed_l_corners(&after, l))
        .collect();
    let strips = refill_strips(Some(&before), &after).strips.len() as u64;
    let built = points.len() as u64;
    Footprint {
        n: shape.n(),
        levels: shape.levels(),
        method: "tessellated",
        control_points: Some(FOOTPRINT_POINTS as u64 * u64::from(shape.levels())),
        control_points_built: Some(built),
        vertices: FOOTPRINT_POINTS as u64 * u64::from(shape.levels()),
        bytes_start: (size_of_val(&points[..]) + size_of_val(&quads[..]) + size_of_val(&corners[..])) as u64,
        bytes_per_frame: size_of_val(&moved[..]) as u64 + strips * 16,
        bytes_every_frame: 0,
        bytes_a_sample: 0,
    }
}
