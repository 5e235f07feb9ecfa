//! Blocks: what the GPU gets of an analytic base surface, so that heights alone need to be uploaded.
//!
//! A block spans a few cells of one level. Its record holds an anchor in integers, the linear part of
//! the surface around it in integers, and what is left, which is small, as a polynomial in f32: of degree
//! four, on coarse levels with all products of fourth powers; and the surface's normal as one of degree three, its coarse part apart. shaders/curved/store_heights.wgsl adds them
//! up. Fruehstueck 2008, section 6.2, names absolute f32 positions as the limit of her system: they
//! step by half a metre at the radius of the Earth.

use super::Charted;

/// Low bits of an anchor: its high part counts `2^24` units, so that both parts are exact in f32.
pub const LOW_BITS: u32 = 24;

/// 16-byte words of a record.
pub const RECORD_WORDS: usize = 33;

/// 16-byte words of a record without the products beyond the fourth degree, which lie at its end.
pub const SHORT_WORDS: usize = 21;

/// Terms of the surface in a whole record, and in a short one.
pub const SURFACE_TERMS: [u32; 2] = [25, 15];

/// Bits of the coarse part of a block's normal.
pub const UP_BITS: u32 = 11;

/// 16-byte words of an anchor.
pub const ANCHOR_WORDS: usize = 2;

/// Units of the levels' integers, metres; powers of two.
#[derive(Clone, Debug, PartialEq)]
pub struct Units {
    /// By level, finest first.
    pub level_m: Vec<f64>,
}

impl Units {
    /// The finest units in which everything fits: offsets across a block and heights in 31 bits together,
    /// and anchors within `reach_m` of the world's origin in 55.
    #[must_use]
    pub fn new(levels: u32, cell_m: f64, block_cells: u32, height_m: f64, reach_m: f64) -> Self {
        // From a corner of a block along both its sides, and one cell more at the data's end.
        let across = 2.0 * f64::from(block_cells + 1) * cell_m;
        let level_m = (0..levels)
            .map(|level| {
                // One after the other in the worst case; a twentieth is kept for what polynomials overshoot.
                let offsets = (across * f64::from(1_u32 << level) + height_m) * 1.05 / f64::from(1_u32 << 31);
                // The camera may be far outside as well.
                let anchors = reach_m / (2.0_f64).powi(50);
                let least = offsets.max(anchors).max(1e-30);
                2.0_f64.powi(exponent_above(least))
            })
            .collect();
        Self { level_m }
    }
}

/// Least e with 2^e >= v.
fn exponent_above(v: f64) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "an exponent of an f64 fits i32")]
    let e = v.log2().ceil() as i32;
    e
}

/// High and low part of a coordinate in a level's units, rounded to the nearest unit; saturates where
/// the high part leaves 31 bits.
#[must_use]
pub fn anchor_words(v_m: f64, unit_m: f64) -> (i32, i32) {
    let scale = f64::from(1 << LOW_BITS);
    let whole = (v_m / unit_m).round();
    let high = (whole / scale).floor().clamp(-1_073_741_824.0, 1_073_741_823.0);
    let low = (whole - high * scale).clamp(0.0, scale - 1.0);
    #[expect(clippy::cast_possible_truncation, reason = "both are clamped to their bits")]
    let words = (high as i32, low as i32);
    words
}

/// The coordinate that [`anchor_words`] stand for, metres; exact.
#[must_use]
pub fn words_m((high, low): (i32, i32), unit_m: f64) -> f64 {
    (f64::from(high) * f64::from(1 << LOW_BITS) + f64::from(low)) * unit_m
}

/// A block's record as the GPU reads it.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct BlockRecord {
    /// The linear part per cell along u and along v, in units; in the fourth places the normal's first two
    /// components in the middle, in steps of 2^-[`UP_BITS`].
    pub linear: [[i32; 4]; 2],
    /// The third.
    pub up_z: i32,
    /// What is left of the surface: coefficients in metres of 1 u v uu uv vv ... vvvv, with u and v from
    /// -1 to 1 across the block.
    pub surface: [[f32; 3]; 15],
    /// What is left of the normal: coefficients of 1 u v uu uv vv uuu uuv uvv vvv.
    pub normal: [[f32; 3]; 10],
    /// The products of u and v up to their fourth powers beyond the fourth degree together.
    pub beyond: [[f32; 3]; 10],
    /// The normal's terms of the fourth degree.
    pub normal_beyond: [[f32; 3]; 5],
    /// To a whole number of 16-byte words.
    pub padding: [f32; 3],
}

/// First base coordinate of block `block` of `cells` cells at `level`. The data's last node begins a
/// block of its own, because it may stand nearer than a whole cell.
#[must_use]
pub fn block_start(last: i32, level: u32, cells: i32, block: i32) -> i32 {
    let nodes = i64::from(block) * i64::from(cells);
    let end = (i64::from(last) + (1 << level) - 1) >> level;
    if nodes >= end { last } else { i32::try_from(nodes << level).unwrap_or(last) }
}

/// Monomials in the order of a record: exponents of u and v by total degree.
const TERMS: [[usize; 2]; 25] = [
    [0, 0],
    [1, 0],
    [0, 1],
    [2, 0],
    [1, 1],
    [0, 2],
    [3, 0],
    [2, 1],
    [1, 2],
    [0, 3],
    [4, 0],
    [3, 1],
    [2, 2],
    [1, 3],
    [0, 4],
    [4, 1],
    [3, 2],
    [2, 3],
    [1, 4],
    [4, 2],
    [3, 3],
    [2, 4],
    [4, 3],
    [3, 4],
    [4, 4],
];

/// Monomial coefficients, degree by degree, of the quartic through values at -1, -1/2, 0,
/// 1/2 and 1.
const QUARTIC: [[f64; 5]; 5] = [
    [0.0, 0.0, 1.0, 0.0, 0.0],
    [1.0 / 6.0, -4.0 / 3.0, 0.0, 4.0 / 3.0, -1.0 / 6.0],
    [-1.0 / 6.0, 8.0 / 3.0, -5.0, 8.0 / 3.0, -1.0 / 6.0],
    [-2.0 / 3.0, 4.0 / 3.0, 0.0, -4.0 / 3.0, 2.0 / 3.0],
    [2.0 / 3.0, -8.0 / 3.0, 4.0, -8.0 / 3.0, 2.0 / 3.0],
];

/// Anchor and record of block `block` of `cells` x `cells` cells of `level` of a chart whose last base node is
/// `last`.
#[must_use]
pub fn block_record(
    surface: &dyn Charted,
    chart: usize,
    last: [i32; 2],
    level: u32,
    block: [i32; 2],
    cells: i32,
    unit_m: f64,
) -> ([[i32; 4]; ANCHOR_WORDS], BlockRecord) {
    let start = [0, 1].map(|a| f64::from(block_start(last[a], level, cells, block[a])));
    let span = f64::from(cells) * f64::from(1_u32 << level);
    let mut values = [[[0.0; 6]; 5]; 5];
    for (j, row) in values.iter_mut().enumerate() {
        for (i, value) in row.iter_mut().enumerate() {
            let at = [start[0] + span * i as f64 / 4.0, start[1] + span * j as f64 / 4.0];
            let (p, n) = surface.base(chart, at);
            *value = [p.x, p.y, p.z, n.x, n.y, n.z];
        }
    }
    let mut record = <BlockRecord as bytemuck::Zeroable>::zeroed();
    let mut anchors = [[0; 4]; ANCHOR_WORDS];
    let half = f64::from(cells) / 2.0;
    for axis in 0..3 {
        let anchor = anchor_words(values[2][2][axis], unit_m);
        let anchor_m = words_m(anchor, unit_m);
        anchors[0][axis] = anchor.0;
        anchors[1][axis] = anchor.1;
        // Relative to the anchor before anything else, so that no digits are lost to the radius.
        let relative = values.map(|row| row.map(|v| v[axis] - anchor_m));
        for (k, term) in TERMS.iter().enumerate() {
            let mut c = coefficient(&relative, *term);
            if k == 1 || k == 2 {
                let per_cell = (c / half / unit_m).round();
                #[expect(clippy::cast_possible_truncation, reason = "units are chosen so that it fits")]
                let whole = per_cell as i32;
                record.linear[k - 1][axis] = whole;
                c -= f64::from(whole) * half * unit_m;
            }
            if k < 15 { record.surface[k][axis] = c as f32 } else { record.beyond[k - 15][axis] = c as f32 }
        }
        let normals = values.map(|row| row.map(|v| v[3 + axis]));
        for (k, term) in TERMS.iter().take(15).enumerate() {
            let mut c = coefficient(&normals, *term);
            if k == 0 {
                // Few bits, so that its product with a part of a height is exact in f32.
                let steps = f64::from(1 << UP_BITS);
                let whole = (c * steps).round();
                #[expect(clippy::cast_possible_truncation, reason = "a unit vector's")]
                let word = whole as i32;
                match axis {
                    2 => record.up_z = word,
                    _ => record.linear[axis][3] = word,
                }
                c -= whole / steps;
            }
            match k {
                0..10 => record.normal[k][axis] = c as f32,
                _ => record.normal_beyond[k - 10][axis] = c as f32,
            }
        }
    }
    (anchors, record)
}

/// An anchor alone, for samples that are positions.
#[must_use]
pub fn anchor_at(anchor_m: [f64; 3], unit_m: f64) -> [[i32; 4]; ANCHOR_WORDS] {
    let words = anchor_m.map(|v| anchor_words(v, unit_m));
    [[words[0].0, words[1].0, words[2].0, 0], [words[0].1, words[1].1, words[2].1, 0]]
}

fn coefficient(values: &[[f64; 5]; 5], [i, j]: [usize; 2]) -> f64 {
    let rows = values.map(|row| row.iter().zip(QUARTIC[i]).map(|(v, q)| v * q).sum::<f64>());
    rows.iter().zip(QUARTIC[j]).map(|(v, q)| v * q).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{CubeSphere, Ellipsoid};

    #[test]
    fn words_stand_for_what_they_came_from() {
        for v in [0.0, -1e-9, 6_378_137.123, -6_378_137.123, 1e9, -3.3e11] {
            let unit = 2.0_f64.powi(-12);
            assert!((words_m(anchor_words(v, unit), unit) - v).abs() <= unit * 0.5, "{v}");
        }
        // Far outside they saturate instead of wrapping around.
        assert_eq!(anchor_words(1e30, 1.0).0, 1_073_741_823);
    }

    /// Evaluates a record in f64 as the shader does in f32.
    fn evaluate(
        anchor: &[[i32; 4]; 2],
        r: &BlockRecord,
        cell: [f64; 2],
        half: f64,
        unit: f64,
    ) -> ([f64; 3], [f64; 3]) {
        let s = cell.map(|c| c / half);
        let at = |c: &[[f32; 3]], axis: usize| -> f64 {
            c.iter()
                .zip(TERMS)
                .map(|(c, [i, j])| f64::from(c[axis]) * s[0].powi(i as i32) * s[1].powi(j as i32))
                .sum()
        };
        let position = [0, 1, 2].map(|a| {
            words_m((anchor[0][a], anchor[1][a]), unit)
                + (f64::from(r.linear[0][a]) * cell[0] + f64::from(r.linear[1][a]) * cell[1]) * unit
                + at(&r.surface, a)
        });
        let coarse = [r.linear[0][3], r.linear[1][3], r.up_z].map(|v| f64::from(v) / f64::from(1 << UP_BITS));
        (position, [0, 1, 2].map(|a| coarse[a] + at(&r.normal, a)))
    }

    #[test]
    fn a_record_gives_the_earth_within_half_a_millimetre() {
        let size = 2048;
        let earth = CubeSphere { ellipsoid: Ellipsoid::WGS84, size };
        let units = Units::new(5, earth.cell_m(), 16, 9_000.0, earth.reach_m());
        let mut worst = 0.0_f64;
        for chart in 0..6 {
            for block in [[0, 0], [64, 64], [127, 0], [128, 128], [31, 90], [-1, 128]] {
                let (a, r) = block_record(&earth, chart, [size; 2], 0, block, 16, units.level_m[0]);
                for k in 0..81 {
                    // Beyond the border only the nearest nodes are ever asked for.
                    let cell = [0, 1].map(|a| {
                        let c = f64::from(if a == 0 { k % 9 } else { k / 9 }) * 2.0 - 8.0;
                        match block[a] {
                            128 => c.min(-7.0),
                            -1 => c.max(7.0),
                            _ => c,
                        }
                    });
                    let start = block.map(|b| f64::from(block_start(size, 0, 16, b)));
                    let (p, n) = earth.base(chart, [start[0] + 8.0 + cell[0], start[1] + 8.0 + cell[1]]);
                    let (q, m) = evaluate(&a, &r, cell, 8.0, units.level_m[0]);
                    // At 9 km of height, the normal's error is part of it.
                    let at_height = |p: [f64; 3], n: [f64; 3]| {
                        glam::DVec3::from_array([0, 1, 2].map(|a| p[a] + 9_000.0 * n[a]))
                    };
                    let error = at_height(q, m).distance(at_height(p.to_array(), n.to_array()));
                    if error > 5e-4 {
                        println!("chart {chart} block {block:?} cell {cell:?}: {error:e} m");
                    }
                    worst = worst.max(error);
                }
            }
        }
        println!("worst {worst:e} m, unit {:e} m", units.level_m[0]);
        assert!(worst <= 4e-4, "{worst}");
    }
}
