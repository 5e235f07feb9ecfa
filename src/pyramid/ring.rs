//! One chart of a grid that closes on itself.

use std::sync::Arc;

use super::{SampleSource, VOID};
use crate::clipmap::{Lattice, Rect};
use crate::heights::HeightGrid;

/// Samples of a grid whose first column follows its last, first row its last, or both.
#[derive(Debug)]
pub struct Ring {
    samples: Vec<f32>,
    size: [usize; 2],
    range: Option<[f32; 2]>,
    step_m: Option<f32>,
}

impl Ring {
    /// Takes a grid's samples as they are; voids stay void.
    #[must_use]
    pub fn new(grid: &HeightGrid) -> Self {
        let mut samples = grid.heights_m.clone();
        if let Some(valid) = &grid.valid {
            for (sample, valid) in samples.iter_mut().zip(valid) {
                if !valid {
                    *sample = VOID;
                }
            }
        }
        let step_m = super::whole_metres(&samples);
        let range = grid.min_max_mean().map(|(low, high, _)| [low, high]);
        Self { samples, size: [grid.width, grid.height], range, step_m }
    }
}

/// A rectangle of a [`Ring`] as a chart's source; reads one node beyond its borders, around the ring.
#[derive(Clone, Debug)]
pub struct RingChart {
    /// The whole grid.
    pub ring: Arc<Ring>,
    /// First base index of the chart in it.
    pub offset: [i32; 2],
    /// The chart's lattice.
    pub lattice: Lattice,
}

impl SampleSource for RingChart {
    fn lattice(&self) -> Lattice {
        self.lattice
    }

    fn has_voids(&self) -> bool {
        self.ring.samples.contains(&VOID)
    }

    fn read(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        let place = |axis: usize, node: i32| {
            let base = self.lattice.base_beyond(level, axis, node);
            let size = i64::try_from(self.ring.size[axis]).unwrap_or(i64::MAX);
            let wrapped = (i64::from(self.offset[axis]) + base).rem_euclid(size);
            usize::try_from(wrapped).unwrap_or_default()
        };
        for y in rect.lo[1]..=rect.hi[1] {
            let row = place(1, y) * self.ring.size[0];
            out.extend((rect.lo[0]..=rect.hi[0]).map(|x| self.ring.samples[row + place(0, x)]));
        }
    }

    fn height_range(&self) -> Option<[f32; 2]> {
        self.ring.range
    }

    fn step_m(&self) -> Option<f32> {
        self.ring.step_m
    }
}
