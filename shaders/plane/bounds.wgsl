// Boxes around patches on a plane, from the ranges of heights of blocks.

@group(0) @binding(4) var<storage, read> block_bounds: array<vec2<f32>>;

fn empty_box() -> Box {
    return Box(vec3<f32>(VOID), vec3<f32>(-VOID));
}

// Heights of all blocks that touch a rectangle of a level's nodes; no horizontal extent yet.
fn box_over(level: u32, rect_lo: vec2<i32>, rect_hi: vec2<i32>) -> Box {
    let area = loaded(level);
    let lo = max(rect_lo, area.lo);
    let hi = min(rect_hi, area.hi);
    var box = empty_box();
    if any(hi < lo) {
        return box;
    }
    // Blocks are closed: one whose far border is our near one need not be read, unless we are that border.
    let first = lo >> vec2<u32>(BOUNDS_SHIFT);
    let last = max(first, (hi - vec2<i32>(1i)) >> vec2<u32>(BOUNDS_SHIFT));
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let r = block_bounds[block_address(level, vec2<i32>(x, y))];
            box.lo.z = min(box.lo.z, r.x);
            box.hi.z = max(box.hi.z, r.y);
        }
    }
    return box;
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
