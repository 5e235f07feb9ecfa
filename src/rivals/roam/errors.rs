//! The error of every split vertex, nested, and what bounds a triangle: made from the samples alone.
//!
//! A lattice vertex that is no corner of the square is the split vertex of exactly one diamond, so a number a
//! vertex is enough. With `step` the largest power of two that divides both coordinates, the diamond of a
//! vertex whose coordinates are both odd multiples of `step` is a square of half side `step` cut along a
//! diagonal; if one of them is an even multiple, it stands on its tip, and its hypotenuse runs along the axis
//! of the odd one.

use std::collections::HashMap;

use glam::DVec2;
use rayon::prelude::*;

use crate::rivals::Ground;

/// Rows made at once, so that no second copy of all errors is needed.
const BAND: i32 = 256;

/// Errors of all split vertices over the square that holds the data, metres.
///
/// The error of a vertex is what the surface moves there when the vertex comes in, or that of the worst of
/// its four children in the hierarchy: a nested maximum, as Brandstetter 2007, section 2.3.1, describes that
/// of Duchaineau et al. 1997; of the error at the middle of the hypotenuse, as in Brettell 2005, section 4.
/// Nested, so that refinement is monotonic. A maximum is no bound on how far samples lie off a triangle;
/// times the number of levels beneath it is one, and `Errors::bound` uses that.
#[derive(Debug)]
pub(crate) struct Errors {
    /// Side of the square, base samples; a power of two.
    side: i32,
    last: [i32; 2],
    /// Of the vertices that are samples, row by row.
    inside: Vec<f32>,
    /// Of the vertices beyond the data whose diamonds reach into it, none where 0.
    beyond: HashMap<[i32; 2], f32>,
}

/// Where a triangle lies and how wrong it can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bound {
    /// Box over base samples, clamped to the data.
    pub lo: [i32; 2],
    pub hi: [i32; 2],
    /// Heights of the samples over it and of the triangle, metres: a bound.
    pub range_m: [f32; 2],
    /// Nested error of its split vertex, metres; 0 for the finest triangles and for those beyond the data.
    pub error_m: f32,
}

impl Bound {
    /// False for triangles wholly beyond the data, which clamping leaves no area: one of their sides runs
    /// along an axis, so theirs is the box's.
    pub fn has_area(&self) -> bool {
        self.hi[0] > self.lo[0] && self.hi[1] > self.lo[1]
    }
}

/// Corners of a diamond.
struct Diamond {
    /// Ends of the hypotenuse.
    ends: [[i32; 2]; 2],
    /// The right angles.
    apexes: [[i32; 2]; 2],
}

impl Diamond {
    fn of(at: [i32; 2], step: i32) -> Self {
        let [x, y] = at;
        let odd = [0, 1].map(|a| at[a] / step % 2 != 0);
        let along_x = [[x - step, y], [x + step, y]];
        let along_y = [[x, y - step], [x, y + step]];
        match odd {
            [true, true] => {
                let rising = [[x - step, y - step], [x + step, y + step]];
                let falling = [[x + step, y - step], [x - step, y + step]];
                // Diagonals meet in the vertices of the coarser lattice whose coordinates add up to even.
                if ((x - step) / (2 * step) + (y - step) / (2 * step)) % 2 == 0 {
                    Self { ends: rising, apexes: falling }
                } else {
                    Self { ends: falling, apexes: rising }
                }
            }
            [true, false] => Self { ends: along_x, apexes: along_y },
            _ => Self { ends: along_y, apexes: along_x },
        }
    }

    /// What the surface moves, at most, when the vertex `at` comes in. Beyond the data's last sample corners
    /// stand on it, and the vertex need not lie on its hypotenuse any more.
    fn deviation(&self, ground: &Ground, at: [i32; 2], step: i32) -> f32 {
        let last = ground.last();
        let height = |p: [i32; 2]| f64::from(ground.height(p));
        let [a, b] = self.ends;
        let (height_a, height_b, middle) = (height(a), height(b), height(at));
        if at[0] + step <= last[0] && at[1] + step <= last[1] {
            return (middle - 0.5 * (height_a + height_b)).abs() as f32;
        }
        let place = |p: [i32; 2]| DVec2::new(p[0].min(last[0]).into(), p[1].min(last[1]).into());
        let (origin, vertex) = (place(a), place(at));
        let along = place(b) - origin;
        let length2 = along.length_squared();
        if length2 == 0.0 {
            return 0.0;
        }
        let hypotenuse = |p: DVec2| height_a + (p - origin).dot(along) / length2 * (height_b - height_a);
        let side = |p: DVec2| along.perp_dot(p - origin);
        let off = side(vertex);
        if off == 0.0 {
            return (middle - hypotenuse(vertex)).abs() as f32;
        }
        let [c, d] = self.apexes;
        let (near, far) = if side(place(c)) * off > 0.0 { (c, d) } else { (d, c) };
        let share = off / side(place(near));
        let foot = vertex - share * (place(near) - origin);
        let before = hypotenuse(foot) + share * (height(near) - height_a);
        // Both surfaces are flat between their edges, so the other place to look is where a new edge crosses
        // the hypotenuse.
        let cut = off / (off - side(place(far)));
        let crossing = vertex + cut * (place(far) - vertex);
        let after = middle + cut * (height(far) - middle);
        (middle - before).abs().max((after - hypotenuse(crossing)).abs()) as f32
    }
}

impl Errors {
    /// The errors of a terrain, from the finest vertices up: linear in samples.
    pub fn of(ground: &Ground) -> Self {
        let last = ground.last();
        let side = last[0].max(last[1]).max(1).unsigned_abs().next_power_of_two().cast_signed();
        let inside = vec![0.0; ground.heights.len()];
        let mut errors = Self { side, last, inside, beyond: HashMap::new() };
        let mut step = 1;
        while step < side {
            // Children of those on their tips are squares of half the step, theirs those of the same step.
            errors.make(ground, step, false);
            errors.make(ground, step, true);
            step *= 2;
        }
        errors
    }

    /// Side of the square that holds the data, base samples.
    pub fn side(&self) -> i32 {
        self.side
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let entry = size_of::<([i32; 2], f32)>() + 1;
        (size_of_val(&self.inside[..]) + self.beyond.capacity() * entry) as u64
    }

    /// Error of a split vertex, metres; 0 where its diamond lies wholly beyond the data.
    pub fn at(&self, at: [i32; 2]) -> f32 {
        match self.index(at) {
            Some(ix) => self.inside[ix],
            None => self.beyond.get(&at).copied().unwrap_or(0.0),
        }
    }

    fn index(&self, at: [i32; 2]) -> Option<usize> {
        let is_sample = (0..2).all(|a| 0 <= at[a] && at[a] <= self.last[a]);
        is_sample.then(|| at[1] as usize * (self.last[0] as usize + 1) + at[0] as usize)
    }

    /// Makes the errors of one kind of diamonds; those of their children are there.
    fn make(&mut self, ground: &Ground, step: i32, square: bool) {
        // Diamonds reach `step` to all sides; those that begin where the data ends have no area.
        let reach = self.last.map(|last| (last + step - 1).min(self.side));
        let (first, stride) = if square { (step, 2 * step) } else { (0, step) };
        if reach[1] < first {
            return;
        }
        let row = |k: i32| first + k * stride;
        let columns = |y: i32| {
            let first = if square || y / step % 2 == 0 { step } else { 0 };
            (first..=reach[0]).step_by(2 * step as usize)
        };
        let count = (reach[1] - first) / stride + 1;
        for from in (0..count).step_by(BAND as usize) {
            let to = from.saturating_add(BAND).min(count);
            let this = &*self;
            let of_row = |k: i32| {
                let y = row(k);
                columns(y).map(|x| this.nested(ground, [x, y], step, square)).collect::<Vec<f32>>()
            };
            let made: Vec<Vec<f32>> = (from..to).into_par_iter().map(of_row).collect();
            for (k, values) in (from..to).zip(made) {
                let y = row(k);
                for (x, value) in columns(y).zip(values) {
                    self.set([x, y], value);
                }
            }
        }
    }

    fn nested(&self, ground: &Ground, at: [i32; 2], step: i32, square: bool) -> f32 {
        let own = Diamond::of(at, step).deviation(ground, at, step);
        let ([x, y], half) = (at, step / 2);
        let children = match (square, step) {
            (true, _) => [[x - step, y], [x + step, y], [x, y - step], [x, y + step]],
            (false, 1) => return own,
            _ => [[x - half, y - half], [x + half, y - half], [x - half, y + half], [x + half, y + half]],
        };
        children.iter().fold(own, |worst, child| worst.max(self.at(*child)))
    }

    fn set(&mut self, at: [i32; 2], value: f32) {
        if let Some(ix) = self.index(at) {
            self.inside[ix] = value;
        } else if value > 0.0 {
            self.beyond.insert(at, value);
        }
    }

    /// What bounds the triangle of the given corners: the right angle, then the ends of the hypotenuse.
    pub(super) fn bound(&self, ground: &Ground, corners: [[i32; 2]; 3]) -> Bound {
        let clamped = corners.map(|p| [p[0].min(self.last[0]), p[1].min(self.last[1])]);
        let [a, b, c] = clamped;
        let lo = [a[0].min(b[0]).min(c[0]), a[1].min(b[1]).min(c[1])];
        let hi = [a[0].max(b[0]).max(c[0]), a[1].max(b[1]).max(c[1])];
        let mut bound = Bound { lo, hi, range_m: [0.0; 2], error_m: 0.0 };
        if !bound.has_area() {
            return bound;
        }
        let [_, left, right] = corners;
        let run = [0, 1].map(|a| (right[a] - left[a]).abs());
        let step = run[0].max(run[1]) / 2;
        let mut slack = 0.0;
        if step > 0 {
            bound.error_m = self.at(middle(left, right));
            // Each level of vertices still to come moves the surface by the nested error at most, so this
            // bounds it where the maximum alone does not. The factor is for rounding.
            let squares = u32::from(run[0] > 0 && run[1] > 0);
            let levels = 2 * step.ilog2() + 1 + squares;
            slack = bound.error_m * levels as f32 * 1.000_001;
        }
        let heights = clamped.map(|p| ground.height(p));
        let low = heights.iter().copied().fold(f32::INFINITY, f32::min);
        let high = heights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let around = ground.range_over(lo, hi);
        // Blocks of samples bound coarse triangles better, corners the fine ones.
        bound.range_m = [(low - slack).next_down().max(around[0]), (high + slack).next_up().min(around[1])];
        bound
    }
}

/// Middle of a hypotenuse.
pub(super) fn middle(left: [i32; 2], right: [i32; 2]) -> [i32; 2] {
    [0, 1].map(|a| left[a] + (right[a] - left[a]) / 2)
}
