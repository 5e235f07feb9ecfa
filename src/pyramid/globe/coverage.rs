//! How far a place in a grid is from where the grid has nothing, and how much it counts there.

use crate::heights::smoothstep;
use crate::pyramid::VOID;

/// Distances, in cells of a grid, to its open borders and its voids, as the larger of both axes.
#[derive(Debug)]
pub(super) struct Coverage {
    /// Width of the blend in cells; 0 for none.
    blend_cells: f64,
    /// What lies around: `[west, same, east]` in `[south, same, north]`, true where data goes on.
    around: [[bool; 3]; 3],
    /// For every sample the cells to the nearest one that touches a void, capped; `None` without voids.
    to_void: Option<Vec<u8>>,
}

impl Coverage {
    /// A grid without neighbours.
    pub(super) fn alone(periodic: bool, poles: [bool; 2]) -> Self {
        let row = |whole: bool| [whole; 3];
        let mut around = [row(poles[0]), [periodic, true, periodic], row(poles[1])];
        for (row, pole) in [(0, poles[0]), (2, poles[1])] {
            // Beyond a pole there is nothing to be missing, not even in the corners.
            around[row] = [pole; 3];
        }
        Self { blend_cells: 0.0, around, to_void: None }
    }

    /// Says that the data goes on at column and row `place`, each 0 to 2 with 1 for this grid.
    pub(super) fn join(&mut self, place: [usize; 2]) {
        self.around[place[1]][place[0]] = true;
    }

    /// Sets the width of the blend and measures the distances to voids.
    pub(super) fn blend_over(&mut self, cells: f64, samples: &[f32], columns: usize, periodic: bool) {
        self.blend_cells = cells;
        self.to_void =
            (cells > 0.0 && samples.contains(&VOID)).then(|| distances(samples, columns, periodic));
    }

    /// Weight of this grid, 0 at open borders to 1 inside, at `at` in `cell` of a grid whose last node
    /// is `last`.
    pub(super) fn weight(&self, cell: [usize; 2], at: [f64; 2], last: [usize; 2]) -> f64 {
        if self.blend_cells <= 0.0 {
            return 1.0;
        }
        let low = [0, 1].map(|a| cell[a] as f64 + at[a]);
        let high = [0, 1].map(|a| last[a] as f64 - low[a]);
        let mut nearest = f64::INFINITY;
        if low[0].min(low[1]).min(high[0]).min(high[1]) < self.blend_cells {
            for (row, y) in self.around.iter().zip([low[1], 0.0, high[1]]) {
                for (_, x) in row.iter().zip([low[0], 0.0, high[0]]).filter(|(there, _)| !**there) {
                    nearest = nearest.min(x.max(y));
                }
            }
        }
        if let Some(to_void) = &self.to_void {
            let node = |i: usize, j: usize| {
                let index = (cell[1] + j) * (last[0] + 1) + cell[0] + i;
                to_void.get(index).copied().map_or(0.0, f64::from)
            };
            let south = node(0, 0) + (node(1, 0) - node(0, 0)) * at[0];
            let north = node(0, 1) + (node(1, 1) - node(0, 1)) * at[0];
            nearest = nearest.min(south + (north - south) * at[1]);
        }
        // Exactly 1 inside, so that coarser grids need not be looked at.
        if nearest >= self.blend_cells { 1.0 } else { smoothstep(0.0, self.blend_cells, nearest) }
    }
}

/// Cells from every sample to the nearest one that is void or has a void among its eight neighbours.
///
/// Cells with a void corner give no height at all, so the weight has to be 0 on their whole outline:
/// that outline is what distances are measured from.
fn distances(samples: &[f32], columns: usize, periodic: bool) -> Vec<u8> {
    let rows = samples.len() / columns.max(1);
    let mut far: Vec<u8> = samples.iter().map(|&h| if h == VOID { 0 } else { u8::MAX }).collect();
    // The repeated column is no neighbour of its own, so a step around the circle skips it.
    let (first, past) = (0, columns.saturating_sub(1));
    let beside = |i: usize, east: bool| match (east, periodic) {
        (true, true) if i + 1 >= past => Some(if i == past { 1.min(past) } else { first }),
        (false, true) if i == first => past.checked_sub(1),
        (true, _) => Some(i + 1).filter(|&i| i < columns),
        (false, _) => i.checked_sub(1),
    };
    // Two sweeps there and back: the second brings distances over the seam to where they belong.
    for sweep in 0..4 {
        let back = sweep % 2 == 1;
        for step in 0..rows {
            let j = if back { rows - 1 - step } else { step };
            let behind = if back { Some(j + 1).filter(|&j| j < rows) } else { j.checked_sub(1) };
            for step in 0..columns {
                let i = if back { columns - 1 - step } else { step };
                let sides = [beside(i, false), Some(i), beside(i, true)];
                let mut least = u8::MAX;
                for i in sides.into_iter().flatten() {
                    least = least.min(behind.map_or(u8::MAX, |j| far[j * columns + i]));
                }
                let last = if back { sides[2] } else { sides[0] };
                least = least.min(last.map_or(u8::MAX, |i| far[j * columns + i]));
                let here = &mut far[j * columns + i];
                *here = (*here).min(least.saturating_add(1));
            }
        }
    }
    for d in &mut far {
        *d = d.saturating_sub(1);
    }
    far
}

#[cfg(test)]
mod tests {
    use super::{VOID, distances};

    #[test]
    fn distances_go_around_the_seam() {
        for (column, periodic) in [(0, true), (1, true), (6, true), (1, false), (6, false)] {
            let (columns, rows) = (9_usize, 7_usize);
            let mut samples = vec![1.0; columns * rows];
            samples[2 * columns + column] = VOID;
            if periodic && column == 0 {
                samples[2 * columns + 8] = VOID;
            }
            let far = distances(&samples, columns, periodic);
            for j in 0..rows {
                for i in 0..columns {
                    let mut x = i.abs_diff(column);
                    if periodic {
                        x = (x % 8).min(8 - x % 8);
                    }
                    let want = x.max(j.abs_diff(2)).saturating_sub(1);
                    assert_eq!(usize::from(far[j * columns + i]), want, "{column} {periodic}: {i} {j}");
                }
            }
        }
    }
}
