// Vertex stages of the rivals whose vertices come ready-made from the CPU. Fragments, frame uniform and
// colours are those of draw_terrain.wgsl, for all methods.

// Grids of samples with a common step: the place follows from the vertex' number, so that a vertex is its
// height and its normal, 8 bytes. `grid`: step in base samples, vertices a row, number of the first vertex,
// level << 24. Vertices beyond the data's last sample stand on it.
@vertex
fn vs_patch(
    @builtin(vertex_index) ix: u32,
    @location(0) height: f32,
    @location(1) packed: u32,
    @location(2) lo: vec2<i32>,
    @location(3) grid: vec4<u32>,
) -> Seen {
    let local = ix - grid.z;
    let row = local / grid.y;
    let node = vec2<i32>(vec2<u32>(local - row * grid.y, row));
    let base = min(lo + node * i32(grid.x), frame.last);
    let place = vec3<f32>(ground_at(base), height - frame.anchor_height_m);
    return see(place, packed | grid.w, vec3<f32>(1.0));
}

// Any vertices: base sample, height, normal and level, 16 bytes.
@vertex
fn vs_mesh(
    @location(0) base: vec2<i32>,
    @location(1) height: f32,
    @location(2) packed: u32,
) -> Seen {
    let place = vec3<f32>(ground_at(base), height - frame.anchor_height_m);
    return see(place, packed, vec3<f32>(1.0));
}
