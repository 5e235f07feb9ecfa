// Where the expansion writes its vertices.

@group(0) @binding(8) var<storage, read_write> vertices: array<Vertex>;

// Writes one vertex: the sample of `owner` at `base`; a void one is marked.
fn put_vertex(at: u32, owner: u32, base: vec2<i32>, tag: u32) {
    let height = vertex_height(owner, base);
    let ground = ground_at(base);
    var vertex = Vertex(ground.x, ground.y, height - frame.anchor_height_m, tag);
    if HAS_VOIDS && height == VOID {
        vertex.z = 0.0;
        vertex.packed = 0xffffffffu;
    } else if NORMALS {
        vertex.packed |= packed_normal(owner, base);
    }
    vertices[at] = vertex;
}
