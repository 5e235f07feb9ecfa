// Boxes around patches on a plane, from the ranges of heights of blocks.

@group(0) @binding(4) var<storage, read> block_bounds: array<vec2<f32>>;

// Heights of a block; no horizontal extent yet.
fn block_box(level: u32, block: vec2<i32>, area: Rect) -> Box {
    let r = block_bounds[block_address(level, block)];
    return Box(vec3<f32>(VOID, VOID, r.x), vec3<f32>(-VOID, -VOID, r.y));
}

// The box of a patch between two base samples, relative to the anchor.
fn patch_box(heights: Box, level: u32, base_lo: vec2<i32>, base_hi: vec2<i32>) -> Box {
    let up = vec2<f32>(heights.lo.z, heights.hi.z) - frame.anchor_height_m;
    return Box(
        vec3<f32>(vec2<f32>(base_lo - frame.anchor) * frame.spacing_m, up.x),
        vec3<f32>(vec2<f32>(base_hi - frame.anchor) * frame.spacing_m, up.y),
    );
}

// A plane has no horizon.
fn over_the_horizon(box: Box) -> bool {
    return false;
}
