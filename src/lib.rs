//! Very large terrain by geometry clipmaps whose mesh is made on the GPU.
//!
//! Data flows one way, and modules import only what stands above them:
//!
//! ```text
//! heights    a DEM or a procedural terrain      -> HeightGrid
//! pyramid    HeightGrid                         -> levels, read by rectangles
//! clipmap    camera                             -> windows, refill strips       (pure, integer)
//! quads      windows                            -> control quads, patches, factors
//! reference  CPU twins of the compute shaders
//! gpu        device, buffers, shaders, passes, read-back
//! renderer   scene -> plan -> prepare -> record
//! measure    upload ledger, frame statistics, watertightness
//! ```
//!
//! Draw into your own device in four steps: open a terrain, make a [`Renderer`], `prepare` a camera,
//! `record` into your encoder; `examples/embed.rs` is the whole of it.

pub mod camera;
pub mod clipmap;
pub mod gpu;
pub mod heights;
pub mod measure;
pub mod plan;
pub mod pyramid;
pub mod quads;
pub mod reference;
pub mod renderer;
#[cfg(feature = "cli")]
pub mod report;
pub mod rivals;
pub mod scene;

pub use camera::Camera;
pub use heights::{HeightGrid, open_terrain};
pub use pyramid::Prefilter;
pub use renderer::{RenderError, Renderer, Target};
pub use scene::{ColorMode, Scene, Terrain};
