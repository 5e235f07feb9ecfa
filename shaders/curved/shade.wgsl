// What the colours need of a sample, in 32 bits: outward direction and height.

fn shade_of(up: vec3<f32>, height: f32) -> u32 {
    let p = vec2<u32>(round((octahedral(up) * 0.5 + 0.5) * 1022.0));
    let range = frame.height_range_m;
    let t = clamp((height - range.x) / max(range.y - range.x, 1e-6), 0.0, 1.0);
    return p.x | (p.y << 10u) | (u32(round(t * 4095.0)) << 20u);
}
