//! Positions as samples: their heights are what colours and ranges go by.

use std::sync::{Arc, OnceLock};

use super::{BlockDeviation, Deviations, MemoryPyramid, Prefilter, SampleSource, VOID};
use crate::clipmap::{Lattice, Rect};
use crate::surface::SampledSurface;

/// The z of a grid of positions.
#[derive(Clone, Debug)]
pub struct PointHeights {
    surface: Arc<SampledSurface>,
    bounds_m: Option<[[f64; 3]; 2]>,
    deviations: OnceLock<Deviations>,
}

impl PointHeights {
    /// Wraps a grid of positions.
    #[must_use]
    pub fn new(surface: Arc<SampledSurface>) -> Self {
        let bounds_m = surface.grid().bounds_m();
        Self { surface, bounds_m, deviations: OnceLock::new() }
    }

    /// Lowest and highest x, y and z of all positions, world metres; `None` when all are void.
    #[must_use]
    pub fn bounds_m(&self) -> Option<[[f64; 3]; 2]> {
        self.bounds_m
    }

    /// Of each coordinate as if it were a height, then of the position: the root of the sum of their squares.
    /// Coordinates are measured from their mean, as f32; what that rounds is added.
    fn measure(&self) -> Deviations {
        let grid = self.surface.grid();
        let valid = |k: usize| grid.valid.as_ref().is_none_or(|v| v[k]);
        let mut rounded_m = 0.0_f32;
        let axes = [0, 1, 2].map(|a| {
            let mean = grid.xyz_m.iter().map(|p| p[a]).sum::<f64>() / grid.xyz_m.len() as f64;
            let samples: Vec<f32> = (grid.xyz_m.iter().enumerate())
                .map(|(k, p)| if valid(k) { (p[a] - mean) as f32 } else { VOID })
                .collect();
            let most = samples.iter().filter(|v| **v != VOID).fold(0.0_f32, |m, v| m.max(v.abs()));
            // Half a unit in the last place, of the truth and of what is drawn, on three axes.
            rounded_m = rounded_m.max(4.0 * most * f32::EPSILON);
            let pyramid =
                MemoryPyramid::from_samples(samples, [grid.width, grid.height], Prefilter::Subsample);
            Deviations::of(&pyramid)
        });
        Deviations::of_positions(&axes, rounded_m)
    }

    /// Position of a node, metres; `None` where it is void.
    #[must_use]
    pub fn position(&self, level: u32, node: [i32; 2]) -> Option<[f64; 3]> {
        let grid = self.surface.grid();
        let base = self.lattice().base(level, node).map(|v| usize::try_from(v).unwrap_or_default());
        let at = base[1] * grid.width + base[0];
        grid.valid.as_ref().is_none_or(|v| v[at]).then(|| grid.xyz_m[at])
    }
}

impl SampleSource for PointHeights {
    fn lattice(&self) -> Lattice {
        let grid = self.surface.grid();
        Lattice { last: [grid.width, grid.height].map(|s| i32::try_from(s - 1).unwrap_or(i32::MAX)) }
    }

    fn has_voids(&self) -> bool {
        self.surface.grid().void_count() > 0
    }

    fn read(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        for y in rect.lo[1]..=rect.hi[1] {
            out.extend(
                (rect.lo[0]..=rect.hi[0]).map(|x| self.position(level, [x, y]).map_or(VOID, |p| p[2] as f32)),
            );
        }
    }

    fn has_deviations(&self) -> bool {
        true
    }

    fn read_deviations(&self, level: u32, blocks: Rect, out: &mut Vec<BlockDeviation>) -> bool {
        self.deviations.get_or_init(|| self.measure()).read(level, blocks, out);
        true
    }

    fn height_range(&self) -> Option<[f32; 2]> {
        self.bounds_m.map(|[low, high]| [low[2] as f32, high[2] as f32])
    }
}
