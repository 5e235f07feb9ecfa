//! A grid of positions: terrain that no height over a plane can describe.

use super::alloc;
use super::grid::MOST_M;
use super::{HeightError, HeightGrid};

/// Most nodes of a position grid, 8193 x 8193; they take 24 bytes each (1.5 GiB), checked before
/// memory is taken.
pub(crate) const MAX_NODES: u64 = 8193 * 8193;

/// A grid of world positions in metres, one for each node.
///
/// Row-major, row 0 = SOUTH (or first), column 0 = WEST (or first): `index = row * width + column`.
#[derive(Clone, Debug, PartialEq)]
pub struct PositionGrid {
    /// Columns, at least 2.
    pub width: usize,
    /// Rows, at least 2.
    pub height: usize,
    /// `width * height` positions x, y, z in metres, finite everywhere; void nodes hold 0, 0, 0.
    pub xyz_m: Vec<[f64; 3]>,
    /// Which nodes carry data, same length and order; `None` when all do.
    pub valid: Option<Vec<bool>>,
}

impl PositionGrid {
    /// A grid from positions in metres, row 0 first.
    ///
    /// Nodes with a coordinate that is not finite become void. Errors: `TooSmall`, `TooLarge` over
    /// 8193 x 8193 nodes, `PositionCount`, `FarPosition` for a coordinate over 1e12 m.
    pub fn new(width: usize, height: usize, xyz_m: Vec<[f64; 3]>) -> Result<Self, HeightError> {
        Self::checked("positions", width, height, xyz_m)
    }

    /// [`Self::new`] with the name of a file or recipe for its messages.
    pub(crate) fn checked(
        subject: &str,
        width: usize,
        height: usize,
        mut xyz_m: Vec<[f64; 3]>,
    ) -> Result<Self, HeightError> {
        let expected = alloc::sample_count(subject, width as u64, height as u64, MAX_NODES)?;
        if xyz_m.len() != expected {
            return Err(HeightError::PositionCount { width, height, expected, got: xyz_m.len() });
        }
        let finite = |p: &[f64; 3]| p.iter().all(|c| c.is_finite());
        let mut valid = None;
        if !xyz_m.iter().all(finite) {
            valid = Some(xyz_m.iter().map(finite).collect());
            xyz_m.iter_mut().filter(|p| !finite(p)).for_each(|p| *p = [0.0; 3]);
        }
        // Their squares and cross products must stay finite, and an undeclared void must not pass.
        for (i, p) in xyz_m.iter().enumerate() {
            if let Some(&value_m) = p.iter().find(|c| c.abs() > MOST_M) {
                return Err(HeightError::FarPosition {
                    subject: subject.to_owned(),
                    column: i % width,
                    row: i / width,
                    value_m,
                });
            }
        }
        Ok(Self { width, height, xyz_m, valid })
    }

    /// A grid from three rasters of equal size that hold x, y and z in metres as if they were heights.
    ///
    /// A node is void where any of the three is. The places of the rasters do not matter. Errors:
    /// `UnequalGrids`, and those of [`Self::new`].
    pub fn from_grids(x: &HeightGrid, y: &HeightGrid, z: &HeightGrid) -> Result<Self, HeightError> {
        let sizes = [x, y, z].map(|g| [g.width, g.height]);
        if sizes[1] != sizes[0] || sizes[2] != sizes[0] {
            return Err(HeightError::UnequalGrids { x: sizes[0], y: sizes[1], z: sizes[2] });
        }
        let count = alloc::sample_count("positions", x.width as u64, x.height as u64, MAX_NODES)?;
        let mut xyz_m: Vec<[f64; 3]> = alloc::zeroed("positions", count)?;
        for (k, grid) in [x, y, z].into_iter().enumerate() {
            if grid.heights_m.len() != count {
                let (width, height, got) = (grid.width, grid.height, grid.heights_m.len());
                return Err(HeightError::PositionCount { width, height, expected: count, got });
            }
            for (i, (node, &h)) in xyz_m.iter_mut().zip(&grid.heights_m).enumerate() {
                let valid = grid.valid.as_ref().is_none_or(|v| v.get(i) == Some(&true));
                node[k] = if valid { f64::from(h) } else { f64::NAN };
            }
        }
        Self::new(x.width, x.height, xyz_m)
    }

    /// Number of void nodes.
    #[must_use]
    pub fn void_count(&self) -> u64 {
        self.valid.as_ref().map_or(0, |v| v.iter().filter(|&&ok| !ok).count() as u64)
    }

    /// Lowest and highest x, y and z in metres of the valid nodes; `None` if all are void.
    #[must_use]
    pub fn bounds_m(&self) -> Option<[[f64; 3]; 2]> {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for (i, p) in self.xyz_m.iter().enumerate() {
            if self.valid.as_ref().is_none_or(|v| v.get(i) == Some(&true)) {
                bounds[0] = [0, 1, 2].map(|k: usize| bounds[0][k].min(p[k]));
                bounds[1] = [0, 1, 2].map(|k: usize| bounds[1][k].max(p[k]));
            }
        }
        (bounds[0][0] <= bounds[1][0]).then_some(bounds)
    }
}

#[cfg(test)]
mod tests {
    use super::{HeightError, HeightGrid, PositionGrid};

    #[test]
    fn nodes_that_are_not_finite_become_void() {
        let p = |x| [x, 2.0, 3.0];
        let grid = PositionGrid::new(2, 2, vec![p(0.0), p(f64::NAN), p(f64::INFINITY), p(1.0)]).unwrap();
        assert_eq!(grid.valid, Some(vec![true, false, false, true]));
        assert_eq!(grid.xyz_m[1], [0.0; 3]);
        assert_eq!(grid.void_count(), 2);
        assert_eq!(grid.bounds_m(), Some([[0.0, 2.0, 3.0], [1.0, 2.0, 3.0]]));
        assert_eq!(PositionGrid::new(2, 2, vec![p(f64::NAN); 4]).unwrap().bounds_m(), None);
    }

    #[test]
    fn bad_input_is_refused() {
        let new = |w, h, n| PositionGrid::new(w, h, vec![[0.0; 3]; n]).unwrap_err();
        assert!(matches!(new(1, 9, 9), HeightError::TooSmall { .. }));
        assert!(matches!(new(3, 3, 8), HeightError::PositionCount { expected: 9, got: 8, .. }));
        assert!(matches!(new(1 << 20, 1 << 20, 1), HeightError::TooLarge { .. }));
        let mut far = vec![[0.0; 3]; 6];
        far[4][2] = -3.4e38;
        let error = PositionGrid::new(3, 2, far).unwrap_err();
        assert!(matches!(error, HeightError::FarPosition { column: 1, row: 1, .. }), "{error}");
    }

    #[test]
    fn three_rasters_make_positions() {
        let grid = |w, h, first: f32| {
            let heights = (0..w * h).map(|i| first + i as f32).collect();
            HeightGrid::new(w, h, heights).unwrap()
        };
        let made = PositionGrid::from_grids(&grid(3, 2, 0.0), &grid(3, 2, 10.0), &grid(3, 2, f32::NAN));
        assert_eq!(made.unwrap().void_count(), 6);
        let made = PositionGrid::from_grids(&grid(3, 2, 0.0), &grid(3, 2, 10.0), &grid(3, 2, 20.0)).unwrap();
        assert_eq!(made.xyz_m[4], [4.0, 14.0, 24.0]);
        let unequal = PositionGrid::from_grids(&grid(3, 2, 0.0), &grid(2, 3, 0.0), &grid(3, 2, 0.0));
        assert!(matches!(unequal, Err(HeightError::UnequalGrids { .. })));
        let mut short = grid(3, 2, 0.0);
        short.heights_m.pop();
        let made = PositionGrid::from_grids(&short, &grid(3, 2, 0.0), &grid(3, 2, 0.0));
        assert!(matches!(made, Err(HeightError::PositionCount { .. })));
    }
}
