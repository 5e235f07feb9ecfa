//! The cube sphere: six charts whose lattices coincide along their borders.
//!
//! A face's coordinates are the two world axes it does not stand on, in their order (x, y, z), so that
//! along every border both faces count the same way. The price is that half of the faces are seen
//! mirrored; [`Face::mirrored`] says which. Coordinates are warped by a tangent, which evens the cells
//! out: equal steps are equal angles seen from the centre of the face.

use std::f64::consts::FRAC_PI_4;

use glam::DVec3;

/// One of the six faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Face {
    /// World axis it stands on: 0 x, 1 y, 2 z.
    pub axis: usize,
    /// True on the axis' positive side.
    pub positive: bool,
}

impl Face {
    /// All faces, in the order of their numbers: -x, +x, -y, +y, -z, +z.
    pub const ALL: [Self; 6] = [
        Self { axis: 0, positive: false },
        Self { axis: 0, positive: true },
        Self { axis: 1, positive: false },
        Self { axis: 1, positive: true },
        Self { axis: 2, positive: false },
        Self { axis: 2, positive: true },
    ];

    /// Number of the face, 0 to 5.
    #[must_use]
    pub fn number(self) -> usize {
        2 * self.axis + usize::from(self.positive)
    }

    /// World axes of its two coordinates.
    #[must_use]
    pub fn axes(self) -> [usize; 2] {
        match self.axis {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        }
    }

    /// True when its coordinates turn clockwise seen from outside.
    #[must_use]
    pub fn mirrored(self) -> bool {
        // y x z = +x and x x y = +z, but x x z = -y.
        self.positive == (self.axis == 1)
    }

    /// Unit direction of the point `s`, each coordinate from -1 to 1 on the face; up to 2 (excluded)
    /// continues the face's lattice over its border.
    #[must_use]
    pub fn direction(self, s: [f64; 2]) -> DVec3 {
        let mut d = [0.0; 3];
        d[self.axis] = if self.positive { 1.0 } else { -1.0 };
        for (axis, s) in self.axes().into_iter().zip(s) {
            // Exact on the borders, so that both faces compute the same point there.
            d[axis] = if s.abs() == 1.0 { s } else { (s * FRAC_PI_4).tan() };
        }
        DVec3::from_array(d).normalize()
    }

    /// Coordinates of a direction on this face's (continued) lattice; `None` when it points away.
    #[must_use]
    pub fn coordinates(self, direction: DVec3) -> Option<[f64; 2]> {
        let d = direction.to_array();
        let depth = if self.positive { d[self.axis] } else { -d[self.axis] };
        (depth > 0.0).then(|| self.axes().map(|a| (d[a] / depth).atan() / FRAC_PI_4))
    }

    /// The face a direction lies on; the first by number on a border.
    #[must_use]
    pub fn of(direction: DVec3) -> Self {
        let d = direction.to_array();
        let most = d.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        Self::ALL.into_iter().find(|f| (if f.positive { d[f.axis] } else { -d[f.axis] }) >= most).unwrap_or(Self::ALL[0])
    }
}
