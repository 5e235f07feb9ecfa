//! The lines at the bottom: where the camera is, what lies under the cursor, and the state of the program.

use super::format::{angle, heading, known, latitude, length, longitude, metres};
use crate::viewer::facts::{Facts, UnderCursor};
use crate::viewer::look::Look;

/// Where the camera is and looks, the most important first.
pub fn camera(facts: &Facts) -> Vec<String> {
    let [x, y, z, yaw, pitch] = facts.pose;
    let mut items = place([x, y], facts.degrees);
    items.push(if facts.degrees { format!("height {}", metres(z)) } else { format!("z {}", metres(z)) });
    items.push(format!("{} above ground", known(facts.above_ground_m, length)));
    items.push(format!("heading {}", heading(yaw)));
    items.push(format!("pitch {}", angle(pitch)));
    items.push(format!("speed {}/s", length(facts.speed_m_s)));
    items
}

/// What lies under the cursor.
pub fn cursor(under: &UnderCursor, degrees: bool) -> Vec<String> {
    let mut items = vec!["cursor".to_owned()];
    items.extend(place(under.place, degrees));
    items.push(format!("{} drawn", metres(under.drawn_m)));
    items.push(format!("slope {}", angle(under.slope_deg)));
    items.push(format!("{} away", length(under.distance_m)));
    items.push(format!("level {}", under.level));
    items.push(format!("{} finest level", known(under.full_m, metres)));
    items
}

/// What is going on.
pub fn badges(facts: &Facts, look: &Look) -> Vec<String> {
    let mut items = Vec::new();
    items.extend(facts.recording_s.map(|s| format!("REC {s:.1} s")));
    items.extend(facts.replay_s.map(|[at, end]| format!("REPLAY {at:.1}/{end:.1} s")));
    items.extend(look.frozen.map(|_| "FROZEN".to_owned()));
    items.extend(facts.following.then(|| "FOLLOW".to_owned()));
    if !facts.vsync.is_empty() {
        items.push(format!("vsync {}", facts.vsync));
    }
    items.push(format!("{} x {} px", facts.size_px[0], facts.size_px[1]));
    items
}

fn place([x, y]: [f64; 2], degrees: bool) -> Vec<String> {
    if degrees {
        vec![longitude(x), latitude(y)]
    } else {
        vec![format!("x {}", metres(x)), format!("y {}", metres(y))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::hud::tests::{full_facts, look};

    #[test]
    fn places_are_in_the_units_of_the_terrain() {
        let mut facts = full_facts();
        assert_eq!(camera(&facts)[..3], ["8.37500° E", "47.50000° N", "height 4\u{2009}321.0 m"]);
        facts.degrees = false;
        assert_eq!(camera(&facts)[..3], ["x 8.4 m", "y 47.5 m", "z 4\u{2009}321.0 m"]);
    }

    #[test]
    fn nothing_below_is_not_the_ground() {
        let mut facts = full_facts();
        facts.above_ground_m = None;
        assert!(camera(&facts).contains(&"– above ground".to_owned()));
        let under = UnderCursor { full_m: None, ..facts.cursor.unwrap() };
        assert_eq!(cursor(&under, true).last().unwrap(), "– finest level");
    }

    #[test]
    fn badges_show_only_what_is_on() {
        let mut facts = Facts { size_px: [640, 360], vsync: "fifo", ..Facts::default() };
        let mut look = look();
        assert_eq!(badges(&facts, &look), ["vsync fifo", "640 x 360 px"]);
        facts.recording_s = Some(12.34);
        facts.replay_s = Some([3.06, 20.0]);
        facts.following = true;
        look.frozen = Some([0.0; 5]);
        let on = ["REC 12.3 s", "REPLAY 3.1/20.0 s", "FROZEN", "FOLLOW", "vsync fifo", "640 x 360 px"];
        assert_eq!(badges(&facts, &look), on);
    }
}
