//! Heights times a factor.

use std::sync::Arc;

use super::{BlockDeviation, SampleSource, Streaming, VOID};
use crate::clipmap::{Lattice, Rect};

/// Another source's heights times a factor: vertical exaggeration. 0 flattens, below 0 turns mountains
/// into pits.
pub struct Scaled {
    /// The heights.
    pub source: Arc<dyn SampleSource>,
    /// The factor.
    pub factor: f32,
}

impl Scaled {
    fn scale(&self, heights_m: &mut [f32]) {
        for h in heights_m.iter_mut().filter(|h| **h != VOID) {
            // Adding 0 turns a negative zero into a plain one: equal heights have equal bits.
            *h = *h * self.factor + 0.0;
        }
    }
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
        self.scale(&mut out[from..]);
    }

    fn read_now(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        let from = out.len();
        self.source.read_now(level, rect, out);
        self.scale(&mut out[from..]);
    }

    fn streaming(&self) -> Option<&dyn Streaming> {
        self.source.streaming()
    }

    fn relief_near(&self, base: [i32; 2]) -> Option<[f32; 2]> {
        let [low, high] = self.source.relief_near(base)?.map(|h| h * self.factor + 0.0);
        Some([low.min(high), low.max(high)])
    }

    fn has_deviations(&self) -> bool {
        self.source.has_deviations()
    }

    fn read_deviations(&self, level: u32, blocks: Rect, out: &mut Vec<BlockDeviation>) -> bool {
        let from = out.len();
        let known = self.source.read_deviations(level, blocks, out);
        for block in &mut out[from..] {
            *block = block.scaled(self.factor);
        }
        known
    }

    fn height_range(&self) -> Option<[f32; 2]> {
        let [low, high] = self.source.height_range()?.map(|h| h * self.factor + 0.0);
        Some([low.min(high), low.max(high)])
    }
}
