// Vertices and triangles -> colour and depth. `vs_solid` is fed by the vertex and index buffers;
// `vs_wire` pulls both as storage, so that each triangle knows its edges: lines without the native
// polygon mode. Depth is reversed, the far plane lies at infinity.

override COLOR_MODE: u32 = 0u; // 0 shaded, 1 levels, 2 blocks, 3 elevation, 4 slope, 5 error, 6 refill
override FOG: bool = true;

fn surface_color(in: Seen) -> vec3<f32> {
    let normal = normalize(in.normal);
    let place = relief(in, normal);
    let slope = place.x;
    let t = place.y;
    let level = (in.tag >> 24u) & 31u;
    let kind = in.tag >> 29u;
    let mark = in.tag >> 24u;
    var color: vec3<f32>;
    switch COLOR_MODE {
        case 1u: { color = lit(palette(level) * 0.6, normal, slope); }
        case 2u: { color = lit(palette(kind) * mix(0.35, 0.7, f32(level % 2u)), normal, slope); }
        case 3u: { color = ramp(t); }
        case 4u: { color = ramp(acos(clamp(slope, 0.0, 1.0)) / 1.5707964); }
        case 5u: { color = lit(select(ramp(f32(mark) / 254.0), palette(7u), mark == 255u) * 0.6, normal, slope); }
        case 6u: { color = lit(select(vec3<f32>(0.12), palette(0u), mark > 0u), normal, slope); }
        default: { color = lit(tint(t, slope), normal, slope); }
    }
    if FOG && COLOR_MODE == 0u {
        let away = distance(in.position, frame.eye_from_anchor_m);
        color = mix(frame.fog_color, color, exp(-away * frame.fog_per_m));
    }
    return color;
}

@fragment
fn fs_solid(in: Seen) -> @location(0) vec4<f32> {
    return vec4<f32>(surface_color(in), 1.0);
}

@fragment
fn fs_wire(in: Seen) -> @location(0) vec4<f32> {
    // Distance to the nearest edge in pixels.
    let px = in.edge / max(fwidth(in.edge), vec3<f32>(1e-9));
    let line = 1.0 - smoothstep(0.4, 1.2, min(px.x, min(px.y, px.z)));
    return vec4<f32>(mix(surface_color(in), vec3<f32>(0.004), line * 0.8), 1.0);
}
