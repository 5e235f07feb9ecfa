// What the fragments see of a vertex on a plane: up is z.

struct Seen {
    @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>, // metres from the anchor
    @location(1) normal: vec3<f32>,
    @location(2) @interpolate(flat, either) tag: u32, // packed word of the provoking vertex
    @location(3) edge: vec3<f32>,     // barycentric, wireframe only
}

fn unpack_normal(packed: u32) -> vec3<f32> {
    let uv = vec2<f32>(f32(packed & 0xfffu), f32((packed >> 12u) & 0xfffu)) / 4095.0 * 2.0 - 1.0;
    return normalize(vec3<f32>(uv, 1.0 - abs(uv.x) - abs(uv.y)));
}

fn see(position: vec3<f32>, packed: u32, edge: vec3<f32>) -> Seen {
    var out: Seen;
    out.clip = clip_position(position);
    out.position = position;
    out.normal = unpack_normal(packed);
    out.tag = packed;
    out.edge = edge;
    return out;
}

@vertex
fn vs_solid(@location(0) position: vec3<f32>, @location(1) packed: u32) -> Seen {
    return see(position, packed, vec3<f32>(1.0));
}

@vertex
fn vs_wire(@builtin(vertex_index) ix: u32) -> Seen {
    let v = vertices[indices[ix]];
    var edge = vec3<f32>(0.0);
    edge[ix % 3u] = 1.0;
    return see(vec3<f32>(v.x, v.y, v.z), v.packed, edge);
}

// Cosine of the slope, and height from 0 (lowest) to 1.
fn relief(in: Seen, normal: vec3<f32>) -> vec2<f32> {
    let height = in.position.z + frame.anchor_height_m;
    let range = frame.height_range_m;
    return vec2<f32>(normal.z, (height - range.x) / max(range.y - range.x, 1e-6));
}

fn tint(t: f32, slope: f32) -> vec3<f32> {
    return hypsometric(t, slope);
}
