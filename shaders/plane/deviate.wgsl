// Deviations on a plane: along the vertical.

fn bend_m(exponent: u32) -> f32 {
    return 0.0;
}

fn widened(box: Box, off: f32) -> Box {
    return Box(box.lo - vec3<f32>(0.0, 0.0, off), box.hi + vec3<f32>(0.0, 0.0, off));
}

// Magnitudes of (row . up - ndc (w_row . up)) for the rows of x and y.
fn moved_px(m: mat4x4<f32>, ndc: vec2<f32>) -> vec2<f32> {
    return abs(vec2<f32>(m[0].z, m[1].z) - ndc * m[3].z);
}
