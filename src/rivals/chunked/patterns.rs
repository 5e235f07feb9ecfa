//! Index sets of a chunk for how much coarser its four neighbours are (Brandstetter 2007, section 3.5.2): the
//! vertices that a neighbour lacks are omitted from the shared edge. His omitted vertices leave triangles
//! without area; here the border is triangulated anew and has none.
//!
//! Cells within are cut as everywhere. The border is four strips, one cell wide, that meet in the corners'
//! diagonals; each is a row of triangles between its outer and its inner vertices.

/// Index sets of a chunk: every side may be up to log2(cells) levels coarser.
pub(super) fn set_count(cells: u32) -> usize {
    (cells.ilog2() as usize + 1).pow(4)
}

/// Number of a set: `coarser[side]` is how many levels the neighbour is coarser (south, north, west, east).
pub(super) fn set_number(cells: u32, coarser: [u32; 4]) -> usize {
    coarser.iter().fold(0_u32, |number, k| number * (cells.ilog2() + 1) + k) as usize
}

/// The triangles of a set, counter-clockwise from above; vertices are numbered row by row.
pub(super) fn pattern(cells: u32, coarser: [u32; 4]) -> Vec<u16> {
    let row = cells + 1;
    let number = |x: u32, y: u32| (y * row + x) as u16;
    let mut numbers = Vec::new();
    for y in 1..cells - 1 {
        for x in 1..cells - 1 {
            push_cell(&mut numbers, cells, x, y);
        }
    }
    // Between two undivided sides the corner is a cell like any other; in the north-west and south-east the
    // strips meet in its diagonal anyway.
    let plain_sw = coarser[0] == 0 && coarser[2] == 0;
    let plain_ne = coarser[1] == 0 && coarser[3] == 0;
    if plain_sw {
        push_cell(&mut numbers, cells, 0, 0);
    }
    if plain_ne {
        push_cell(&mut numbers, cells, cells - 1, cells - 1);
    }
    for (side, coarser) in coarser.into_iter().enumerate() {
        let outer = |k: u32| match side {
            0 => number(k, 0),
            1 => number(k, cells),
            2 => number(0, k),
            _ => number(cells, k),
        };
        let inner = |k: u32| match side {
            0 => number(k, 1),
            1 => number(k, cells - 1),
            2 => number(1, k),
            _ => number(cells - 1, k),
        };
        // South and east strips run counter-clockwise around the chunk, the others clockwise.
        let mut push = |a: u16, b: u16, apex: u16, reversed: bool| {
            numbers.extend(if reversed { [b, a, apex] } else { [a, b, apex] });
        };
        let clockwise = side == 1 || side == 2;
        let low = side == 0 || side == 2;
        let width = 1 << coarser;
        for from in (0..cells).step_by(1 << coarser) {
            let in_plain_corner = if low { plain_sw && from == 0 } else { plain_ne && from == cells - 1 };
            if !in_plain_corner {
                push(outer(from), outer(from + width), inner(apex_of(from, width, cells, low)), clockwise);
            }
        }
        for from in 1..cells - 1 {
            push(inner(from), inner(from + 1), outer(outer_apex_of(from, width, low)), !clockwise);
        }
    }
    numbers
}

/// Inner vertex of the triangle over an outer segment: above its middle; where it is one cell wide the end
/// that makes the cell's diagonal run from south-east to north-west.
fn apex_of(from: u32, width: u32, cells: u32, low: bool) -> u32 {
    let apex = match (width, low) {
        (1, true) => from,
        (1, false) => from + 1,
        _ => from + width / 2,
    };
    apex.clamp(1, cells - 1)
}

/// Outer vertex of the triangle over the inner segment that begins at `from`; agrees with [`apex_of`].
fn outer_apex_of(from: u32, width: u32, low: bool) -> u32 {
    match (width, low) {
        (1, true) => from + 1,
        (1, false) => from,
        _ => (from + width / 2) / width * width,
    }
}

fn push_cell(numbers: &mut Vec<u16>, cells: u32, x: u32, y: u32) {
    let row = cells + 1;
    let sw = y * row + x;
    numbers.extend([sw, sw + 1, sw + row, sw + 1, sw + row + 1, sw + row].map(|v| v as u16));
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::rivals::geomipmap::check::{assert_tiles, assert_tiles_clamped};

    fn all_sets(cells: u32) -> impl Iterator<Item = [u32; 4]> {
        let radix = cells.ilog2() + 1;
        (0..radix.pow(4)).map(move |n| [3, 2, 1, 0].map(|place| n / radix.pow(place) % radix))
    }

    #[test]
    fn every_set_tiles_the_chunk_and_lists_what_its_neighbours_have() {
        for cells in [8_u32, 16] {
            for (k, coarser) in all_sets(cells).enumerate() {
                assert_eq!(set_number(cells, coarser), k);
                assert_tiles(&pattern(cells, coarser), cells, coarser.map(|k| 1 << k));
            }
            assert_eq!(all_sets(cells).count(), set_count(cells));
        }
    }

    #[test]
    fn sets_tile_what_the_data_leaves_of_a_chunk() {
        for last in [[1, 1], [1, 8], [8, 3], [5, 7], [7, 2], [8, 8]] {
            for coarser in all_sets(8) {
                assert_tiles_clamped(&pattern(8, coarser), 8, last);
            }
        }
    }

    #[test]
    fn among_equals_all_cells_are_cut_from_south_east_to_north_west() {
        let sorted = |numbers: &[u16]| -> BTreeSet<[u16; 3]> {
            numbers
                .chunks_exact(3)
                .map(|t| {
                    let mut t = [t[0], t[1], t[2]];
                    t.sort_unstable();
                    t
                })
                .collect()
        };
        let mut plain = Vec::new();
        for y in 0..8 {
            for x in 0..8 {
                push_cell(&mut plain, 8, x, y);
            }
        }
        assert_eq!(sorted(&pattern(8, [0; 4])), sorted(&plain));
    }

    #[test]
    fn the_largest_chunk_fits_16_bits() {
        assert_eq!(pattern(128, [7, 0, 3, 7]).iter().max(), Some(&16_640));
    }
}
