//! Paths that ask for new data at once: a jump every second, and turning on the spot.

use super::field::{Field, Random};
use super::named::Named;
use super::{Key, Tempo};

/// Shares of the extent between which teleports move.
const BORDERS: [f64; 2] = [0.02, 0.98];
/// Seconds of a whole turn on the spot.
const TURN_S: f64 = 2.0;

/// Another place and heading every second of path time, as long as the flight; between two jumps the
/// camera stands, or flies straight on where a speed is given.
pub(super) fn teleport(field: &Field<'_>, tempo: &Tempo) -> Named {
    let mut random = Random::new();
    let mut keys: Vec<Key> = Vec::new();
    let seconds = tempo.seconds().ceil().max(1.0) as u32;
    for second in 0..seconds {
        let place = [0.05 + 0.9 * random.share(), 0.05 + 0.9 * random.share()];
        let yaw = 360.0 * random.share();
        let legs = straight_on(place, yaw, tempo.speed_m_s.unwrap_or(0.0), field.side_m(place));
        // One height for the whole second, over the highest ground below.
        let ground_m = legs
            .windows(2)
            .flat_map(|leg| (0..=16).map(move |j| (leg[0].place, leg[1].place, f64::from(j) / 16.0)))
            .map(|(a, b, s)| field.ground(field.at([0, 1].map(|i| a[i] + (b[i] - a[i]) * s))))
            .fold(f64::NEG_INFINITY, f64::max);
        keys.extend(legs.into_iter().map(|leg| {
            let [x, y] = field.at(leg.place);
            Key {
                t: f64::from(second) + leg.t,
                x,
                y,
                z: ground_m + field.clear_m(),
                yaw: leg.yaw,
                pitch: -12.0,
            }
        }));
    }
    Named { keys, timed: true, jumps: (1..seconds).map(f64::from).collect() }
}

/// A corner of a second of flight.
struct Leg {
    /// 0..1 s.
    t: f64,
    /// Shares of the extent.
    place: [f64; 2],
    /// Degrees.
    yaw: f64,
}

/// A second of straight flight, thrown back at the terrain's border, where it turns at once: two legs then
/// have the same time.
fn straight_on(mut place: [f64; 2], mut yaw: f64, speed_m_s: f64, side_m: [f64; 2]) -> Vec<Leg> {
    let mut t = 0.0_f64;
    let mut legs = vec![Leg { t, place, yaw }];
    // More corners than that make no difference any more.
    for _ in 0..1_000 {
        let (sin, cos) = yaw.to_radians().sin_cos();
        let speed = [sin * speed_m_s / side_m[0], cos * speed_m_s / side_m[1]];
        let border = |a: usize| {
            let way = BORDERS[usize::from(speed[a] > 0.0)] - place[a];
            if speed[a] == 0.0 { f64::INFINITY } else { (way / speed[a]).max(0.0) }
        };
        let (east, north) = (border(0), border(1));
        let takes = east.min(north).min(1.0 - t);
        place = [0, 1].map(|a| (place[a] + speed[a] * takes).clamp(BORDERS[0], BORDERS[1]));
        t += takes;
        legs.push(Leg { t, place, yaw });
        if t > 1.0 - 1e-9 {
            break;
        }
        yaw = if east <= north { -yaw } else { 180.0 - yaw };
        legs.push(Leg { t, place, yaw });
    }
    if let Some(end) = legs.last_mut() {
        end.t = 1.0;
    }
    legs
}

/// Turning on the spot over the middle, as long as the flight, at any speed.
pub(super) fn spin(field: &Field<'_>, tempo: &Tempo) -> Named {
    let [x, y] = field.at([0.5, 0.5]);
    let z = field.ground([x, y]) + field.clear_m();
    // Eight keys a turn: each turn between two of them is the short way.
    let key = |k: u32| {
        let turn = f64::from(k) / 8.0;
        Key { t: TURN_S * turn, x, y, z, yaw: 360.0 * turn.fract(), pitch: -12.0 }
    };
    let count = (8.0 * tempo.seconds() / TURN_S).ceil().max(1.0) as u32;
    Named { keys: (0..=count).map(key).collect(), timed: true, jumps: Vec::new() }
}
