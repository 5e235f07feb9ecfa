//! The two natural landforms: mountains and dunes, in metres at a plane position in metres.

use super::noise::{gradient, smoothstep, waves};

/// Wavelength scale of the massifs in metres.
const MASSIF_M: f64 = 7_500.0;
/// Height scale of the mountains in metres.
const RELIEF_M: f64 = 3_000.0;
/// Octaves of the large forms, on whose slopes the gullies run.
const COARSE: u32 = 3;
/// Wavelength of the largest gullies in metres; each further octave halves it.
const GULLY_M: f64 = 1_200.0;
/// Height of a gully wave as a fraction of its wavelength.
const GULLY_DEPTH: f64 = 0.075;

/// Mountains, about 0 to 3000 m.
///
/// Ridges come from a warped ridged multifractal whose octaves fade on steep ground, as talus
/// smooths slopes and leaves crests sharp. Into them, gullies are cut that run down the slopes
/// of the large forms, so that large valleys branch into smaller ones. Detail ends at twice
/// `spacing_m`.
pub(crate) fn mountains(seed: u64, [x, y]: [f64; 2], spacing_m: f64) -> f64 {
    let e = 60.0;
    let (coarse, mut height) = massif(seed, [x, y], spacing_m);
    let east = massif(seed, [x + e, y], f64::INFINITY).0;
    let north = massif(seed, [x, y + e], f64::INFINITY).0;
    let mut slope = [(east - coarse) / e, (north - coarse) / e];
    let mut length = GULLY_M;
    for octave in 0..3 {
        if length < 4.0 * spacing_m {
            break;
        }
        let steepness = slope[0].hypot(slope[1]);
        if steepness > 1e-9 {
            let across = [-slope[1] / steepness, slope[0] / steepness];
            let depth = length * GULLY_DEPTH * smoothstep(0.05, 0.6, steepness);
            // Turned against the axes, which would show in the patches otherwise.
            let at = [(0.8 * x - 0.6 * y) / length + 17.0, (0.6 * x + 0.8 * y) / length - 5.0];
            let turned = [0.8 * across[0] - 0.6 * across[1], 0.6 * across[0] + 0.8 * across[1]];
            let [value, du, dv] = waves(seed ^ (0x6011 + octave), at, turned);
            // Pulled down by half a wave: gullies are cut, spurs are what is left.
            height += depth * (value - 0.5);
            slope[0] += depth * (0.8 * du + 0.6 * dv) / length;
            slope[1] += depth * (0.8 * dv - 0.6 * du) / length;
        }
        length *= 0.5;
    }
    floor(height)
}

/// Eases heights under 60 m into a flat valley floor that never drops under 0.
fn floor(height: f64) -> f64 {
    let soft = 60.0;
    if height > soft { height } else { soft * ((height - soft) / soft).exp() }
}

/// The ground without gullies, metres: after the coarse octaves, and with all down to twice
/// `spacing_m`.
fn massif(seed: u64, [x, y]: [f64; 2], spacing_m: f64) -> (f64, f64) {
    let mut p = [x / MASSIF_M + 0.37, y / MASSIF_M + 0.71];
    let bend = |k: u64, f: f64| gradient(seed ^ k, [p[0] * f, p[1] * f])[0];
    let warp =
        [0.25 * bend(0xa1, 0.9) + 0.05 * bend(0xa2, 2.7), 0.25 * bend(0xb1, 0.9) + 0.05 * bend(0xb2, 2.7)];
    let upland = smoothstep(-0.75, 0.55, bend(0xc1, 0.55));
    p = [p[0] + warp[0], p[1] + warp[1]];
    let scale = RELIEF_M * (0.25 + 0.75 * upland);
    let metres = |sum: f64| scale * (0.36 + 0.72 * sum);
    let (mut sum, mut amplitude, mut weight) = (0.0, 1.0, 1.0);
    let mut lean = [0.0, 0.0];
    let mut coarse = 0.0;
    let mut length = MASSIF_M;
    // Twenty octaves end at centimetres, whatever the spacing.
    for octave in 0..20 {
        let [n, dx, dy] = gradient(seed ^ (0x51 + u64::from(octave)), p);
        // Only the largest octave makes crests; in all of them they would cross like worms.
        // Rounded near 0, or a crest would be a crease as sharp as the sampling allows.
        let form = if octave == 0 { 1.0 - 2.2 * n.hypot(0.08) } else { n };
        // The lean counts without the sign of the fold, which would tear it along the crest.
        lean = [lean[0] + 0.75 * dx, lean[1] + 0.75 * dy];
        let steep = lean[0] * lean[0] + lean[1] * lean[1];
        sum += amplitude * weight * form / (1.0 + 0.7 * steep);
        // Low ground is smooth ground: sediment has filled it.
        if octave == 0 {
            weight = 0.9 + 0.35 * form;
        }
        amplitude *= 0.5;
        length *= 0.5;
        if octave + 1 == COARSE {
            coarse = metres(sum);
        }
        if octave + 1 >= COARSE && length < 2.0 * spacing_m {
            break;
        }
        // A turn of 36.87 degrees with a doubling, so that lattices of octaves never align.
        p = [1.6 * p[0] - 1.2 * p[1] + 3.1, 1.2 * p[0] + 1.6 * p[1] - 7.7];
    }
    (coarse, metres(sum))
}

/// Transverse dunes, about 0 to 100 m: a gentle windward and a steep lee side, the wind from
/// the west-south-west, with small dunes riding on large ones.
pub(crate) fn dunes(seed: u64, [x, y]: [f64; 2], spacing_m: f64) -> f64 {
    let mut height = 0.0;
    for (octave, (length, tall)) in [(1_500.0, 75.0), (390.0, 14.0), (95.0, 2.5)].into_iter().enumerate() {
        if length < 4.0 * spacing_m && octave > 0 {
            break;
        }
        let seed = seed ^ (0xd0 + octave as u64);
        let [bend, _, _] = gradient(seed, [x / (2.2 * length), y / (2.2 * length)]);
        let [swell, _, _] = gradient(seed ^ 0x77, [x / (3.1 * length), y / (1.7 * length)]);
        let along = (0.95 * x + 0.31 * y) / length + 0.9 * bend;
        let phase = along - along.floor();
        let crest = 0.76;
        let profile =
            if phase < crest { smoothstep(0.0, crest, phase) } else { smoothstep(1.0, crest, phase) };
        height += tall * profile * (0.75 + 0.35 * swell).clamp(0.1, 1.3);
    }
    height
}
