//! The frame plan: what a scene needs, what is left out and why. Made without a GPU.

mod left_out;

use serde::Serialize;

pub use self::left_out::LeftOut;
use crate::clipmap::ClipmapShape;
use crate::gpu::passes::spec::{PASSES, binding_name};
use crate::gpu::{BufferSize, Capacity, Ground, Variant, buffer_sizes};
use crate::scene::{ColorMode, Factors, Scene, Terrain};

/// Largest buffer a shader can bind under WebGPU's default limits, bytes.
pub const DEFAULT_MOST_BYTES: u64 = 128 << 20;

/// An override constant of a shader.
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
pub struct Constant {
    /// Its name in WGSL.
    pub name: &'static str,
    /// Its value; switches are 0 or 1.
    pub value: f64,
}

/// A pass of the frame: its shader variant and what it binds.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct PlannedPass {
    /// Name, also that of its entry point.
    pub pass: &'static str,
    /// When it runs.
    pub runs: &'static str,
    /// Files under `shaders/` that its module is composed of, in order.
    pub modules: Vec<&'static str>,
    /// Override constants.
    pub constants: Vec<Constant>,
    /// Buffers bound to the shader.
    pub bindings: Vec<&'static str>,
    /// Vertex and index buffers drawn from.
    pub inputs: Vec<&'static str>,
}

/// Sums over a plan.
#[derive(Clone, Copy, Debug, Default, Serialize, PartialEq, Eq)]
pub struct Totals {
    /// Passes.
    pub passes: usize,
    /// Bindings of all passes.
    pub bindings: usize,
    /// Bytes of all buffers.
    pub buffer_bytes: u64,
    /// Bytes of all textures.
    pub texture_bytes: u64,
}

/// What a scene is turned into.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// Passes of a frame in order.
    pub passes: Vec<PlannedPass>,
    /// Buffers, allocated once.
    pub buffers: Vec<BufferSize>,
    /// Textures: none, everything lies in buffers; colour and depth targets are the host's.
    pub textures: Vec<BufferSize>,
    /// Sums.
    pub totals: Totals,
    /// Native features in use beyond default WebGPU; everything works without them.
    pub native_extras: Vec<&'static str>,
    /// What is left out.
    pub left_out: Vec<LeftOut>,
    /// Which shaders.
    #[serde(skip)]
    pub variant: Variant,
}

impl Plan {
    /// Plans a scene over a terrain for buffers of at most `most_bytes`. `timestamps` says whether the
    /// device can time passes, where that is known.
    #[must_use]
    pub fn new(
        scene: &Scene,
        terrain: &Terrain,
        shape: ClipmapShape,
        most_bytes: u64,
        timestamps: Option<bool>,
    ) -> Self {
        let variant = variant(scene, terrain);
        let capacity = room(scene, shape, variant).fitted(most_bytes);
        Self::of(variant, scene, terrain, shape, capacity, timestamps)
    }

    /// The plan of a given variant with room for `capacity`.
    pub(crate) fn of(
        variant: Variant,
        scene: &Scene,
        terrain: &Terrain,
        shape: ClipmapShape,
        capacity: Capacity,
        timestamps: Option<bool>,
    ) -> Self {
        let passes = PASSES.iter().filter(|spec| (spec.needed)(variant)).map(|spec| {
            let source = (spec.source)(variant);
            let constants = (spec.constants)(variant);
            PlannedPass {
                pass: source.stem,
                runs: spec.runs,
                modules: source.part_names(variant.ground),
                constants: constants.into_iter().map(|(name, value)| Constant { name, value }).collect(),
                bindings: (spec.bindings)(variant).into_iter().map(binding_name).collect(),
                inputs: (spec.inputs)(variant),
            }
        });
        let mut plan = Self {
            passes: passes.collect(),
            buffers: Vec::new(),
            textures: Vec::new(),
            totals: Totals::default(),
            native_extras: if timestamps == Some(true) { vec!["timestamp-query"] } else { Vec::new() },
            left_out: left_out::left_out(variant, scene, terrain, shape, capacity, timestamps),
            variant,
        };
        plan.resize(shape, capacity);
        plan
    }

    /// The same plan with other room for the mesh.
    pub(crate) fn resize(&mut self, shape: ClipmapShape, capacity: Capacity) {
        self.buffers = buffer_sizes(shape, self.variant.extent(), capacity);
        self.totals = Totals {
            passes: self.passes.len(),
            bindings: self.passes.iter().map(|p| p.bindings.len()).sum(),
            buffer_bytes: self.buffers.iter().map(|b| b.bytes).sum(),
            texture_bytes: self.textures.iter().map(|t| t.bytes).sum(),
        };
    }
}

/// Which shaders the scene needs.
pub(crate) fn variant(scene: &Scene, terrain: &Terrain) -> Variant {
    let (ground, charts) = match &terrain.curved {
        None => (Ground::Plane, 1),
        Some(c) if c.points.is_some() => (Ground::Points, c.graph.charts.len()),
        Some(c) => (Ground::Curved, c.graph.charts.len()),
    };
    let has_voids = terrain.source.has_voids();
    let hides = ground == Ground::Curved && terrain.curved.as_ref().is_some_and(|c| c.whole.is_some());
    Variant {
        ground,
        charts: u32::try_from(charts).unwrap_or(u32::MAX),
        has_voids,
        morph: scene.morph,
        short: ground != Ground::Points && terrain.source.step_m().is_some(),
        cull: scene.cull,
        horizon: scene.cull && hides,
        // A patch of voids alone is not drawn: only bounds tell. Errors on screen need distances.
        bounds: scene.cull || has_voids || scene.needs_deviations() || scene.bounds,
        normals: ground != Ground::Plane || scene.color != ColorMode::Elevation,
        fog: scene.fog && scene.color == ColorMode::Shaded,
        by_error: scene.factors.by_error(),
        budget: matches!(scene.factors, Factors::ByError { budget: Some(_), .. }),
        wireframe: scene.wireframe,
        boxes: scene.bounds,
        color: scene.color,
        block_cells: block_cells(scene.n, terrain),
    }
}

/// Room for the mesh a scene may need.
pub(crate) fn room(scene: &Scene, shape: ClipmapShape, variant: Variant) -> Capacity {
    match scene.factors {
        Factors::Uniform => Capacity::worst_case(shape, variant.charts),
        Factors::ByError { budget, .. } => {
            Capacity::by_error(shape, variant.charts, budget, variant.has_voids)
        }
    }
}

/// Most that a block's polynomial may leave out close to the camera, metres.
const LEFT_OUT_M: f64 = 5e-5;

/// Cells of a block of the base surface: a sixteenth of the window, less where so many cells bend too far for
/// one polynomial. With the angle of half a block, five points a side leave about `radius angle^5 / 1900` of the
/// surface, and as much of the height along its normal.
fn block_cells(n: u32, terrain: &Terrain) -> u32 {
    let mut cells = ((n + 1) / 16).max(1);
    let Some(curved) = terrain.curved.as_ref().filter(|c| c.points.is_none()) else { return cells };
    let (radius_m, cell_angle) = curved.surface.bend();
    let [low, high] = curved.height_range().unwrap_or([0.0; 2]).map(f64::from);
    let height_m = low.abs().max(high.abs());
    let left_out = |cells: u32| {
        let angle = 0.5 * f64::from(cells) * cell_angle;
        (radius_m + height_m) * angle.powi(5) / 1900.0
    };
    // Tables of more than 131 blocks a side would take more memory than what they are for.
    while cells > ((n + 1) / 128).max(2) && left_out(cells) > LEFT_OUT_M {
        cells /= 2;
    }
    cells
}
