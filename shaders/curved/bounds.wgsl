// Boxes around patches on a curved surface, from the boxes of blocks.

override HORIZON: bool = true; // the ellipsoid hides what lies behind it

@group(0) @binding(4) var<storage, read> block_bounds: array<vec4<i32>>;

fn block_box(level: u32, block: vec2<i32>, area: Rect) -> Box {
    let address = 2u * block_address(level, block);
    let low = block_bounds[address].xyz;
    let high = block_bounds[address + 1u].xyz;
    if low.x > high.x {
        return empty_box();
    }
    let anchor = anchor_of(level, max(block * BOUNDS_CELLS, area.lo));
    return Box(placed_box(level, anchor, low), placed_box(level, anchor, high));
}

// Vertices on a border may be owned by another chart, whose integers round differently.
fn patch_box(box: Box, level: u32, base_lo: vec2<i32>, base_hi: vec2<i32>) -> Box {
    let slack = vec3<f32>(curve.levels[level].slack_m) + max(abs(box.lo), abs(box.hi)) * 1e-6;
    return Box(box.lo - slack, box.hi + slack);
}

// True when the whole box lies in the shadow of the ellipsoid under the lowest ground: behind the plane of
// its horizon and inside the cone of its tangents, a convex region, so its corners decide. Nothing nearer
// than the horizon lies behind that plane.
fn over_the_horizon(box: Box) -> bool {
    if !HORIZON || curve.horizon <= 0.0 {
        return false;
    }
    for (var c = 0u; c < 8u; c++) {
        let pick = (vec3<u32>(c) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u);
        let corner = select(box.lo, box.hi, pick == vec3<u32>(1u));
        let away = (corner - frame.eye_from_anchor_m) * curve.horizon_scale;
        let along = -dot(away, curve.horizon_eye);
        // Rounding must never hide what is visible.
        let behind = along > curve.horizon * 1.0001 + 1e-6 * length(away);
        if !behind || along * along < curve.horizon * dot(away, away) * 1.0002 {
            return false;
        }
    }
    return true;
}
