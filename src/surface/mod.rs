//! Base surfaces.
mod cube;
pub use cube::Face;
