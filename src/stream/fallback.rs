//! A level's samples from the next coarser one: its surface, on its own triangles.

use crate::clipmap::{Lattice, Rect};
use crate::pyramid::VOID;

/// Nodes of the coarser level that a rectangle of `level` is made from.
pub(crate) fn parents(lattice: Lattice, level: u32, rect: Rect) -> Rect {
    let last = lattice.last_at(level + 1);
    let fine = lattice.last_at(level);
    // The data's last node stands on the coarser level's last one, whatever its parity.
    let low = |a: usize| if rect.lo[a] >= fine[a] { last[a] } else { rect.lo[a].div_euclid(2) };
    Rect { lo: [low(0), low(1)], hi: [0, 1].map(|a| ((rect.hi[a] + 1).div_euclid(2)).min(last[a])) }
}

/// Samples of a rectangle of `level` on the surface of the coarser one, whose samples over
/// [`parents`] of the rectangle are `coarse`. Cells are cut from south-east to north-west: the middle of
/// one is the mean of those corners, as in the geomorph.
pub(crate) fn refine(lattice: Lattice, level: u32, rect: Rect, coarse: &[f32], out: &mut Vec<f32>) {
    let from = parents(lattice, level, rect);
    let width = from.hi[0].abs_diff(from.lo[0]) as usize + 1;
    let at =
        |x: i32, y: i32| coarse[y.abs_diff(from.lo[1]) as usize * width + x.abs_diff(from.lo[0]) as usize];
    let (last, end) = (lattice.last_at(level), lattice.last_at(level + 1));
    let below = |v: i32, a: usize| {
        if v == last[a] { (end[a], 0) } else { (v.div_euclid(2), v.rem_euclid(2)) }
    };
    for y in rect.lo[1]..=rect.hi[1] {
        let (cy, up) = below(y, 1);
        for x in rect.lo[0]..=rect.hi[0] {
            let (cx, right) = below(x, 0);
            let (a, b) = (at(cx + right, cy), at(cx, cy + up));
            out.push(if a == VOID || b == VOID { VOID } else { (a + b) * 0.5 });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_stays_a_plane_up_to_the_clamped_border() {
        let lattice = Lattice { last: [21, 13] };
        let height = |base: [i32; 2]| 3.0 * base[0] as f32 - 2.0 * base[1] as f32;
        for level in 0..3 {
            let end = lattice.last_at(level);
            for lo in [[0, 0], [1, 2], [end[0], end[1]], [end[0] - 1, 0]] {
                let rect = Rect { lo, hi: end };
                let from = parents(lattice, level, rect);
                let mut coarse = Vec::new();
                for y in from.lo[1]..=from.hi[1] {
                    coarse.extend((from.lo[0]..=from.hi[0]).map(|x| height(lattice.base(level + 1, [x, y]))));
                }
                let mut out = Vec::new();
                refine(lattice, level, rect, &coarse, &mut out);
                let mut k = 0;
                for y in rect.lo[1]..=rect.hi[1] {
                    for x in rect.lo[0]..=rect.hi[0] {
                        let base = lattice.base(level, [x, y]);
                        // In the narrow last cells the middle node does not stand in the middle.
                        let last = lattice.last_at(level + 1);
                        let in_last = (0..2).any(|a| [x, y][a] % 2 == 1 && [x, y][a] / 2 + 1 == last[a]);
                        if !in_last {
                            assert_eq!(out[k], height(base), "level {level} node {x} {y}");
                        }
                        k += 1;
                    }
                }
                assert_eq!(k, out.len());
            }
        }
    }
}
