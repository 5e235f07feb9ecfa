// What the fragments see of a vertex on a curved surface: its slope comes with it.

@group(0) @binding(15) var<storage, read> shades: array<u32>;

struct Seen {
    @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>, // metres from the anchor
    @location(1) normal: vec3<f32>,
    @location(2) @interpolate(flat, either) tag: u32, // packed word of the provoking vertex
    @location(3) edge: vec3<f32>,     // barycentric, wireframe only
    @location(4) relief: vec2<f32>,   // cosine of the slope, height from 0 (lowest) to 1
}

fn see(position: vec3<f32>, packed: u32, shade: u32, edge: vec3<f32>) -> Seen {
    var out: Seen;
    out.clip = clip_position(position);
    out.position = position;
    out.normal = from_octahedral(vec2<f32>(f32(packed & 0xfffu), f32((packed >> 12u) & 0xfffu)) / 2047.0 - 1.0);
    out.tag = packed;
    out.edge = edge;
    out.relief = vec2<f32>(f32(shade & 0xffffu) / 65535.0 * 2.0 - 1.0, f32(shade >> 20u) / 4095.0);
    return out;
}

@vertex
fn vs_solid(@location(0) position: vec3<f32>, @location(1) packed: u32, @location(2) shade: u32) -> Seen {
    return see(position, packed, shade, vec3<f32>(1.0));
}

@vertex
fn vs_wire(@builtin(vertex_index) ix: u32) -> Seen {
    let v = vertices[indices[ix]];
    var edge = vec3<f32>(0.0);
    edge[ix % 3u] = 1.0;
    return see(vec3<f32>(v.x, v.y, v.z), v.packed, shades[indices[ix]], edge);
}

fn relief(in: Seen, normal: vec3<f32>) -> vec2<f32> {
    return in.relief;
}

// A globe's lowland is most of its land: heights over the sea are spread by their root. Water darkens with
// depth.
fn tint(t: f32, slope: f32) -> vec3<f32> {
    let sea = frame.sea_level;
    if sea <= 0.0 {
        return hypsometric(t, slope);
    }
    if t <= sea {
        return mix(vec3<f32>(0.004, 0.012, 0.055), vec3<f32>(0.035, 0.130, 0.220), pow(t / sea, 2.5));
    }
    return hypsometric(0.02 + 0.85 * sqrt((t - sea) / (1.0 - sea)), slope);
}
