//! Hash-based lattice noise in `f64`: pure functions of seed and position, defined everywhere.

use std::f64::consts::TAU;

/// A well-mixed 64-bit hash of a lattice cell.
pub(crate) fn hash(seed: u64, x: i64, y: i64) -> u64 {
    let mut h = seed
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add((x as u64).wrapping_mul(0xd6e8_feb8_6659_fd93))
        .rotate_left(29)
        .wrapping_add((y as u64).wrapping_mul(0xa5a3_5642_0b1c_7e2d));
    for _ in 0..2 {
        h = (h ^ (h >> 32)).wrapping_mul(0xe703_7ed1_a0b4_28db);
    }
    h ^ (h >> 29)
}

/// Two numbers in [-1, 1) from a hash.
fn pair(h: u64) -> [f64; 2] {
    let part = |bits: u64| f64::from(bits as u32 as i32) / 2_147_483_648.0;
    [part(h), part(h >> 32)]
}

/// Gradient noise with wavelength about 2: value, mostly in [-1, 1], and its two derivatives.
pub(crate) fn gradient(seed: u64, [x, y]: [f64; 2]) -> [f64; 3] {
    let (cx, cy) = (x.floor(), y.floor());
    let (fx, fy) = (x - cx, y - cy);
    let (ix, iy) = (cx as i64, cy as i64);
    let corner = |ox: i64, oy: i64| {
        let [gx, gy] = pair(hash(seed, ix.wrapping_add(ox), iy.wrapping_add(oy)));
        let dot = gx * (fx - ox as f64) + gy * (fy - oy as f64);
        [dot, gx, gy]
    };
    let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
    // The quintic fade has a continuous second derivative, so slopes show no lattice lines.
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let fade_slope = |t: f64| 30.0 * t * t * (t - 1.0) * (t - 1.0);
    let (u, v) = (fade(fx), fade(fy));
    let mix = |k: usize| {
        let twist = a[k] - b[k] - c[k] + d[k];
        a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]) + u * v * twist
    };
    let twist = a[0] - b[0] - c[0] + d[0];
    let scale = 1.6;
    [
        scale * mix(0),
        scale * (mix(1) + fade_slope(fx) * (b[0] - a[0] + v * twist)),
        scale * (mix(2) + fade_slope(fy) * (c[0] - a[0] + u * twist)),
    ]
}

/// Noise of parallel waves with wavelength 1 across `direction` (unit length): patches of plane
/// waves with random phases, blended. Value in [-1, 1] and its two derivatives.
pub(crate) fn waves(seed: u64, [x, y]: [f64; 2], direction: [f64; 2]) -> [f64; 3] {
    /// Patches reach this far, which is the distance from any point of a cell to the nearest
    /// patch centre outside its 3 x 3 neighbourhood.
    const REACH2: f64 = 1.25 * 1.25;
    let (cx, cy) = (x.floor(), y.floor());
    let (ix, iy) = (cx as i64, cy as i64);
    let (mut weights, mut value, mut slope) = (0.0, 0.0, 0.0);
    for oy in -1..=1 {
        for ox in -1..=1 {
            let [jx, jy] = pair(hash(seed, ix.wrapping_add(ox), iy.wrapping_add(oy)));
            let dx = x - cx - ox as f64 - 0.5 - 0.25 * jx;
            let dy = y - cy - oy as f64 - 0.5 - 0.25 * jy;
            let closeness = 1.0 - (dx * dx + dy * dy) / REACH2;
            if closeness > 0.0 {
                let weight = closeness * closeness * closeness;
                let (sin, cos) = (TAU * (dx * direction[0] + dy * direction[1])).sin_cos();
                weights += weight;
                value += weight * cos;
                slope -= weight * sin * TAU;
            }
        }
    }
    if weights <= 0.0 {
        return [0.0; 3];
    }
    let slope = slope / weights;
    [value / weights, slope * direction[0], slope * direction[1]]
}

/// 0 below `low`, 1 above `high`, smooth between.
pub(crate) fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::gradient;

    #[test]
    fn derivatives_match_differences() {
        let e = 1e-5;
        for k in 0..200 {
            let p = [f64::from(k) * 0.37 - 20.0, f64::from(k) * 0.71 + 3.0];
            let [v, dx, dy] = gradient(7, p);
            let nx = gradient(7, [p[0] + e, p[1]])[0];
            let ny = gradient(7, [p[0], p[1] + e])[0];
            assert!(v.abs() < 1.7);
            assert!(((nx - v) / e - dx).abs() < 1e-3);
            assert!(((ny - v) / e - dy).abs() < 1e-3);
        }
    }
}
