//! Noise in space, for terrain without a plane: sums of octaves on turned lattices.

use super::noise::hash;

/// Most octaves of a sum, whatever the spacing.
const OCTAVES: u32 = 20;

/// Octaves of a sum that starts at `frequency`, down to waves of two spacings (waves are about two
/// lattice cells long), but no fewer than `least`.
pub(crate) fn octaves(frequency: f64, spacing: f64, least: u32) -> u32 {
    let most = (1.0 / (frequency * spacing)).log2().floor().max(0.0);
    (most as u32 + 1).clamp(least, OCTAVES)
}

/// Sum of octaves of [`gradient`], each twice as fine and `gain` as tall; mostly in [-1, 1].
pub(crate) fn fractal(seed: u64, mut p: [f64; 3], gain: f64, octaves: u32) -> f64 {
    let (mut sum, mut amplitude) = (0.0, 1.0);
    for octave in 0..octaves {
        sum += amplitude * gradient(seed.wrapping_add(u64::from(octave) << 20), p);
        amplitude *= gain;
        // Twice a rotation about (1, 1, 1) and an offset, so that lattices of octaves never align.
        let [x, y, z] = p;
        p = [
            1.8213672 * x - 0.4880338 * y + 0.6666667 * z + 5.3,
            0.6666667 * x + 1.8213672 * y - 0.4880338 * z - 2.9,
            -0.4880338 * x + 0.6666667 * y + 1.8213672 * z + 8.1,
        ];
    }
    sum
}

/// Gradient noise in space with wavelength about 2, mostly in [-1, 1].
fn gradient(seed: u64, p: [f64; 3]) -> f64 {
    let cell = p.map(f64::floor);
    let f = [p[0] - cell[0], p[1] - cell[1], p[2] - cell[2]];
    let at = cell.map(|c| c as i64);
    let corner = |ox: i64, oy: i64, oz: i64| {
        let plane = seed.wrapping_add((at[2].wrapping_add(oz) as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f));
        let h = hash(plane, at[0].wrapping_add(ox), at[1].wrapping_add(oy));
        let part = |shift: u32| f64::from((h >> shift) as u32 & 0x1f_ffff) / 1_048_576.0 - 1.0;
        part(0) * (f[0] - ox as f64) + part(21) * (f[1] - oy as f64) + part(42) * (f[2] - oz as f64)
    };
    // The quintic fade has a continuous second derivative, so slopes show no lattice planes.
    let [u, v, w] = f.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let row = |oy, oz| mix(corner(0, oy, oz), corner(1, oy, oz), u);
    let plane = |oz| mix(row(0, oz), row(1, oz), v);
    1.5 * mix(plane(0), plane(1), w)
}
