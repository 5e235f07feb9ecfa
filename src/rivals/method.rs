//! The methods by name, their detail parameters with the defaults of their papers, and how they are made.

use std::sync::{Arc, OnceLock};

use serde::Serialize;

use super::stage::Stage;
use super::{CrackPolicy, Ground, Rival, Unfit};
use super::{brute_force, chunked, classic, footprint, geomipmap, roam, tessellated};
use crate::scene::{Factors, Scene, Terrain};

/// A method of drawing terrain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Method {
    /// Every sample, one static buffer, no culling.
    BruteForce,
    /// Geometry clipmaps with vertex buffers that the CPU updates (Losasso and Hoppe 2004, Brettell 2005).
    Classic,
    /// GPU-based geometry clipmaps from static footprints (Asirvatham and Hoppe 2005).
    Footprint,
    /// Geometrical mipmapping (de Boer 2000, Brodersen 2005).
    Geomipmap,
    /// Chunked quadtree (Ulrich 2002, Brandstetter 2007).
    Chunked,
    /// Real-time optimally adapting meshes (Duchaineau et al. 1997).
    Roam,
    /// Ours.
    Tessellated,
    /// Ours with factors by error.
    ByError,
    /// Ours with the expansion in the vertex stage.
    VertexStage,
    /// Ours with all patches drawn.
    AllPatches,
}

/// Detail of a method; each uses its own part.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Detail {
    /// Clipmaps: samples per side of a window.
    pub n: u32,
    /// Clipmaps: levels; none for the fewest that cover the data.
    pub levels: Option<u32>,
    /// Error-driven methods: threshold, pixels.
    pub pixel_error: f64,
    /// Geomipmaps and chunks: cells per side.
    pub patch_cells: u32,
    /// Ours with factors by error: samples per side of a window, which bounds how far out fine levels reach, not
    /// how much is drawn.
    pub error_n: u32,
    /// The same: most triangles, beside the threshold; none for as many as the threshold asks for.
    pub budget: Option<u32>,
}

impl Default for Detail {
    /// n = 255, one pixel (Brodersen 2005, section 6), 16 cells (17 x 17 vertices, as there); n = 511 where
    /// factors go by error.
    fn default() -> Self {
        Self { n: 255, levels: None, pixel_error: 1.0, patch_cells: 16, error_n: 511, budget: None }
    }
}

impl Method {
    /// All, in the order of reports.
    pub const ALL: [Self; 10] = [
        Self::BruteForce,
        Self::Classic,
        Self::Footprint,
        Self::Geomipmap,
        Self::Chunked,
        Self::Roam,
        Self::Tessellated,
        Self::ByError,
        Self::VertexStage,
        Self::AllPatches,
    ];

    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::BruteForce => "brute-force",
            Self::Classic => "classic",
            Self::Footprint => "footprint",
            Self::Geomipmap => "geomipmap",
            Self::Chunked => "chunked",
            Self::Roam => "roam",
            Self::Tessellated => "tessellated",
            Self::ByError => "tessellated-by-error",
            Self::VertexStage => "tessellated-vertex-stage",
            Self::AllPatches => "tessellated-all-patches",
        }
    }

    /// How it keeps its levels of detail together.
    #[must_use]
    pub fn crack_policy(self) -> CrackPolicy {
        match self {
            Self::Classic | Self::Footprint => CrackPolicy::ZeroAreaTriangles,
            _ => CrackPolicy::Conforming,
        }
    }
}

/// A terrain and a scene to compare methods on, and what they prepare once.
pub struct Lab {
    /// Device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Of the colour target.
    pub format: wgpu::TextureFormat,
    /// What is drawn.
    pub terrain: Terrain,
    /// How: colours, culling, background; n and levels come from the detail.
    pub scene: Scene,
    ground: OnceLock<Result<Arc<Ground>, Unfit>>,
    geomipmap: Tables<geomipmap::Tables>,
    chunked: Tables<chunked::Tables>,
    roam: OnceLock<Arc<roam::Errors>>,
}

/// Tables made once per patch size.
type Tables<T> = std::sync::Mutex<std::collections::BTreeMap<u32, Arc<T>>>;

impl Lab {
    /// A laboratory; nothing is read or made yet.
    #[must_use]
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
        terrain: &Terrain,
        scene: &Scene,
    ) -> Self {
        Self {
            device: device.clone(),
            queue: queue.clone(),
            format,
            terrain: terrain.clone(),
            scene: scene.clone(),
            ground: OnceLock::new(),
            geomipmap: Tables::default(),
            chunked: Tables::default(),
            roam: OnceLock::new(),
        }
    }

    /// All samples in memory.
    ///
    /// # Errors
    /// When the terrain is no plane, has voids or is too large.
    pub fn ground(&self) -> Result<&Arc<Ground>, Unfit> {
        self.ground.get_or_init(|| Ground::of(&self.terrain).map(Arc::new)).as_ref().map_err(Clone::clone)
    }

    /// Makes a method ready to draw; nothing is uploaded before its first frame but what is static.
    ///
    /// # Errors
    /// What the method cannot do here, and why.
    pub fn make(&self, method: Method, detail: &Detail) -> Result<Box<dyn Rival>, Unfit> {
        let failed = |e: &dyn std::fmt::Display| Unfit(e.to_string());
        let scene = Scene { n: detail.n, levels: detail.levels, ..self.scene.clone() };
        let stage = || -> Result<Stage, Unfit> {
            let (d, q) = (&self.device, &self.queue);
            Ok(Stage::new(d, q, self.format, &self.terrain, &scene, self.ground()?))
        };
        let rival: Box<dyn Rival> = match method {
            Method::BruteForce => Box::new(brute_force::BruteForce::new(stage()?).map_err(|e| failed(&e))?),
            Method::Classic => Box::new(classic::Classic::new(self, &scene)?),
            Method::Footprint => Box::new(footprint::FootprintClipmap::new(self, &scene)?),
            Method::Geomipmap => {
                let tables = made(&self.geomipmap, detail.patch_cells, || {
                    Ok(geomipmap::Tables::of(self.ground()?, detail.patch_cells))
                })?;
                let made = geomipmap::Geomipmap::new(stage()?, tables, detail.pixel_error);
                Box::new(made.map_err(|e| failed(&e))?)
            }
            Method::Chunked => {
                let tables = made(&self.chunked, detail.patch_cells, || {
                    Ok(chunked::Tables::of(self.ground()?, detail.patch_cells))
                })?;
                let made = chunked::Chunked::new(stage()?, tables, detail.pixel_error);
                Box::new(made.map_err(|e| failed(&e))?)
            }
            Method::Roam => {
                let ground = self.ground()?;
                let errors = self.roam.get_or_init(|| Arc::new(roam::Errors::of(ground)));
                let made = roam::Roam::new(stage()?, errors.clone(), detail.pixel_error);
                Box::new(made.map_err(|e| failed(&e))?)
            }
            Method::Tessellated => Box::new(tessellated::Tessellated::new(self, &scene)?),
            Method::ByError => {
                #[expect(clippy::cast_possible_truncation, reason = "pixels need no more digits")]
                let pixel_error = Some(detail.pixel_error as f32);
                let factors = Factors::ByError { pixel_error, budget: detail.budget };
                let scene = Scene { n: detail.error_n, factors, ..scene };
                Box::new(tessellated::Tessellated::new(self, &scene)?)
            }
            Method::VertexStage => Box::new(tessellated::VertexStage::new(self, &scene)?),
            Method::AllPatches => {
                let scene = Scene { cull: false, ..scene };
                Box::new(tessellated::Tessellated::new(self, &scene)?)
            }
        };
        Ok(rival)
    }
}

/// The table of a patch size, made when it is first asked for.
fn made<T>(tables: &Tables<T>, cells: u32, make: impl FnOnce() -> Result<T, Unfit>) -> Result<Arc<T>, Unfit> {
    if !(8..=128).contains(&cells) || !cells.is_power_of_two() {
        return Err(Unfit(format!("patches of {cells} cells cannot be used: take 8, 16, 32, 64 or 128")));
    }
    let mut tables = tables.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(table) = tables.get(&cells) {
        return Ok(table.clone());
    }
    let table = Arc::new(make()?);
    tables.insert(cells, table.clone());
    Ok(table)
}
