//! The frame plan: what a scene needs, what is left out and why.

use serde::Serialize;

use crate::clipmap::ClipmapShape;
use crate::gpu::Ground;
use crate::gpu::passes::Variant;
use crate::scene::{ColorMode, Scene, Terrain};

/// Something the scene does not need and therefore does not pay for.
#[derive(Clone, Debug, Serialize, PartialEq, Eq)]
pub struct LeftOut {
    /// Feature that is neither compiled, bound, allocated nor run.
    pub feature: &'static str,
    /// Why.
    pub because: String,
}

/// What a scene is turned into.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// Passes of a frame in order; the first two run only when a window moved.
    pub passes: Vec<&'static str>,
    /// Native features in use beyond default WebGPU; everything works without them.
    pub native_extras: Vec<&'static str>,
    /// What is left out.
    pub left_out: Vec<LeftOut>,
    #[serde(skip)]
    pub(crate) variant: Variant,
}

impl Plan {
    /// Plans a scene over a terrain. `timestamps` says whether the device can time passes.
    #[must_use]
    pub fn new(scene: &Scene, terrain: &Terrain, shape: ClipmapShape, timestamps: bool) -> Self {
        let samples = u64::from(shape.n() + 1).pow(2) * u64::from(shape.levels());
        let mut left_out = vec![LeftOut {
            feature: "position texture",
            because: format!(
                "base is a plane: heights suffice, {:.1} MB saved against 16 bytes a sample",
                (samples * 12) as f64 / 1e6
            ),
        }];
        let mut leave = |on: bool, feature, because: &str| {
            if !on {
                left_out.push(LeftOut { feature, because: because.to_string() });
            }
        };
        let has_voids = terrain.source.has_voids();
        leave(has_voids, "nodata", "the data has no voids (or they were filled)");
        leave(scene.morph, "geomorph", "not asked for (--morph)");
        leave(scene.color == ColorMode::Shaded, "tint and fog", "only the shaded colouring has them");
        leave(scene.fog, "fog", "switched off");
        leave(scene.wireframe, "wireframe", "not asked for (--wireframe)");
        leave(scene.cull, "frustum culling", "switched off: every patch is drawn");
        leave(timestamps, "per-pass times", "the adapter has no timestamp queries; gpu_ms is null");
        let passes = crate::gpu::shader_sources().iter().map(|s| s.stem).collect();
        let native_extras = if timestamps { vec!["timestamp-query"] } else { Vec::new() };
        let variant = variant(scene, terrain);
        Self { passes, native_extras, left_out, variant }
    }
}

/// Which shaders the scene needs.
pub(crate) fn variant(scene: &Scene, terrain: &Terrain) -> Variant {
    let (ground, charts) = match &terrain.curved {
        None => (Ground::Plane, 1),
        Some(c) if c.points.is_some() => (Ground::Points, c.graph.charts.len()),
        Some(c) => (Ground::Curved, c.graph.charts.len()),
    };
    Variant {
        ground,
        charts: u32::try_from(charts).unwrap_or(u32::MAX),
        has_voids: terrain.source.has_voids(),
        morph: scene.morph,
        short: ground != Ground::Points && terrain.source.step_m().is_some(),
    }
}
