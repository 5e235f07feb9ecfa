//! The whole pyramid in memory.

use super::prefilter::halve;
use super::{BlockDeviation, Deviations, Prefilter, SampleSource, VOID};
use crate::clipmap::{Lattice, Rect};
use crate::heights::HeightGrid;

/// All levels of a height grid, finest first.
#[derive(Debug)]
pub struct MemoryPyramid {
    levels: Vec<Level>,
    range: Option<[f32; 2]>,
    has_voids: bool,
    step_m: Option<f32>,
    /// Measured when first asked for: uniform factors need none.
    deviations: std::sync::OnceLock<Deviations>,
}

#[derive(Debug)]
struct Level {
    size: [usize; 2],
    samples: Vec<f32>,
}

impl MemoryPyramid {
    /// Builds every level the grid supports; takes about 4/3 of the grid's own memory.
    #[must_use]
    pub fn new(grid: &HeightGrid, prefilter: Prefilter) -> Self {
        let size = [grid.width, grid.height];
        let mut samples = grid.heights_m.clone();
        if let Some(valid) = &grid.valid {
            for (sample, valid) in samples.iter_mut().zip(valid) {
                if !valid {
                    *sample = VOID;
                }
            }
        }
        Self::from_samples(samples, size, prefilter)
    }

    /// As [`MemoryPyramid::new`], from samples with [`VOID`] where there is none.
    #[must_use]
    pub fn from_samples(samples: Vec<f32>, size: [usize; 2], prefilter: Prefilter) -> Self {
        let has_voids = samples.contains(&VOID);
        // Of what is left: a sample that happens to be the mark for voids is one.
        let valid = samples.iter().filter(|h| **h != VOID).map(|h| [*h; 2]);
        let range = valid.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        // A low-pass makes fractions; and whole metres are looked for in the values, whatever the type
        // of the source says.
        let step_m = super::whole_metres(&samples).filter(|_| prefilter == Prefilter::Subsample);
        let mut levels = vec![Level { size, samples }];
        let most = lattice_of(size).coarsest_level();
        for l in 0..most as usize {
            let (samples, size) = halve(&levels[l].samples, levels[l].size, prefilter);
            levels.push(Level { size, samples });
        }
        Self { levels, range, has_voids, step_m, deviations: std::sync::OnceLock::new() }
    }
}

fn lattice_of(size: [usize; 2]) -> Lattice {
    // Readers refuse grids with more than 2^31 samples on a side.
    Lattice { last: size.map(|s| i32::try_from(s - 1).unwrap_or(i32::MAX)) }
}

impl SampleSource for MemoryPyramid {
    fn lattice(&self) -> Lattice {
        lattice_of(self.levels[0].size)
    }

    fn has_voids(&self) -> bool {
        self.has_voids
    }

    fn read(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        if rect.is_empty() {
            return;
        }
        let level = &self.levels[level as usize];
        let at = |v: i32| usize::try_from(v).unwrap_or_default();
        for y in at(rect.lo[1])..=at(rect.hi[1]) {
            let row = y * level.size[0];
            out.extend_from_slice(&level.samples[row + at(rect.lo[0])..=row + at(rect.hi[0])]);
        }
    }

    fn height_range(&self) -> Option<[f32; 2]> {
        self.range
    }

    fn has_deviations(&self) -> bool {
        true
    }

    fn read_deviations(&self, level: u32, blocks: Rect, out: &mut Vec<BlockDeviation>) -> bool {
        self.deviations.get_or_init(|| Deviations::of(self)).read(level, blocks, out);
        true
    }

    fn step_m(&self) -> Option<f32> {
        self.step_m
    }
}

#[cfg(test)]
mod tests {
    use super::{HeightGrid, MemoryPyramid, Prefilter, SampleSource};

    #[test]
    fn only_whole_metres_travel_as_whole_metres() {
        let step = |heights: [f32; 4], prefilter| {
            let grid = HeightGrid::new(2, 2, heights.to_vec()).unwrap();
            MemoryPyramid::new(&grid, prefilter).step_m()
        };
        assert_eq!(step([1.0, f32::NAN, -32_767.0, 32_767.0], Prefilter::Subsample), Some(1.0));
        assert_eq!(step([1.0, 2.0, 3.0, 4.0], Prefilter::LowPass), None);
        assert_eq!(step([1.0, 2.5, 3.0, 4.0], Prefilter::Subsample), None);
        assert_eq!(step([1.0, 2.0, 3.0, 32_768.0], Prefilter::Subsample), None);
        assert_eq!(step([1.0, 2.0, 3.0, -32_768.0], Prefilter::Subsample), None);
    }
}
