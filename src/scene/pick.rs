//! Where a ray meets the ground.

use glam::DVec3;

use super::{Curved, Terrain};
use crate::surface::Ellipsoid;

/// Most places of a ray that are looked at.
const MOST_PROBES: u32 = 600;
/// Those of them that are kept for closing in on what was found.
const KEPT_PROBES: u32 = 120;
/// Most places between two probes that are searched for a crest.
const MOST_CRESTS: u32 = 6;
/// Steps are this share of the distance,
const STEP: f64 = 0.03;
/// and at most this share of the way through where there may be ground.
const STEPS: f64 = 150.0;
/// What is met is closed in on to this share of its distance.
const CLOSE: f64 = 1e-6;

impl Terrain {
    /// Where a ray from a world point first meets the full-resolution surface, from above or from below, within
    /// `reach_m` metres; `None` where it meets none, and for what is not finite. Steps grow with the distance: what
    /// is narrower than a thirtieth of it may be missed where the ray grazes it.
    #[must_use]
    pub fn pick(&self, from: DVec3, direction: DVec3, reach_m: f64) -> Option<DVec3> {
        let along = direction.try_normalize()?;
        if !from.is_finite() || reach_m.is_nan() || reach_m <= 0.0 {
            return None;
        }
        let (mut ray, way) = Ray::new(self, from, along, reach_m)?;
        ray.march(way).map(|t| from + along * t)
    }
}

/// What is known of a place of a ray.
#[derive(Clone, Copy)]
struct Probe {
    /// Metres from its beginning.
    t: f64,
    /// Metres above the surface; `None` where there is none.
    above_m: Option<f64>,
    /// Metres for which no ground comes in any direction.
    clear_m: f64,
}

impl Probe {
    fn is_above(&self) -> bool {
        self.above_m.is_some_and(|m| m > 0.0)
    }
}

struct Ray<'a> {
    terrain: &'a Terrain,
    from: DVec3,
    along: DVec3,
    /// Between which heights above the base surface all ground lies, metres.
    range_m: [f64; 2],
    cell_m: f64,
    /// Probes left.
    left: u32,
}

impl<'a> Ray<'a> {
    /// The ray, and from where to where it may meet ground.
    fn new(terrain: &'a Terrain, from: DVec3, along: DVec3, reach_m: f64) -> Option<(Self, [f64; 2])> {
        let cell_m = terrain.spacing_m[0].min(terrain.spacing_m[1]);
        let range = match &terrain.curved {
            Some(curved) => curved.height_range(),
            None => terrain.source.height_range(),
        };
        let [low, high] = range?.map(f64::from);
        let whole = [0.0, reach_m];
        let (range_m, way) = match &terrain.curved {
            None => {
                // Flat ground needs some room as well.
                let slack = 0.01 * cell_m + 1e-3 * (high - low);
                let [sw, ne] = terrain.extent_m();
                let range_m = [low - slack, high + slack];
                let corner = |p: [f64; 2], z: f64| DVec3::new(p[0], p[1], z);
                let bounds = [corner(sw, range_m[0]), corner(ne, range_m[1])];
                (range_m, through_box(from, along, bounds, whole)?)
            }
            Some(curved) if curved.points.is_some() => {
                // Heights are distances from the positions; triangles lie less than a cell off the patches
                // through them.
                let range_m = [-1.0, 1.0].map(|side| side * terrain.spacing_m[0]);
                (range_m, through_box(from, along, bounds(curved, range_m)?, whole)?)
            }
            Some(curved) => {
                // Chords lie beside the base surface by this much, below or, where it is a saddle, above.
                let cell = curved.surface.cell_m();
                let slack = cell * cell / (4.0 * curved.surface.least_radius_m()) + 0.01 * cell_m;
                let range_m = [low - slack, high + slack];
                let way = match curved.whole {
                    Some(ellipsoid) => through_shell(from, along, ellipsoid, range_m, whole)?,
                    None => through_box(from, along, bounds(curved, range_m)?, whole)?,
                };
                (range_m, way)
            }
        };
        (way[1] - way[0])
            .is_finite()
            .then_some((Self { terrain, from, along, range_m, cell_m, left: MOST_PROBES }, way))
    }

    /// The first meeting on the way, metres from the ray's beginning.
    fn march(&mut self, [begin, end]: [f64; 2]) -> Option<f64> {
        let length = end - begin;
        let least = (0.5 * self.cell_m).max(2e-5 * length);
        let most = (length / STEPS).max(least);
        let mut before: Option<Probe> = None;
        let mut last = self.probe(begin)?;
        let mut crests = MOST_CRESTS;
        while last.t < end && self.left > KEPT_PROBES {
            let step = (STEP * last.t).clamp(least, most).max(last.clear_m);
            let next = self.probe((last.t + step).min(end))?;
            if let Some(t) = self.between(last, next) {
                return Some(t);
            }
            if let Some(before) = before.filter(|b| crests > 0 && may_graze(b, &last, &next)) {
                crests -= 1;
                if let Some(t) = self.crest(before, next) {
                    return Some(t);
                }
            }
            before = Some(last);
            last = next;
        }
        None
    }

    /// Looks at a place; `None` when that was done often enough.
    fn probe(&mut self, t: f64) -> Option<Probe> {
        self.left = self.left.checked_sub(1)?;
        let Some(stand) = self.terrain.stand(self.from + self.along * t) else {
            return Some(Probe { t, above_m: None, clear_m: 0.0 });
        };
        let [low, high] = self.range_m;
        let clear_m = (stand.height_m - high).max(low - stand.height_m);
        if clear_m > 0.0 {
            // The nearest ground is no nearer than the base surface, whose distance the height is.
            let over = if stand.height_m > high { clear_m } else { -clear_m };
            return Some(Probe { t, above_m: (stand.beyond == 0.0).then_some(over), clear_m });
        }
        let above_m = self.terrain.full_surface(&stand).map(|spot| spot.above_m);
        Some(Probe { t, above_m, clear_m: 0.0 })
    }

    /// Where the surface is met between two probes next to each other.
    fn between(&mut self, a: Probe, b: Probe) -> Option<f64> {
        match (a.above_m, b.above_m) {
            (Some(_), Some(_)) if a.is_above() != b.is_above() => self.close_in(a, b),
            (Some(_), None) if a.clear_m == 0.0 => self.before_border(a, b.t),
            (None, Some(_)) if b.clear_m == 0.0 => self.before_border(b, a.t),
            _ => None,
        }
    }

    /// Where the surface is met between two places on different sides of it, the nearer one first.
    fn close_in(&mut self, mut a: Probe, mut b: Probe) -> Option<f64> {
        let least = 1e-3 * self.cell_m;
        while b.t - a.t > CLOSE * b.t.max(least) {
            let Some(middle) = self.probe(0.5 * (a.t + b.t)) else { break };
            if middle.above_m.is_none() {
                // Over a hole, or past the border: what is met lies on either side of it.
                return self.before_border(a, middle.t).or_else(|| self.before_border(b, middle.t));
            }
            if middle.is_above() == a.is_above() { a = middle } else { b = middle }
        }
        Some(b.t)
    }

    /// Where the surface is met on the way from a place over or under it to one where there is none.
    fn before_border(&mut self, from: Probe, none_t: f64) -> Option<f64> {
        let (mut inside, mut outside) = (from, none_t);
        let least = 1e-3 * self.cell_m;
        while (outside - inside.t).abs() > CLOSE * inside.t.max(outside).max(least) {
            let middle = self.probe(0.5 * (inside.t + outside))?;
            if middle.above_m.is_none() {
                outside = middle.t;
            } else if middle.is_above() == from.is_above() {
                inside = middle;
            } else if middle.t < from.t {
                return self.close_in(middle, from);
            } else {
                return self.close_in(from, middle);
            }
        }
        None
    }

    /// Where a crest between two places over the surface is met, if it reaches the ray.
    fn crest(&mut self, a: Probe, b: Probe) -> Option<f64> {
        let (mut low, mut high) = (a.t, b.t);
        for _ in 0..10 {
            // Golden sections, from both ends.
            let x = self.probe(low + 0.382 * (high - low))?;
            let y = self.probe(low + 0.618 * (high - low))?;
            let (left, right) = (x.above_m?, y.above_m?);
            if left <= 0.0 {
                return self.close_in(a, x);
            }
            if right <= 0.0 {
                return self.close_in(x, y);
            }
            if left < right { high = y.t } else { low = x.t }
        }
        None
    }
}

/// True when the ground comes so near between three places over it that it may rise through the ray.
fn may_graze(a: &Probe, b: &Probe, c: &Probe) -> bool {
    let (Some(x), Some(y), Some(z)) = (a.above_m, b.above_m, c.above_m) else { return false };
    b.clear_m == 0.0 && x > 0.0 && z > 0.0 && y < x && y <= z && y < (x - y).max(z - y)
}

/// The part of a way along a ray that lies in a box.
fn through_box(from: DVec3, along: DVec3, [low, high]: [DVec3; 2], way: [f64; 2]) -> Option<[f64; 2]> {
    let [mut begin, mut end] = way;
    for axis in 0..3 {
        if along[axis] == 0.0 {
            if from[axis] < low[axis] || from[axis] > high[axis] {
                return None;
            }
            continue;
        }
        let sides = [low, high].map(|side| (side[axis] - from[axis]) / along[axis]);
        begin = begin.max(sides[0].min(sides[1]));
        end = end.min(sides[0].max(sides[1]));
    }
    (begin < end).then_some([begin, end])
}

/// The part of a way along a ray that lies in the shell of heights over a whole ellipsoid; below it no ray
/// comes without having met the ground.
fn through_shell(
    from: DVec3,
    along: DVec3,
    e: Ellipsoid,
    [low, high]: [f64; 2],
    way: [f64; 2],
) -> Option<[f64; 2]> {
    // Scaled as a whole, so that all ground lies between both: longer axes alone would not hold it.
    let scaled = |height: f64| {
        let share = 1.0 + height / e.a.min(e.b);
        (share > 0.0).then(|| DVec3::new(e.a, e.a, e.b) * share)
    };
    let crossed = |axes: DVec3| {
        let (o, d) = (from / axes, along / axes);
        let (square, half) = (d.length_squared(), o.dot(d));
        let root = (half * half - square * (o.length_squared() - 1.0)).sqrt();
        (!root.is_nan()).then(|| [(-half - root) / square, (-half + root) / square])
    };
    let [enters, leaves] = crossed(scaled(high.max(0.0))?)?;
    let (begin, mut end) = (way[0].max(enters), way[1].min(leaves));
    if let Some([ground, _]) = scaled(low.min(0.0)).and_then(crossed).filter(|c| c[0] >= begin) {
        end = end.min(ground);
    }
    (begin < end).then_some([begin, end])
}

/// A box around all ground between two heights over a curved base, world metres.
fn bounds(curved: &Curved, range_m: [f64; 2]) -> Option<[DVec3; 2]> {
    if let Some(points) = &curved.points {
        let [low, high] = points.bounds_m()?.map(DVec3::from_array);
        let slack = DVec3::splat(range_m[1]);
        return Some([low - slack, high + slack]);
    }
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (k, chart) in curved.graph.charts.iter().enumerate() {
        for i in 0..81 {
            let share = [i % 9, i / 9].map(|v| f64::from(v) / 8.0);
            let at = [0, 1].map(|a: usize| share[a] * f64::from(chart.lattice.last[a]));
            let (p, up) = curved.surface.base(k, at);
            for height in range_m {
                low = low.min(p + up * height);
                high = high.max(p + up * height);
            }
        }
    }
    // Between these places the surface may bulge by a part of a turn.
    let slack = DVec3::splat(0.03 * low.distance(high));
    Some([low - slack, high + slack])
}

#[cfg(test)]
mod tests;
