//! The static footprints: vertices are cells of a block, 4 bytes each; indices are shared by all levels.

use crate::clipmap::{ClipmapShape, Rect};
use crate::quads::BlockKind;

/// One footprint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Its size in cells; the ring's is that of the whole window.
    pub cells: [u32; 2],
    pub first_vertex: u32,
    pub vertices: u32,
    /// First index and count.
    pub indices: [u32; 2],
}

/// All footprints in two buffers.
#[derive(Debug, Default)]
pub(super) struct Pieces {
    pub all: Vec<Piece>,
    pub vertices: Vec<[u16; 2]>,
    pub indices: Vec<u16>,
    /// Which of them is the ring of triangles without area.
    pub ring: usize,
}

/// The footprints of a shape.
pub(super) fn pieces(shape: ClipmapShape) -> Pieces {
    let m = shape.m();
    let mut made = Pieces::default();
    // Blocks, fix-ups both ways, the interior trim's two arms and its corner, and the middle of the finest
    // level, which four blocks and four fix-ups fill but for 2 x 2 cells.
    for cells in [[m, m], [m, 2], [2, m], [2 * m + 1, 1], [1, 2 * m + 1], [1, 1], [2, 2]] {
        made.push_grid(cells);
    }
    made.ring = made.all.len();
    made.push_ring(shape.n());
    made
}

impl Pieces {
    fn push_grid(&mut self, cells: [u32; 2]) {
        let mut indices = Vec::new();
        super::super::brute_force::push_cells(&mut indices, cells, cells[0] + 1);
        let vertices: Vec<[u32; 2]> =
            (0..=cells[1]).flat_map(|y| (0..=cells[0]).map(move |x| [x, y])).collect();
        self.push(cells, &vertices, &indices);
    }

    /// One vertex a sample of the perimeter; a triangle without area over every second one.
    fn push_ring(&mut self, n: u32) {
        let last = n - 1;
        let mut vertices: Vec<[u32; 2]> = Vec::new();
        vertices.extend((0..last).map(|x| [x, 0]));
        vertices.extend((0..last).map(|y| [last, y]));
        vertices.extend((0..last).map(|x| [last - x, last]));
        vertices.extend((0..last).map(|y| [0, last - y]));
        let count = vertices.len() as u32;
        let indices: Vec<u32> = (0..count).step_by(2).flat_map(|i| [i, (i + 2) % count, i + 1]).collect();
        self.push([last, last], &vertices, &indices);
    }

    fn push(&mut self, cells: [u32; 2], vertices: &[[u32; 2]], indices: &[u32]) {
        // A block of the largest window has 256 x 256 vertices: the last one's number is 65,535.
        let short = |v: u32| u16::try_from(v).unwrap_or(u16::MAX);
        self.all.push(Piece {
            cells,
            first_vertex: self.vertices.len() as u32,
            vertices: vertices.len() as u32,
            indices: [self.indices.len() as u32, indices.len() as u32],
        });
        self.vertices.extend(vertices.iter().map(|v| v.map(short)));
        self.indices.extend(indices.iter().copied().map(short));
    }

    /// Pieces that cover a control quad, each with its place in the window; the middle only where `fills`, and
    /// the interior trim only elsewhere.
    pub fn cover(&self, kind: BlockKind, rect: Rect, fills: bool) -> Vec<(usize, Rect)> {
        match (kind, fills) {
            (BlockKind::L, true) | (BlockKind::Fill, false) => Vec::new(),
            (BlockKind::Fill, true) => self.cover_middle(rect),
            _ => self.piece_of(rect).into_iter().collect(),
        }
    }

    fn cover_middle(&self, rect: Rect) -> Vec<(usize, Rect)> {
        let side = rect.hi[0] - rect.lo[0];
        let m = (side - 2) / 2;
        let lines = [0, m, m + 2, side];
        let mut out = Vec::new();
        for y in 0..3 {
            for x in 0..3 {
                let lo = [rect.lo[0] + lines[x], rect.lo[1] + lines[y]];
                let hi = [rect.lo[0] + lines[x + 1], rect.lo[1] + lines[y + 1]];
                out.extend(self.piece_of(Rect { lo, hi }));
            }
        }
        out
    }

    fn piece_of(&self, rect: Rect) -> Option<(usize, Rect)> {
        let cells = [0, 1].map(|a| rect.hi[a].abs_diff(rect.lo[a]));
        let found = self.all[..self.ring].iter().position(|p| p.cells == cells)?;
        Some((found, rect))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clipmap::{LPosition, Lattice};
    use crate::quads::{control_points, control_quads};

    #[test]
    fn pieces_cover_every_cell_of_a_level_but_its_hole_once() {
        for n in [15, 31, 255] {
            let shape = ClipmapShape::new(n, 2, Lattice { last: [4096, 4096] }).unwrap();
            let made = pieces(shape);
            let points = control_points(shape);
            let l = LPosition { high_x: true, high_y: false };
            for (fills, area) in
                [(true, (n - 1) * (n - 1)), (false, (n - 1) * (n - 1) - (2 * shape.m() + 1).pow(2))]
            {
                let mut covered = 0;
                for quad in control_quads(shape, l) {
                    let at = |k: usize| points[quad.corners[k] as usize].map(u32::cast_signed);
                    for (piece, rect) in made.cover(quad.kind, Rect { lo: at(0), hi: at(3) }, fills) {
                        let cells = made.all[piece].cells;
                        assert_eq!(cells, [0, 1].map(|a| rect.hi[a].abs_diff(rect.lo[a])));
                        assert_eq!(made.all[piece].indices[1], 6 * cells[0] * cells[1]);
                        covered += cells[0] * cells[1];
                    }
                }
                assert_eq!(covered, area, "n = {n}, fills {fills}");
            }
        }
    }
}
