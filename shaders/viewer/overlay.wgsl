// The panels' own picture over a frame, where it cannot be copied; the scissor says where panels are.

@group(0) @binding(0) var panels: texture_2d<f32>; // as large as the frame

@vertex
fn vs_overlay(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    let at = vec2<f32>(vec2<u32>(vertex & 1u, vertex >> 1u)) * 4.0 - 1.0;
    return vec4<f32>(at, 0.0, 1.0);
}

@fragment
fn fs_overlay(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    return textureLoad(panels, vec2<i32>(at.xy), 0);
}
