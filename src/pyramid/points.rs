//! Positions as samples: their heights are what colours and ranges go by.

use std::sync::Arc;

use super::{SampleSource, VOID};
use crate::clipmap::{Lattice, Rect};
use crate::surface::SampledSurface;

/// The z of a grid of positions.
#[derive(Clone, Debug)]
pub struct PointHeights {
    surface: Arc<SampledSurface>,
    range: Option<[f32; 2]>,
}

impl PointHeights {
    /// Wraps a grid of positions.
    #[must_use]
    pub fn new(surface: Arc<SampledSurface>) -> Self {
        let range = surface.grid().bounds_m().map(|[low, high]| [low[2] as f32, high[2] as f32]);
        Self { surface, range }
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

    fn height_range(&self) -> Option<[f32; 2]> {
        self.range
    }
}
