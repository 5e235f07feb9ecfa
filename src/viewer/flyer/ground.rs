//! The ground below the camera: how large it is, staying out of it, following it.

use glam::DVec3;
use tessclip::scene::Curved;
use tessclip::{Camera, Terrain};

use super::travel::within;
use super::{EASE_S, Flyer, REST, USUAL_FOV_DEG};

/// Lifts at most until the camera is out of the ground; one is enough where heights grow straight up.
const LIFTS: u32 = 16;

/// What the flyer asks about the ground.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    /// Height of a world point above the ground as drawn, metres; none where there is no ground.
    pub above: &'a dyn Fn(DVec3) -> Option<f64>,
}

/// Lengths that suit a terrain, metres; all are greater than 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// Side of the whole terrain.
    pub size_m: f64,
    /// Least height that the speed goes by.
    pub least_m: f64,
    /// The eye is never closer to the ground.
    pub clearance_m: f64,
    /// A double click leads no closer to the ground.
    pub stand_off_m: f64,
    /// Height above the ground where none is given.
    pub go_to_m: f64,
}

impl Scale {
    pub(super) fn of(terrain: &Terrain) -> Self {
        let (cell_m, side_m) = match &terrain.curved {
            Some(curved) => (curved.surface.cell_m(), side_m(curved)),
            None => {
                let [low, high] = terrain.extent_m();
                let side_m = (high[0] - low[0]).max(high[1] - low[1]);
                (terrain.spacing_m[0].max(terrain.spacing_m[1]), side_m)
            }
        };
        let far = Camera::FARTHEST_M;
        let cell_m = cell_m.clamp(1e-9, far);
        let relief_m = terrain.source.height_range().map_or(0.0, |r| f64::from(r[1]) - f64::from(r[0]));
        let size_m = side_m.max(relief_m).max(cell_m).min(far);
        // Lengths of a walker, but on a table or a planet in proportion.
        let at_most = |metres: f64, share: f64| metres.min(share * size_m);
        let clearance_m = (0.02 * cell_m).max(at_most(0.5, 1e-3));
        Self {
            size_m,
            least_m: (0.01 * cell_m).max(at_most(2.0, 4e-3)),
            clearance_m,
            stand_off_m: (2.0 * clearance_m).max(at_most(3.0, 6e-3)),
            go_to_m: (8.0 * cell_m).min(size_m).max(at_most(1500.0, 0.25)),
        }
    }
}

/// Diagonal of the box around a curved base surface, metres.
fn side_m(curved: &Curved) -> f64 {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (k, chart) in curved.graph.charts.iter().enumerate() {
        for i in 0..81 {
            let share = [i % 9, i / 9].map(|v| f64::from(v) / 8.0);
            let at = [0, 1].map(|a| share[a] * f64::from(chart.lattice.last[a]));
            let (p, _) = curved.surface.base(k, at);
            (low, high) = (low.min(p), high.max(p));
        }
    }
    (high - low).length()
}

/// Whether the camera keeps its height above the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Following {
    /// It does not.
    Off,
    /// It takes the height where ground is seen next.
    Begun,
    /// It keeps this one, metres.
    At(f64),
}

impl Following {
    /// The height that is kept, metres.
    pub(super) fn height_m(self) -> Option<f64> {
        if let Self::At(height_m) = self { Some(height_m) } else { None }
    }

    /// The same, at whatever height the camera has next.
    pub(super) fn anew(self) -> Self {
        if self == Self::Off { self } else { Self::Begun }
    }
}

impl Flyer {
    /// From now on keeps the height above the ground, metres, or the one it has where none is given; or flies
    /// freely again.
    pub fn set_following(&mut self, on: bool, above_m: Option<f64>) {
        self.following = match above_m.filter(|a| a.is_finite()) {
            _ if !on => Following::Off,
            Some(above_m) => Following::At(above_m.max(self.scale.clearance_m)),
            None => Following::Begun,
        };
    }

    /// Whether it keeps its height above the ground.
    pub fn is_following(&self) -> bool {
        self.following != Following::Off
    }

    /// Height of the eye above the ground as drawn, metres.
    pub(super) fn above(&mut self, terrain: &Terrain, ground: &Ground<'_>) -> Option<f64> {
        let above_m = above(self.pose, terrain, ground)?;
        self.ground_m = self.pose[2] - above_m;
        Some(above_m)
    }

    /// Eases towards the followed height, which itself grows by `more_m` metres. Gives the height above the
    /// ground.
    pub(super) fn follow(
        &mut self,
        dt_s: f64,
        more_m: f64,
        terrain: &Terrain,
        ground: &Ground<'_>,
    ) -> Option<f64> {
        let above_m = self.above(terrain, ground)?;
        let kept_m = match self.following {
            Following::Off => return Some(above_m),
            Following::Begun => above_m,
            Following::At(height_m) => height_m + more_m,
        };
        let kept_m = kept_m.max(self.scale.clearance_m);
        self.following = Following::At(kept_m);
        let missing_m = kept_m - above_m;
        if missing_m.abs() <= REST * kept_m {
            return Some(above_m);
        }
        self.rise(missing_m * (1.0 - (-dt_s / EASE_S).exp()));
        self.above(terrain, ground)
    }

    /// Lifts the camera until it is clear of the ground. Under an overhang, where up leads into the rock, it
    /// stays at the pose it had `before`. Takes and gives the height above the ground.
    pub(super) fn keep_clear(
        &mut self,
        before: [f64; 5],
        above: Option<f64>,
        terrain: &Terrain,
        ground: &Ground<'_>,
    ) -> Option<f64> {
        let (first, moved) = (above?, self.pose);
        let clearance_m = self.scale.clearance_m;
        let (mut above_m, mut factor) = (first, 1.0);
        for _ in 0..LIFTS {
            let missing_m = clearance_m - above_m;
            if missing_m <= REST * clearance_m {
                return Some(above_m);
            }
            self.rise(missing_m * factor);
            let raised_m = self.above(terrain, ground)?;
            if raised_m <= above_m {
                break;
            }
            above_m = raised_m;
            // Over slopes of positions the distance grows more slowly than the height.
            factor *= 2.0;
        }
        self.pose = before;
        let was = self.above(terrain, ground);
        if was.is_some_and(|was| was < first) {
            // Still too close, but on the way out.
            self.pose = moved;
            return self.above(terrain, ground);
        }
        was
    }

    /// Metres along the local up.
    fn rise(&mut self, metres: f64) {
        self.pose[2] = (self.pose[2] + metres).clamp(-Camera::FARTHEST_M, Camera::FARTHEST_M);
    }
}

/// Height of a pose above the ground as drawn, metres.
pub(super) fn above(pose: [f64; 5], terrain: &Terrain, ground: &Ground<'_>) -> Option<f64> {
    let eye_m = within(terrain.camera(pose, USUAL_FOV_DEG).eye_m);
    (ground.above)(eye_m).filter(|a| a.is_finite())
}

/// The pose, lifted until it is `least_m` metres above the ground.
pub(super) fn lifted(mut pose: [f64; 5], least_m: f64, terrain: &Terrain, ground: &Ground<'_>) -> [f64; 5] {
    for _ in 0..LIFTS {
        match above(pose, terrain, ground) {
            Some(above_m) if above_m < least_m * (1.0 - REST) => pose[2] += least_m - above_m,
            _ => break,
        }
    }
    pose
}
