// Deviations on a curved surface: along its normals, which differ within a patch, so any direction may be meant.
// Chords of the base surface deviate besides.

fn bend_m(exponent: u32) -> f32 {
    return choice.bend_m * f32(1u << exponent) * f32(1u << exponent);
}

fn widened(box: Box, off: f32) -> Box {
    return Box(box.lo - vec3<f32>(off), box.hi + vec3<f32>(off));
}

// Greatest |row . d - ndc (w_row . d)| over all directions d, for the rows of x and y.
fn moved_px(m: mat4x4<f32>, ndc: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(length(m[0].xyz - ndc.x * m[3].xyz), length(m[1].xyz - ndc.y * m[3].xyz));
}
