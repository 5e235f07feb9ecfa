// Colours. Everything linear; the target encodes sRGB.

// Okabe and Ito's eight colours, told apart with any kind of colour vision; linear values.
fn palette(ix: u32) -> vec3<f32> {
    switch ix % 8u {
        case 0u: { return vec3<f32>(0.791, 0.347, 0.000); }
        case 1u: { return vec3<f32>(0.093, 0.456, 0.815); }
        case 2u: { return vec3<f32>(0.000, 0.342, 0.171); }
        case 3u: { return vec3<f32>(0.871, 0.776, 0.054); }
        case 4u: { return vec3<f32>(0.000, 0.168, 0.445); }
        case 5u: { return vec3<f32>(0.665, 0.112, 0.000); }
        case 6u: { return vec3<f32>(0.604, 0.191, 0.386); }
        default: { return vec3<f32>(0.40, 0.40, 0.40); }
    }
}

// Hypsometric tint: lowland green to snow by relative height, bare rock where it is steep.
fn hypsometric(t: f32, up: f32) -> vec3<f32> {
    let meadow = vec3<f32>(0.095, 0.165, 0.045);
    let steppe = vec3<f32>(0.255, 0.235, 0.095);
    let scree = vec3<f32>(0.260, 0.200, 0.145);
    let snow = vec3<f32>(0.830, 0.860, 0.900);
    var c = mix(meadow, steppe, smoothstep(0.05, 0.40, t));
    c = mix(c, scree, smoothstep(0.35, 0.62, t));
    c = mix(c, snow, smoothstep(0.62, 0.80, t) * smoothstep(0.45, 0.75, up));
    let rock = vec3<f32>(0.150, 0.130, 0.115);
    return mix(rock, c, smoothstep(0.50, 0.85, up));
}

// Viridis-like ramp (dark to light, colour-blind safe) for figures: elevation and slope.
fn ramp(t: f32) -> vec3<f32> {
    let a = vec3<f32>(0.058, 0.000, 0.089);
    let b = vec3<f32>(0.035, 0.095, 0.255);
    let c = vec3<f32>(0.014, 0.278, 0.263);
    let d = vec3<f32>(0.110, 0.578, 0.130);
    let e = vec3<f32>(0.982, 0.799, 0.018);
    let x = clamp(t, 0.0, 1.0) * 4.0;
    if x < 1.0 { return mix(a, b, x); }
    if x < 2.0 { return mix(b, c, x - 1.0); }
    if x < 3.0 { return mix(c, d, x - 2.0); }
    return mix(d, e, x - 3.0);
}

@group(0) @binding(8) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(9) var<storage, read> indices: array<u32>;

// The eye's coarse part is subtracted before the matrix, exactly: a millimetre of camera movement must not
// drown in the rounding of far larger terms.
fn clip_position(position: vec3<f32>) -> vec4<f32> {
    return frame.clip_from_near * vec4<f32>(position - frame.eye_from_anchor_m, 1.0);
}

// One sun and a sky: hemispheric ambient.
fn lit(albedo: vec3<f32>, normal: vec3<f32>, up: f32) -> vec3<f32> {
    let sun = max(dot(normal, frame.sun_direction), 0.0) * vec3<f32>(2.1, 1.95, 1.7);
    let sky = mix(vec3<f32>(0.30, 0.26, 0.22), vec3<f32>(0.75, 0.95, 1.25), up * 0.5 + 0.5);
    return albedo * (sun + sky * frame.ambient);
}
