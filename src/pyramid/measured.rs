//! Samples made when they are read, with their deviations measured once.

use std::sync::{Arc, OnceLock};

use super::{BlockDeviation, Deviations, SampleSource, Streaming};
use crate::clipmap::{Lattice, Rect};

/// Most samples of a chart that are measured: some seconds on a few cores, 256 MB while it lasts.
const MOST_SAMPLES: u64 = 1 << 26;

/// Another source, with deviations.
pub struct Measured {
    source: Arc<dyn SampleSource>,
    deviations: OnceLock<Deviations>,
}

impl Measured {
    /// Nothing is measured before it is asked for.
    #[must_use]
    pub fn new(source: Arc<dyn SampleSource>) -> Self {
        Self { source, deviations: OnceLock::new() }
    }
}

impl SampleSource for Measured {
    fn lattice(&self) -> Lattice {
        self.source.lattice()
    }

    fn has_voids(&self) -> bool {
        self.source.has_voids()
    }

    fn read(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        self.source.read(level, rect, out);
    }

    fn height_range(&self) -> Option<[f32; 2]> {
        self.source.height_range()
    }

    fn step_m(&self) -> Option<f32> {
        self.source.step_m()
    }

    fn read_now(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        self.source.read_now(level, rect, out);
    }

    fn streaming(&self) -> Option<&dyn Streaming> {
        self.source.streaming()
    }

    fn relief_near(&self, base: [i32; 2]) -> Option<[f32; 2]> {
        self.source.relief_near(base)
    }

    fn has_deviations(&self) -> bool {
        self.lattice().domain().count() <= MOST_SAMPLES
    }

    fn read_deviations(&self, level: u32, blocks: Rect, out: &mut Vec<BlockDeviation>) -> bool {
        if !self.has_deviations() {
            return false;
        }
        self.deviations.get_or_init(|| Deviations::of(self.source.as_ref())).read(level, blocks, out);
        true
    }

    fn sample(&self, level: u32, index: [i32; 2]) -> f32 {
        self.source.sample(level, index)
    }
}
