//! Control points and control quads of one level, in window coordinates (samples from its origin).

use crate::clipmap::{ClipmapShape, LPosition};

/// Control points of one level: 32 for the M and R blocks, 12 for the L in any of its four places.
pub const CONTROL_POINTS: usize = 44;

/// What Song et al. 2016 count per level in Table 1 (301 = 7 x 43), although their Fig. 1 numbers
/// the points n0 to n43, which are 44. Reports give both.
pub const FOOTPRINT_POINTS: usize = 43;

/// Control quads of one level: 12 M, 4 R, 3 of the L, 1 that fills the finest level's hole.
pub const QUADS_PER_LEVEL: usize = 20;

/// Index of the first of the three L quads; the only ones a shift rewrites.
pub const L_FIRST: usize = 16;

/// Number of quads of the L block: horizontal arm, vertical arm, corner.
pub const L_QUADS: usize = 3;

/// Which block of the layout a quad belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum BlockKind {
    /// m x m cells.
    M = 0,
    /// m x 2 cells between M blocks.
    R = 1,
    /// One of the three parts of the L-shaped strip beside the finer window.
    L = 2,
    /// The hole of the finest active level, (2m + 2)^2 cells.
    Fill = 3,
}

/// A rectangle of the coarse layout: four control points and its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControlQuad {
    /// Indices into the level's control points: south-west, south-east, north-west, north-east.
    pub corners: [u8; 4],
    /// Block it belongs to.
    pub kind: BlockKind,
}

/// The lines of the layout, in cells from the window's origin (Song et al. 2016, Fig. 1).
fn lines(shape: ClipmapShape) -> [u32; 6] {
    let m = shape.m();
    let u = shape.unit();
    [0, m, 2 * m, 2 * m + 2 * u, 3 * m + 2 * u, 4 * m + 2 * u]
}

/// The lines an L block needs: the hole's border and one cell inside it.
fn l_lines(shape: ClipmapShape) -> [u32; 4] {
    let m = shape.m();
    let u = shape.unit();
    [m, m + u, 3 * m + u, 3 * m + 2 * u]
}

fn is_outer_point(x: usize, y: usize) -> bool {
    !((x == 2 || x == 3) && (y == 2 || y == 3))
}

fn is_l_point(x: usize, y: usize) -> bool {
    !((x == 0 || x == 3) && (y == 0 || y == 3))
}

/// All control points of a level, `[x, y]` in samples from the window's origin.
///
/// The same for every level and every camera: a move only changes which points the L uses.
#[must_use]
pub fn control_points(shape: ClipmapShape) -> Vec<[u32; 2]> {
    let outer = lines(shape);
    let inner = l_lines(shape);
    let mut points = Vec::with_capacity(CONTROL_POINTS);
    for y in 0..6 {
        for x in 0..6 {
            if is_outer_point(x, y) {
                points.push([outer[x], outer[y]]);
            }
        }
    }
    for y in 0..4 {
        for x in 0..4 {
            if is_l_point(x, y) {
                points.push([inner[x], inner[y]]);
            }
        }
    }
    points
}

/// The quads of one level, with the L in the given place.
#[must_use]
pub fn control_quads(shape: ClipmapShape, l: LPosition) -> Vec<ControlQuad> {
    let points = control_points(shape);
    let line = lines(shape);
    let mut quads = Vec::with_capacity(QUADS_PER_LEVEL);
    for kind in [BlockKind::M, BlockKind::R] {
        for y in 0..5 {
            for x in 0..5 {
                let in_hole = (1..4).contains(&x) && (1..4).contains(&y);
                let narrow = x == 2 || y == 2;
                if !in_hole && narrow == (kind == BlockKind::R) {
                    let (lo, hi) = ([line[x], line[y]], [line[x + 1], line[y + 1]]);
                    quads.push(quad(&points, kind, lo, hi));
                }
            }
        }
    }
    quads.extend(l_quads(shape, l));
    quads.push(quad(&points, BlockKind::Fill, [line[1]; 2], [line[4]; 2]));
    quads
}

/// The three quads of the L block: horizontal arm, vertical arm, corner.
///
/// This is all that a shift rewrites: 3 x 16 bytes, within the 8 control points of the paper.
#[must_use]
pub fn l_quads(shape: ClipmapShape, l: LPosition) -> [ControlQuad; L_QUADS] {
    let points = control_points(shape);
    let line = l_lines(shape);
    // Per axis: the strip's interval, and the finer window's.
    let axis = |high: bool| {
        if high { ([line[2], line[3]], [line[0], line[2]]) } else { ([line[0], line[1]], [line[1], line[3]]) }
    };
    let (strip_x, fine_x) = axis(l.high_x);
    let (strip_y, fine_y) = axis(l.high_y);
    let make = |x: [u32; 2], y: [u32; 2]| quad(&points, BlockKind::L, [x[0], y[0]], [x[1], y[1]]);
    [make(fine_x, strip_y), make(strip_x, fine_y), make(strip_x, strip_y)]
}

fn quad(points: &[[u32; 2]], kind: BlockKind, lo: [u32; 2], hi: [u32; 2]) -> ControlQuad {
    let find = |p: [u32; 2]| {
        let ix = points.iter().position(|q| *q == p).unwrap_or_default();
        u8::try_from(ix).unwrap_or_default()
    };
    ControlQuad { corners: [find(lo), find([hi[0], lo[1]]), find([lo[0], hi[1]]), find(hi)], kind }
}
