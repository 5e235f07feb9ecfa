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
        Self::ALL
            .into_iter()
            .find(|f| (if f.positive { d[f.axis] } else { -d[f.axis] }) >= most)
            .unwrap_or(Self::ALL[0])
    }
}

/// How unevenly a face's lattice covers the unit sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// Area of the largest cell of a face over that of the smallest; at best 1.
    pub area_ratio: f64,
    /// Longest over shortest axis of the ellipse that a small circle of coordinates becomes, where
    /// that is worst, measured at the nodes; at best 1.
    pub worst_anisotropy: f64,
}

/// Measures a face divided into `samples_per_side` x `samples_per_side` (at least 1) cells. All faces
/// are alike.
#[must_use]
pub fn distortion(samples_per_side: usize) -> Distortion {
    let n = samples_per_side.max(1);
    let face = Face::ALL[5];
    let s = |i: usize| 2.0 * i as f64 / n as f64 - 1.0;
    let node = |i: usize, j: usize| face.direction([s(i), s(j)]);
    let (mut least, mut most, mut worst_anisotropy) = (f64::INFINITY, 0.0_f64, 1.0_f64);
    for j in 0..=n {
        for i in 0..=n {
            worst_anisotropy = worst_anisotropy.max(anisotropy([s(i), s(j)]));
            if i < n && j < n {
                let diagonals = [node(i + 1, j + 1) - node(i, j), node(i, j + 1) - node(i + 1, j)];
                let area = 0.5 * diagonals[0].cross(diagonals[1]).length();
                (least, most) = (least.min(area), most.max(area));
            }
        }
    }
    Distortion { area_ratio: most / least, worst_anisotropy }
}

/// Ratio of the singular values of the map from coordinates to the unit sphere at `s`.
fn anisotropy(s: [f64; 2]) -> f64 {
    let [x, y] = s.map(|s| (s * FRAC_PI_4).tan());
    let length2 = 1.0 + x * x + y * y;
    // Derivatives of (x, y, 1) / length, where a coordinate's derivative is 1 + its square.
    let (a, b) = (1.0 + x * x, 1.0 + y * y);
    let e = a * a * (length2 - x * x);
    let f = -a * b * x * y;
    let g = b * b * (length2 - y * y);
    let (mean, spread) = (0.5 * (e + g), (0.5 * (e - g)).hypot(f));
    ((mean + spread) / (mean - spread)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::{Face, anisotropy, distortion};
    use glam::DVec3;
    use proptest::prelude::*;

    fn face() -> impl Strategy<Value = Face> {
        (0..6_usize).prop_map(|i| Face::ALL[i])
    }

    proptest! {
        #[test]
        fn coordinates_round_trip_also_beyond_the_border(f in face(), s in prop::array::uniform2(-1.9..1.9_f64)) {
            let d = f.direction(s);
            prop_assert!((d.length() - 1.0).abs() < 1e-15);
            let back = f.coordinates(d).unwrap();
            prop_assert!((0..2).all(|k| (back[k] - s[k]).abs() < 1e-14), "{s:?} {back:?}");
            prop_assert!(f.coordinates(-d).is_none());
        }

        #[test]
        fn directions_round_trip_and_lie_on_their_face(d in prop::array::uniform3(-1.0..1.0_f64)) {
            let d = DVec3::from_array(d);
            prop_assume!(d.length() > 1e-3);
            let d = d.normalize();
            let f = Face::of(d);
            let s = f.coordinates(d).unwrap();
            prop_assert!(s.iter().all(|c| c.abs() <= 1.0 + 1e-15));
            prop_assert!(f.direction(s).distance(d) < 1e-15);
        }

        #[test]
        fn points_inside_belong_to_one_face(f in face(), s in prop::array::uniform2(-0.999..0.999_f64)) {
            prop_assert_eq!(Face::of(f.direction(s)), f);
        }

        /// Both faces at a border compute the same bits, from the same coordinate along it.
        #[test]
        fn borders_are_bit_identical(f in face(), k in 0..2_usize, high: bool,
            t in prop_oneof![-1.0..=1.0_f64, Just(-1.0), Just(0.0), Just(1.0)])
        {
            let side = if high { 1.0 } else { -1.0 };
            let mut s = [t; 2];
            s[k] = side;
            // The neighbour stands on the axis that `s[k]` runs along.
            let other = Face { axis: f.axes()[k], positive: high };
            let along = f.axes()[1 - k];
            let theirs = other.axes().map(|a| {
                if a == along { t } else if f.positive { 1.0 } else { -1.0 }
            });
            let bits = |d: DVec3| d.to_array().map(f64::to_bits);
            prop_assert_eq!(bits(f.direction(s)), bits(other.direction(theirs)));
        }
    }

    #[test]
    fn mirrored_faces_are_those_that_turn_clockwise() {
        for f in Face::ALL {
            let d = |s| f.direction(s);
            let turn = (d([0.1, 0.0]) - d([0.0, 0.0])).cross(d([0.0, 0.1]) - d([0.0, 0.0]));
            assert_eq!(turn.dot(d([0.0, 0.0])) < 0.0, f.mirrored(), "{f:?}");
            assert_eq!(Face::ALL[f.number()], f);
        }
    }

    #[test]
    fn distortion_is_bounded() {
        for n in [1, 16, 256] {
            let d = distortion(n);
            println!("{n} cells per side: {d:?}");
            // Cells in the middle of a border are 1 / sqrt 2 of those in the middle of the face.
            assert!(d.area_ratio >= 1.0 && d.area_ratio < 2.0_f64.sqrt());
            // Three right angles meet in a corner's 360 degrees: 120 each, a ratio of sqrt 3.
            assert!((d.worst_anisotropy - 3.0_f64.sqrt()).abs() < 1e-12);
        }
        assert!(distortion(256).area_ratio > 1.40);
        assert!((anisotropy([0.0, 0.0]) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn anisotropy_matches_differences() {
        for s in [[0.2, 0.7], [1.0, 0.0], [-0.9, -0.9], [0.5, -1.0]] {
            let e = 1e-6;
            let f = Face::ALL[5];
            let u = (f.direction([s[0] + e, s[1]]) - f.direction([s[0] - e, s[1]])) / (2.0 * e);
            let v = (f.direction([s[0], s[1] + e]) - f.direction([s[0], s[1] - e])) / (2.0 * e);
            // The singular values by their sum of squares and their product.
            let (sum, product) = (u.length_squared() + v.length_squared(), u.cross(v).length());
            let high = (0.5 * sum + (0.25 * sum * sum - product * product).max(0.0).sqrt()).sqrt();
            assert!((high * high / product - anisotropy(s)).abs() < 1e-6, "{s:?}");
        }
    }
}
