// Stands in for the bounds of patches where nothing is culled and no patch can be all void: every box holds
// something, and nobody asks where it lies.

fn box_over(level: u32, rect_lo: vec2<i32>, rect_hi: vec2<i32>) -> Box {
    return Box(vec3<f32>(0.0), vec3<f32>(0.0));
}

fn coarse_box(level: u32, base_lo: vec2<i32>, base_hi: vec2<i32>) -> Box {
    return Box(vec3<f32>(0.0), vec3<f32>(0.0));
}

fn patch_box(box: Box, level: u32, base_lo: vec2<i32>, base_hi: vec2<i32>) -> Box {
    return box;
}

fn over_the_horizon(box: Box) -> bool {
    return false;
}
