// What nodes are measured by on a curved surface: their positions, axis by axis, from the block's first node in
// integers: what the camera's place rounds must not show in a grade.

@group(0) @binding(3) var<storage, read> samples: array<vec4<i32>>;

const AXES = 3u;

fn measured(level: u32, home: vec2<i32>, node: vec2<i32>, axis: u32) -> f32 {
    let sample = samples[sample_address(level, node)].xyz;
    if sample.x == VOID_POSITION {
        return VOID;
    }
    let at = coarse_offset(anchor_of(level, home), anchor_of(level, node), sample);
    return f32(at[axis]) * (curve.levels[level].unit_m * f32(1u << BOX_BITS));
}
