//! Refill strips: the samples that a shift makes stale.

use super::{Rect, Windows};

/// A rectangle of samples one level must load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strip {
    /// Level that lacks the samples.
    pub level: u32,
    /// Which samples, in that level's lattice; never empty.
    pub rect: Rect,
}

/// What must be sent to bring the windows from one place to another.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Refill {
    /// Strips, at most two a level, disjoint.
    pub strips: Vec<Strip>,
    /// Levels whose window moved (or that are new).
    pub shifted: Vec<u32>,
}

impl Refill {
    /// Number of samples in all strips.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.strips.iter().map(|s| s.rect.count()).sum()
    }
}

/// The strips that lead from `old` (nothing loaded when `None`) to `new`.
///
/// Both must have the same shape and lattice.
#[must_use]
pub fn refill_strips(old: Option<&Windows>, new: &Windows) -> Refill {
    let held = |level| old.filter(|o| !(o.sleeps && level < o.finest)).map(|o| o.window(level));
    refill_from(held, new)
}

/// The strips that lead to `new` from the windows each level last held; `None` where it holds nothing.
#[must_use]
pub fn refill_from(held: impl Fn(u32) -> Option<Rect>, new: &Windows) -> Refill {
    let mut refill = Refill::default();
    for level in 0..new.shape.levels() {
        let before = held(level);
        if before == Some(new.window(level)) || (new.sleeps && level < new.finest) {
            continue;
        }
        refill.shifted.push(level);
        refill.strips.extend(stale(before, new, level).into_iter().map(|rect| Strip { level, rect }));
    }
    refill
}

/// What a level lacks of its window when it holds the samples of another one.
#[must_use]
pub fn stale(before: Option<Rect>, new: &Windows, level: u32) -> Vec<Rect> {
    let now = new.held(level);
    let kept = before.map_or(Rect { lo: [0, 0], hi: [-1, -1] }, |b| now.intersect(b));
    difference(now, kept)
}

/// The least samples a shift by `(dx, dy)` can send for one level of `n` x `n` samples:
/// `n (|dx| + |dy|) - |dx| |dy|`, with shifts beyond the window counted as the window.
#[must_use]
pub fn height_bound(n: u32, dx: i32, dy: i32) -> u64 {
    let n = u64::from(n);
    let (dx, dy) = (u64::from(dx.unsigned_abs()).min(n), u64::from(dy.unsigned_abs()).min(n));
    n * (dx + dy) - dx * dy
}

/// `a` without `b`, where `b` is a corner, side or whole of `a`: at most two disjoint rectangles.
pub(crate) fn difference(a: Rect, b: Rect) -> Vec<Rect> {
    if a.is_empty() {
        return Vec::new();
    }
    if b.is_empty() {
        return vec![a];
    }
    let mut out = Vec::with_capacity(2);
    let mut push = |lo: [i32; 2], hi: [i32; 2]| {
        let rect = Rect { lo, hi };
        if !rect.is_empty() {
            out.push(rect);
        }
    };
    // Full-width rows below and above what is kept, then its missing columns.
    push(a.lo, [a.hi[0], b.lo[1] - 1]);
    push([a.lo[0], b.hi[1] + 1], a.hi);
    push([a.lo[0], b.lo[1]], [b.lo[0] - 1, b.hi[1]]);
    push([b.hi[0] + 1, b.lo[1]], [a.hi[0], b.hi[1]]);
    out
}
