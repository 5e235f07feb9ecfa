//! Index sets of a patch for its own level and those of its four neighbours (Brodersen 2005, sections 4
//! and 5): where a neighbour is finer, its vertices are added to the shared border.
//!
//! A cell with divided edges keeps its two triangles and splits them: the south-western one over the points
//! of its south and west edges, the north-eastern one over those of its north and east edges. So the surface
//! changes by what the added vertices lift it, nowhere else.

/// Index sets of a patch with `levels` levels: every level with every level of its neighbours that is finer
/// or its own.
pub(super) fn set_count(levels: u32) -> usize {
    sets_below(levels) as usize
}

/// Number of a set: `extra[side]` is how many levels the neighbour is finer (south, north, west, east).
pub(super) fn set_number(level: u32, extra: [u32; 4]) -> usize {
    (sets_below(level) + extra.iter().fold(0_u32, |number, e| number * (level + 1) + e)) as usize
}

fn sets_below(level: u32) -> u32 {
    (0..level).map(|l| (l + 1).pow(4)).sum()
}

/// All of them, in the order of their numbers.
pub(super) fn all_sets(levels: u32) -> impl Iterator<Item = (u32, [u32; 4])> {
    (0..levels).flat_map(|level| {
        let radix = level + 1;
        (0..radix.pow(4)).map(move |n| (level, [3, 2, 1, 0].map(|place| n / radix.pow(place) % radix)))
    })
}

/// The triangles of a set, counter-clockwise from above; vertices are numbered row by row at full resolution.
pub(super) fn pattern(cells: u32, level: u32, extra: [u32; 4]) -> Vec<u16> {
    let step = 1 << level;
    let own = cells >> level;
    let mut numbers = Vec::new();
    for y in 0..own {
        for x in 0..own {
            let outer = [y == 0, y + 1 == own, x == 0, x + 1 == own];
            let segments = [0, 1, 2, 3].map(|side| if outer[side] { 1 << extra[side] } else { 1 });
            push_cell(&mut numbers, [x * step, y * step], step, segments, cells + 1);
        }
    }
    numbers
}

/// One cell whose edges (south, north, west, east) have `segments`.
fn push_cell(numbers: &mut Vec<u16>, lo: [u32; 2], step: u32, segments: [u32; 4], row: u32) {
    let number = |x: u32, y: u32| ((lo[1] + y) * row + lo[0] + x) as u16;
    let [s, n, w, e] = segments;
    let south = |k: u32| number(k * step / s, 0);
    let north = |k: u32| number(k * step / n, step);
    let west = |k: u32| number(0, k * step / w);
    let east = |k: u32| number(step, k * step / e);
    for k in 0..w {
        numbers.extend([west(k), south(1), west(k + 1)]);
    }
    for k in 1..s {
        numbers.extend([south(k), south(k + 1), west(w)]);
    }
    for k in 0..n - 1 {
        numbers.extend([east(0), north(k + 1), north(k)]);
    }
    for k in 0..e {
        numbers.extend([east(k), east(k + 1), north(n - 1)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rivals::geomipmap::check::{assert_tiles, assert_tiles_clamped};

    #[test]
    fn sets_of_17_x_17_are_the_papers_354_of_88_896_bytes() {
        assert_eq!(set_count(4), 354);
        let numbers: usize = all_sets(4).map(|(level, extra)| pattern(16, level, extra).len()).sum();
        assert_eq!(2 * numbers, 88_896);
    }

    #[test]
    fn sets_are_numbered_without_gaps() {
        for (k, (level, extra)) in all_sets(7).enumerate() {
            assert_eq!(set_number(level, extra), k);
        }
        assert_eq!(all_sets(7).count(), set_count(7));
    }

    #[test]
    fn every_set_tiles_the_patch_and_lists_its_neighbours_vertices() {
        for cells in [8_u32, 16] {
            for (level, extra) in all_sets(cells.ilog2()) {
                assert_tiles(&pattern(cells, level, extra), cells, extra.map(|e| 1 << (level - e)));
            }
        }
    }

    #[test]
    fn sets_tile_what_the_data_leaves_of_a_patch() {
        for last in [[1, 1], [1, 8], [8, 3], [5, 7], [7, 2], [8, 8]] {
            for (level, extra) in all_sets(3) {
                assert_tiles_clamped(&pattern(8, level, extra), 8, last);
            }
        }
    }

    #[test]
    fn undivided_cells_are_cut_from_south_east_to_north_west() {
        let numbers = pattern(8, 0, [0; 4]);
        assert_eq!(numbers[..6], [0, 1, 9, 1, 10, 9]);
        assert_eq!(numbers.len(), 6 * 64);
    }

    #[test]
    fn the_largest_patch_fits_16_bits() {
        let numbers = pattern(128, 6, [6, 5, 0, 3]);
        assert_eq!(numbers.iter().max(), Some(&16_640));
    }
}
