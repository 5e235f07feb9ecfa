//! The built-in paths by name, and those that lead over hill and dale.

use tessclip::Terrain;

use super::field::{Field, Random};
use super::{Key, Tempo, ground, places};

/// Names of the built-in paths.
pub(crate) const NAMES: [&str; 9] = [
    "straight",
    "double-turn",
    "circle",
    "random-walk",
    "orbit-to-ground",
    "follow",
    "teleport",
    "spin",
    "still",
];

/// A path without a name.
pub(super) struct Named {
    pub keys: Vec<Key>,
    /// Times of its keys are those of the flight, at whatever speed.
    pub timed: bool,
    /// Times of jumps to another place.
    pub jumps: Vec<f64>,
}

impl Named {
    pub(super) fn untimed(keys: Vec<Key>) -> Self {
        Self { keys, timed: false, jumps: Vec::new() }
    }
}

pub(super) fn named(name: &str, terrain: &Terrain, tempo: &Tempo) -> Named {
    let field = Field::new(terrain);
    match name {
        "random-walk" => Named::untimed(random_walk(&field, tempo)),
        "orbit-to-ground" => Named::untimed(ground::orbit_to_ground(&field)),
        "follow" => Named::untimed(ground::follow(&field, 0.05, 0.95)),
        "teleport" => places::teleport(&field, tempo),
        "spin" => places::spin(&field, tempo),
        "still" => still(over_the_middle("straight", &field)),
        _ => Named::untimed(over_the_middle(name, &field)),
    }
}

/// Standing where the straight path begins: what flights are measured against.
fn still(straight: Vec<Key>) -> Named {
    let keys = straight.first().map(|k| vec![*k, Key { t: k.t + 1.0, ..*k }]).unwrap_or_default();
    Named { keys, timed: true, jumps: Vec::new() }
}

/// Paths over the middle of the terrain, a fixed height above the ground below; over a globe the straight
/// one leads over the north pole.
fn over_the_middle(name: &str, field: &Field<'_>) -> Vec<Key> {
    let at = |u: f64, v: f64| field.at([u, v]);
    let globe = field.is_globe();
    let steps = 120;
    let points: Vec<[f64; 2]> = (0..=steps)
        .map(|k| {
            let s = f64::from(k) / f64::from(steps);
            match name {
                // From 60 degrees north over the pole to 60 degrees on the other side.
                "straight" if globe && s < 0.5 => [10.0, 60.0 + 60.0 * s],
                "straight" if globe => [-170.0, 120.0 - 60.0 * s],
                "straight" => at(0.5, 0.1 + 0.8 * s),
                "circle" => {
                    let angle = s * std::f64::consts::TAU;
                    at(0.5 + 0.3 * angle.sin(), 0.5 + 0.3 * angle.cos())
                }
                // Three legs with two sharp turns between them (Song et al. 2016, Fig. 7).
                _ if s < 0.4 => at(0.15 + 1.75 * s, 0.2),
                _ if s < 0.6 => at(0.85, 0.2 + 3.0 * (s - 0.4)),
                _ => at(0.85 - 1.75 * (s - 0.6), 0.8),
            }
        })
        .collect();
    let ground: Vec<f64> = points.iter().map(|p| field.ground(*p)).collect();
    let above = field.view_m();
    let mut keys: Vec<Key> = points
        .iter()
        .enumerate()
        .map(|(k, p)| {
            // Smoothed over the neighbours, so that the flight does not jump with each peak.
            let near = &ground[k.saturating_sub(6)..(k + 7).min(ground.len())];
            let mean = near.iter().sum::<f64>() / near.len() as f64;
            Key {
                t: k as f64 * 0.5,
                x: p[0],
                y: p[1],
                z: mean.max(ground[k]) + above,
                yaw: 0.0,
                pitch: -12.0,
            }
        })
        .collect();
    field.face_ahead(&mut keys);
    keys
}

/// Smooth pseudo-random turns, back towards the middle at the terrain's border: as long as the flight where
/// its speed is given, else four sides of the terrain.
fn random_walk(field: &Field<'_>, tempo: &Tempo) -> Vec<Key> {
    let side = field.side_m([0.5, 0.5]);
    let step_m = side[0].min(side[1]) / 200.0;
    let wanted_m = tempo.speed_m_s.map_or(4.0 * side[0].max(side[1]), |v| v * tempo.seconds());
    // Longer flights turn round and fly it backwards.
    let steps = (wanted_m / step_m).ceil().clamp(2.0, 50_000.0) as usize + 1;
    let mut random = Random::new();
    let mut at = [0.5, 0.5];
    let mut yaw = 360.0 * random.share();
    let mut turn = 0.0_f64;
    let mut points = vec![at];
    for _ in 0..steps {
        turn = (0.9 * turn + 2.0 * random.share() - 1.0).clamp(-5.0, 5.0);
        let (sin, cos) = f64::to_radians(yaw).sin_cos();
        let outward = |a: usize, d: f64| (at[a] < 0.15 && d < 0.0) || (at[a] > 0.85 && d > 0.0);
        if outward(0, sin) || outward(1, cos) {
            // The circle of these turns has a radius of 0.05 of the shorter side: it stays well inside.
            let middle = ((0.5 - at[0]) * side[0]).atan2((0.5 - at[1]) * side[1]).to_degrees();
            turn = ((middle - yaw + 180.0).rem_euclid(360.0) - 180.0).clamp(-6.0, 6.0);
        }
        yaw += turn;
        let (sin, cos) = f64::to_radians(yaw).sin_cos();
        at = [at[0] + sin * step_m / side[0], at[1] + cos * step_m / side[1]];
        points.push(at.map(|v| v.clamp(0.02, 0.98)));
    }
    let [x, y] = field.spacing_m();
    let fine = (step_m / x.min(y)).ceil().clamp(1.0, 16.0) as usize;
    let heights = ground::envelope(&points, fine, 4, |p| field.ground(field.at(p)));
    let above = field.clear_m();
    let mut keys: Vec<Key> = points
        .iter()
        .zip(heights)
        .enumerate()
        .map(|(k, (p, height))| {
            let [x, y] = field.at(*p);
            Key { t: k as f64 * 0.1, x, y, z: height + above, yaw: 0.0, pitch: -12.0 }
        })
        .collect();
    field.face_ahead(&mut keys);
    keys
}
