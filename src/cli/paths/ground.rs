//! Paths close to the ground.

use super::Key;
use super::field::Field;

/// Height above the ground at which it is followed, metres.
const LOW_M: f64 = 20.0;
/// View direction there, degrees up from the horizon.
const LOW_PITCH_DEG: f64 = -8.0;
/// Time the whole terrain takes to be followed across where no speed is given, seconds.
const FOLLOW_S: f64 = 30.0;
/// Time from space to the ground, seconds of path time at any speed.
const DESCENT_S: f64 = 10.0;

/// A height for every point such that straight lines between them never pass below the ground, which is
/// looked at in `fine` places between two points; smoothed over `wide` points to each side. The greatest
/// ground of the points around each point is smoothed, so the mean never falls below any of them.
pub(super) fn envelope(
    points: &[[f64; 2]],
    fine: usize,
    wide: usize,
    ground: impl Fn([f64; 2]) -> f64,
) -> Vec<f64> {
    let between: Vec<f64> = points
        .windows(2)
        .map(|p| {
            let at = |j: usize| {
                let s = j as f64 / fine as f64;
                [0, 1].map(|a| p[0][a] + (p[1][a] - p[0][a]) * s)
            };
            (0..=fine).map(|j| ground(at(j))).fold(f64::NEG_INFINITY, f64::max)
        })
        .collect();
    let last = between.len() - 1;
    let around = |k: usize| k.saturating_sub(wide)..(k + wide + 1).min(points.len());
    let own: Vec<f64> =
        (0..points.len()).map(|k| between[k.saturating_sub(1)].max(between[k.min(last)])).collect();
    let high: Vec<f64> =
        (0..points.len()).map(|k| own[around(k)].iter().copied().fold(f64::NEG_INFINITY, f64::max)).collect();
    let mean = |near: &[f64]| near.iter().sum::<f64>() / near.len() as f64;
    (0..points.len()).map(|k| mean(&high[around(k)])).collect()
}

/// North across the middle, 20 m above the ground as the finest samples have it.
pub(super) fn follow(field: &Field<'_>, from: f64, to: f64) -> Vec<Key> {
    let (side, spacing) = (field.side_m([0.5, 0.5]), field.spacing_m());
    let sample = [0, 1].map(|a| spacing[a] / side[a]);
    // A key a sample where there are not too many.
    let samples = ((to - from) / sample[1]).ceil().max(1.0);
    let count = samples.clamp(16.0, 4_000.0) as usize;
    let fine = (samples / count as f64).ceil().clamp(1.0, 256.0) as usize;
    let share = |k: usize| k as f64 / count as f64;
    let points: Vec<[f64; 2]> = (0..=count).map(|k| [0.5, from + (to - from) * share(k)]).collect();
    // With the samples to all sides: triangles reach up to them.
    let ground = |p: [f64; 2]| {
        (0..9_u32)
            .map(|j| {
                let off = [f64::from(j % 3) - 1.0, f64::from(j / 3) - 1.0];
                field.ground(field.at([0, 1].map(|a| p[a] + off[a] * sample[a])))
            })
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let heights = envelope(&points, fine, 2, ground);
    let mut keys: Vec<Key> = points
        .iter()
        .zip(heights)
        .enumerate()
        .map(|(k, (p, height))| {
            let [x, y] = field.at(*p);
            Key { t: FOLLOW_S * share(k), x, y, z: height + LOW_M, yaw: 0.0, pitch: LOW_PITCH_DEG }
        })
        .collect();
    field.face_ahead(&mut keys);
    keys
}

/// From a height that sees all of it straight down to 20 m above the middle, each level as long as the
/// next one, and on along the ground.
pub(super) fn orbit_to_ground(field: &Field<'_>) -> Vec<Key> {
    let low = follow(field, 0.5, 0.95);
    let first = low[0];
    let side = field.side_m([0.5, 0.5]);
    // Half of it is seen under 30 degrees, and a tenth more.
    let sees_all_m = 0.55 * side[0].max(side[1]) / f64::to_radians(30.0).tan();
    let high_m = sees_all_m.min(field.ceiling_m()).max(2.0 * LOW_M);
    let steps = 120;
    let mut keys: Vec<Key> = (0..steps)
        .map(|k| {
            let s = f64::from(k) / f64::from(steps);
            let pitch = -90.0 + (LOW_PITCH_DEG + 90.0) * s.powi(3);
            let above_m = high_m * (LOW_M / high_m).powf(s);
            Key { t: DESCENT_S * s, z: first.z - LOW_M + above_m, pitch, ..first }
        })
        .collect();
    keys.extend(low.into_iter().map(|key| Key { t: key.t + DESCENT_S, ..key }));
    keys
}
