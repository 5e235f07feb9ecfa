//! Clipmap windows: where each level stands for a camera, and what a move makes stale.
//!
//! Pure integer geometry on the sample lattice; it knows neither heights nor the GPU.
//! Losasso and Hoppe, *Geometry Clipmaps*, 2004; Brettell, *Terrain Rendering Using Geometry
//! Clipmaps*, 2005 (finite data, section 3.4); Song et al., *Geometry Clipmaps Terrain Rendering
//! Using Hardware Tessellation*, 2016 (section 3).

mod charts;
mod lattice;
mod refill;
mod windows;

pub use charts::{Chart, ChartGraph, ChartWindows, MAX_CHARTS, Neighbour, Node, Side, thirds};
pub use lattice::{Lattice, Rect};
pub(crate) use refill::difference;
pub use refill::{Refill, Strip, height_bound, refill_from, refill_strips, stale};
pub use windows::{ClipmapError, ClipmapShape, LPosition, MAX_LEVELS, Windows};
