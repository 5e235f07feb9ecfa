//! What a scene does not need, with the reason and the figure.

use serde::Serialize;

use crate::clipmap::ClipmapShape;
use crate::gpu::{Capacity, Extent, Ground, Variant, buffer_sizes};
use crate::scene::{ColorMode, Scene, Terrain};

/// Something the scene does not need and therefore does not pay for.
#[derive(Clone, Debug, Serialize, PartialEq, Eq)]
pub struct LeftOut {
    /// Feature that is neither compiled, bound, allocated nor run.
    pub feature: &'static str,
    /// Why, and what it saves.
    pub because: String,
}

pub(super) fn left_out(
    variant: Variant,
    scene: &Scene,
    terrain: &Terrain,
    shape: ClipmapShape,
    capacity: Capacity,
    timestamps: Option<bool>,
) -> Vec<LeftOut> {
    let mut out = Vec::new();
    let mut leave = |without: bool, feature, because: String| {
        if without {
            out.push(LeftOut { feature, because });
        }
    };
    let extent = variant.extent();
    let boxes = "drawn bounds";
    leave(!variant.boxes, boxes, "not asked for (--bounds): no boxes are drawn".into());
    let marked = matches!(variant.color, ColorMode::Error | ColorMode::Refill);
    leave(!marked, "marks", "only the colourings error and refill have them: no pass, no binding".into());
    let bytes = |extent: Extent, names: &[&str]| -> u64 {
        let all = buffer_sizes(shape, extent, capacity);
        all.iter().filter(|s| names.contains(&s.name)).map(|s| s.bytes).sum()
    };
    let plane = variant.ground == Ground::Plane;
    let curved = Extent { ground: Ground::Curved, ..extent };

    let positions = bytes(curved, &["samples"]).saturating_sub(bytes(extent, &["samples"]));
    leave(
        plane,
        "position texture",
        format!("base is a plane: no position texture, {} saved", mb(positions)),
    );
    let surface = bytes(curved, &["curve", "charts", "records", "shades"]);
    leave(
        plane,
        "base surface and charts",
        format!("base is a plane, one chart: no curve, charts, records and shades, {} saved", mb(surface)),
    );
    leave(
        !variant.has_voids,
        "nodata",
        "the data has no voids (or they were filled): no triangle is tested".into(),
    );
    let by_error = Extent { deviations: true, by_error: true, ..extent };
    let chosen = bytes(by_error, &["choice", "deviations", "wishes", "weights", "grades", "fresh", "leaves"]);
    let chosen = chosen.saturating_sub(bytes(extent, &["choice", "deviations"]));
    leave(
        !variant.by_error,
        "factors by error",
        format!("not asked for (--pixel-error, --budget): no node is graded, {} saved", mb(chosen)),
    );
    leave(
        variant.by_error && !variant.budget,
        "triangle budget",
        "not asked for (--budget): no triangles are weighed".into(),
    );
    leave(!variant.morph, "geomorph", "not asked for (--morph)".into());
    let tint = "tint and fog";
    leave(scene.color != ColorMode::Shaded, tint, "only the shaded colouring has them".into());
    leave(!scene.fog && scene.color == ColorMode::Shaded, "fog", "switched off".into());
    leave(
        !variant.normals,
        "normals",
        "colouring elevation is not lit: none are computed, 4 neighbours a vertex not read".into(),
    );
    leave(!variant.wireframe, "wireframe", "not asked for (--wireframe): no vertex pulling".into());
    leave(!variant.cull, "frustum culling", "switched off: every patch is drawn".into());
    leave(!variant.horizon, "horizon culling", why_no_horizon(variant, terrain));
    let bounds = bytes(Extent { bounds: true, ..extent }, &["block_bounds"]);
    leave(
        !variant.bounds,
        "block bounds",
        format!("nothing is culled and no patch is void: no bound_blocks pass, {} saved", mb(bounds)),
    );
    let long = bytes(Extent { short: false, ..extent }, &["staging"]);
    let saved = long.saturating_sub(bytes(extent, &["staging"]));
    let step = terrain.source.step_m().unwrap_or(1.0);
    leave(
        variant.short,
        "4-byte samples",
        format!("heights are whole multiples of {step} m: 2 bytes each on their way, {} saved", mb(saved)),
    );
    leave(
        terrain.source.streaming().is_none(),
        "streaming",
        "all samples are in memory: no loader threads, no tile cache, no store".into(),
    );
    leave(true, "textures", "samples lie in buffers; colour and depth targets are the host's".into());
    leave(
        timestamps == Some(false),
        "per-pass times",
        "the adapter has no timestamp queries; gpu_ms is null".into(),
    );
    out
}

fn why_no_horizon(variant: Variant, terrain: &Terrain) -> String {
    let globe = terrain.curved.as_ref().and_then(|c| c.globe.as_ref());
    match (variant.ground, globe) {
        (Ground::Plane, _) => "base is a plane: it has no horizon".into(),
        (_, None) => "the terrain is no whole globe: nothing hides what lies behind".into(),
        _ if variant.has_voids => "one can look through the globe's voids".into(),
        _ => "culling is switched off".into(),
    }
}

/// Megabytes; small ones with the digits they need.
fn mb(bytes: u64) -> String {
    let digits = if bytes < 100_000 { 3 } else { 1 };
    format!("{:.digits$} MB", bytes as f64 / 1e6)
}
