//! Heights times a factor.

use std::sync::Arc;

use super::{SampleSource, VOID};
use crate::clipmap::{Lattice, Rect};

/// Another source's heights times a factor: vertical exaggeration. 0 flattens, below 0 turns mountains
/// into pits.
pub struct Scaled {
    /// The heights.
    pub source: Arc<dyn SampleSource>,
    /// The factor.
    pub factor: f32,
}

impl SampleSource for Scaled {
    fn lattice(&self) -> Lattice {
        self.source.lattice()
    }

    fn has_voids(&self) -> bool {
        self.source.has_voids()
    }

    fn read(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        let from = out.len();
        self.source.read(level, rect, out);
        for h in out[from..].iter_mut().filter(|h| **h != VOID) {
            // Adding 0 turns a negative zero into a plain one: equal heights have equal bits.
            *h = *h * self.factor + 0.0;
        }
    }

    fn height_range(&self) -> Option<[f32; 2]> {
        let [low, high] = self.source.height_range()?.map(|h| h * self.factor + 0.0);
        Some([low.min(high), low.max(high)])
    }
}
