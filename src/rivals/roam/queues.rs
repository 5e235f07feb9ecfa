//! The two queues that take last frame's triangulation to this frame's: leaves to split, the worst first, and
//! diamonds to merge, the best first (Duchaineau et al. 1997; Brettell 2005, section 2.1.1).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::errors::Bound;
use super::triangles::{NONE, OUT_OF_VIEW, Triangulation};

/// A diamond is merged when its error is at most this part of the threshold above which leaves are split. The
/// threshold itself holds for every leaf; the gap is there so that a camera that trembles does not make and
/// drop the same vertices by turns. The paper needs none, since it aims at a number of triangles.
const MERGE_BELOW: f32 = 0.75;
/// Fewest triangles worth a thread.
const LEAST_SHARE: usize = 2_048;

/// Ascends with priority (0 or more), among equals with the triangle's number.
fn key(priority: f32, t: u32) -> u64 {
    // Floats that are not negative sort as their bits do.
    u64::from(priority.max(0.0).to_bits()) << 32 | u64::from(t)
}

fn triangle_of(key: u64) -> u32 {
    (key & u64::from(u32::MAX)) as u32
}

impl Triangulation {
    /// Splits and merges until no leaf's priority is above `threshold` and no diamond is left to merge; true
    /// when `most` leaves were too few for that. `view` gives the priority of a triangle in this frame.
    ///
    /// Splits come first: what they need beyond their own diamonds is then still there, and what is merged
    /// afterwards nothing needs. A diamond's error is that of both of its triangles, so a merge never makes a
    /// leaf that would have to be split: each queue runs dry once and the work ends.
    pub fn refine(&mut self, threshold: f32, most: usize, view: &(impl Fn(&Bound) -> f32 + Sync)) -> bool {
        let leaves = self.triangles.par_iter_mut().with_min_len(LEAST_SHARE).filter(|t| t.is_leaf());
        leaves.for_each(|t| t.priority = view(&t.bound));
        let full = self.split_all(threshold, most, view);
        self.merge_all(threshold * MERGE_BELOW, view);
        // Merges may have made room.
        full && self.split_all(threshold, most, view)
    }

    fn split_all(&mut self, threshold: f32, most: usize, view: &(impl Fn(&Bound) -> f32 + Sync)) -> bool {
        let leaves = (0_u32..).zip(&self.triangles).filter(|(_, t)| t.is_leaf() && t.priority > threshold);
        let mut queue: BinaryHeap<u64> = leaves.map(|(k, t)| key(t.priority, k)).collect();
        while let Some(next) = queue.pop() {
            let t = triangle_of(next);
            // Forced splits may have been quicker.
            if !self.at(t).is_leaf() {
                continue;
            }
            if self.leaves >= most {
                return true;
            }
            self.fresh.clear();
            self.split(t);
            let fresh = std::mem::take(&mut self.fresh);
            for &made in &fresh {
                if self.at(made).is_leaf() {
                    let priority = view(&self.at(made).bound);
                    self.at_mut(made).priority = priority;
                    if priority > threshold {
                        queue.push(key(priority, made));
                    }
                }
            }
            self.fresh = fresh;
        }
        false
    }

    fn merge_all(&mut self, most_px: f32, view: &(impl Fn(&Bound) -> f32 + Sync)) {
        let this = &*self;
        let count = this.triangles.len() as u32;
        let of_diamond = |t: u32| {
            // Once for both halves.
            let [first, _] = this.diamond(t)?;
            if first == t { this.merge_key(t, most_px, view).map(Reverse) } else { None }
        };
        let all = (0..count).into_par_iter().with_min_len(LEAST_SHARE).filter_map(of_diamond);
        let mut queue: BinaryHeap<Reverse<u64>> = BinaryHeap::from(all.collect::<Vec<_>>());
        while let Some(Reverse(next)) = queue.pop() {
            let t = triangle_of(next);
            // Both halves may have been told by their children; triangles of merged parents are gone.
            let Some(halves) = self.diamond(t) else { continue };
            self.merge(t);
            for half in halves.into_iter().filter(|half| *half != NONE) {
                let priority = view(&self.at(half).bound);
                self.at_mut(half).priority = priority;
                let parent = self.at(half).parent;
                if parent != NONE {
                    queue.extend(self.merge_key(parent, most_px, view).map(Reverse));
                }
            }
        }
    }

    /// Place in the queue of the diamond that `t` is half of, if it can and should be merged.
    fn merge_key(&self, t: u32, most_px: f32, view: &impl Fn(&Bound) -> f32) -> Option<u64> {
        let halves = self.diamond(t)?;
        let there = halves.iter().filter(|half| **half != NONE);
        let priority = there.map(|half| view(&self.at(*half).bound)).fold(OUT_OF_VIEW, f32::max);
        // What is out of view costs nothing to merge, whatever the threshold.
        (priority.max(0.0) <= most_px).then(|| key(priority, t))
    }
}
