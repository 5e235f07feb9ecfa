//! Base surfaces: what a terrain stands on, and the charts that address it.
//!
//! A [`Surface`] maps chart coordinates `uv` and a height to world metres and back, in f64. The layer
//! is geometry only: it knows no samples, levels of detail, cameras or GPU. The one surface that is
//! made of data, [`SampledSurface`], takes it as a finished grid.

mod base;
mod blocks;
mod charted;
#[cfg(test)]
mod contract_tests;
pub mod cube;
mod cylinder;
mod ellipsoid;
mod nearest;
mod plane;
mod sampled;
mod torus;
#[cfg(test)]
mod value_tests;

use glam::DVec3;

pub use base::{Base, BaseError};
pub use blocks::{
    ANCHOR_WORDS, BlockRecord, LOW_BITS, RECORD_WORDS, SHORT_WORDS, SURFACE_TERMS, UP_BITS, Units, anchor_at,
    anchor_words, block_record, block_start, words_m,
};
pub use charted::{Charted, CubeSphere, Foot, GridCharts, PointChart};
pub use cube::Face;
pub use cylinder::Cylinder;
pub use ellipsoid::Ellipsoid;
pub use plane::Plane;
pub use sampled::SampledSurface;
pub use torus::Torus;

/// A base surface: what terrain stands on. World metres, f64.
///
/// Units of `u` and `v` are the surface's own: metres, radians or grid nodes. Angles may be given
/// outside one turn; [`Surface::invert`] answers within half a turn of 0.
pub trait Surface: Send + Sync + std::fmt::Debug {
    /// World position of chart point `uv` at height `h` metres along the outward normal.
    fn position(&self, uv: [f64; 2], h: f64) -> DVec3;

    /// Outward unit normal: the direction heights grow.
    fn normal(&self, uv: [f64; 2]) -> DVec3;

    /// dP/du and dP/dv at height 0, metres per unit of u and v.
    fn tangents(&self, uv: [f64; 2]) -> [DVec3; 2];

    /// First fundamental form E, F, G at height 0: squared metres per squared units of u and v.
    fn metric(&self, uv: [f64; 2]) -> [f64; 3] {
        let [u, v] = self.tangents(uv);
        [u.length_squared(), u.dot(v), v.length_squared()]
    }

    /// Chart point and height in metres of a world position, by its nearest foot point.
    ///
    /// Finite for every finite position. Where several feet are equally near, as on an axis, one of
    /// them is chosen.
    fn invert(&self, p: DVec3) -> ([f64; 2], f64);

    /// Unit east (along u), north and up at `uv`: right-handed, so north is up x east.
    ///
    /// At a pole, where all longitudes meet, it is the limit along the meridian of the given u.
    fn frame(&self, uv: [f64; 2]) -> [DVec3; 3] {
        let up = self.normal(uv);
        let [u, _] = self.tangents(uv);
        // Where u has no direction, any right angle to up serves.
        let east = (u - up * u.dot(up)).try_normalize().unwrap_or_else(|| up.any_orthonormal_vector());
        [east, up.cross(east), up]
    }

    /// Period of u and v, in their units, where they wrap around.
    fn periods(&self) -> [Option<f64>; 2];

    /// Smallest radius of curvature in metres; infinite for a plane.
    fn least_radius_m(&self) -> f64;
}
