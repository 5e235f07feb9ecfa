//! Very large terrain by geometry clipmaps whose mesh is made on the GPU.
//!
//! Data flows one way, and modules import only what stands above them:
//!
//! ```text
//! heights    a DEM or a procedural terrain      -> HeightGrid
//! surface    chart (u, v, h) <-> position       (f64: plane, ellipsoid, cylinder, torus, sampled)
//! pyramid    HeightGrid                         -> levels, read by rectangles
//! stream     store                              -> tiles as they arrive, in the background
//! clipmap    camera                             -> windows, refill strips       (pure, integer)
//! quads      windows                            -> control quads, patches, factors
//! reference  CPU twins of the compute shaders
//! gpu        device, buffers, shaders, passes, read-back
//! renderer   scene -> plan -> prepare -> record
//! rivals     the methods we compare against, behind one trait
//! measure    upload ledger, frame statistics, watertightness, error of what was drawn
//! ```
//!
//! Draw into your own device in four steps: open a terrain, make a [`Renderer`], `prepare` a camera,
//! `record` into your encoder; `examples/embed.rs` is the whole of it.
//!
//! ```no_run
//! use tessclip::heights::ReadOptions;
//! use tessclip::{Camera, Prefilter, Renderer, Scene, Target, Terrain, open_terrain};
//!
//! # fn frame(
//! #     device: &wgpu::Device, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder,
//! #     color: &wgpu::TextureView, depth: &wgpu::TextureView, size: [u32; 2],
//! # ) -> Result<(), Box<dyn std::error::Error>> {
//! let grid = open_terrain("procedural:mountains", &ReadOptions::default())?;
//! let terrain = Terrain::new(&grid, Prefilter::default());
//! let format = wgpu::TextureFormat::Rgba8UnormSrgb;
//! let mut renderer = Renderer::new(device, queue, format, &terrain, &Scene::default())?;
//! let eye_m = glam::DVec3::new(15_000.0, 2_000.0, 3_500.0);
//! let camera = Camera { eye_m, yaw_deg: 0.0, pitch_deg: -15.0, fov_deg: 60.0, ..Camera::default() };
//! let upload = renderer.prepare(&camera, size)?;
//! renderer.record(encoder, Target { color, depth, clear: true, area: None });
//! # Ok(())
//! # }
//! ```

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
#[cfg(feature = "store")]
pub mod stream;
pub mod surface;

pub use camera::Camera;
pub use heights::{HeightGrid, open_terrain};
pub use pyramid::Prefilter;
pub use renderer::{RenderError, Renderer, Target};
pub use scene::{ColorMode, Factors, Scene, Terrain};
