//! One axis of a geographic grid: evenly spaced nodes, save for the first and the last cell.

/// Nodes along longitude or latitude, in degrees from the first one.
///
/// All cells are `step` wide, but the first and the last may be narrower or wider: that is how the
/// row at a pole and the cell that closes a parallel fit a grid that was not laid out for them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    /// Width of the cells between, degrees.
    pub(super) step: f64,
    /// Index of the last node, at least 1.
    pub(super) last: usize,
    low_gap: f64,
    high_gap: f64,
    /// Position of the last node, degrees from the first.
    pub(super) span: f64,
}

impl Axis {
    /// An axis of `nodes` nodes (at least 2) whose first and last cells are `gaps` degrees wide. With a
    /// single cell, both gaps must be its width.
    pub(super) fn new(nodes: usize, step: f64, [low_gap, high_gap]: [f64; 2]) -> Self {
        let last = nodes.saturating_sub(1).max(1);
        let span = if last == 1 { low_gap } else { low_gap + step * (last - 2) as f64 + high_gap };
        Self { step, last, low_gap, high_gap, span }
    }

    /// Cell under `x` degrees from the first node, and the place in it from 0 to 1. Positions off the
    /// axis are moved to its nearer end.
    pub(super) fn locate(&self, x: f64) -> (usize, f64) {
        if x < self.low_gap {
            return (0, (x / self.low_gap).max(0.0));
        }
        let tail = self.span - self.high_gap;
        if x >= tail {
            return (self.last - 1, ((x - tail) / self.high_gap).clamp(0.0, 1.0));
        }
        let v = 1.0 + (x - self.low_gap) / self.step;
        // `x` lies between two inner nodes here, whatever the division has rounded to.
        let cell = (v as usize).clamp(1, self.last - 1);
        (cell, (v - cell as f64).clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::Axis;

    #[test]
    fn odd_end_cells_are_found() {
        let axis = Axis::new(5, 1.0, [0.5, 0.25]);
        assert_eq!(axis.span, 2.75);
        for (x, cell, t) in [
            (-1.0, 0, 0.0),
            (0.25, 0, 0.5),
            (0.5, 1, 0.0),
            (1.25, 1, 0.75),
            (2.0, 2, 0.5),
            (2.5, 3, 0.0),
            (2.625, 3, 0.5),
            (9.0, 3, 1.0),
        ] {
            assert_eq!(axis.locate(x), (cell, t), "{x}");
        }
        let single = Axis::new(2, 1.0, [0.5, 0.5]);
        assert_eq!(single.locate(0.25), (0, 0.5));
        assert_eq!(single.locate(0.5), (0, 1.0));
    }
}
