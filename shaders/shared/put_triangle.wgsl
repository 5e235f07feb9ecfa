// What both expansions write: triangles, and vertices that another chart may own.

override HAS_VOIDS: bool = false; // triangles that touch a void sample are collapsed

@group(0) @binding(9) var<storage, read_write> indices: array<u32>;

fn is_void(v: u32) -> bool {
    // Written by this workgroup before the barrier; the marker is put into the packed word.
    return vertices[v].packed == 0xffffffffu;
}

fn put_triangle(base: u32, at: u32, a: u32, b: u32, c: u32) {
    var t = vec3<u32>(a, b, c) + vec3<u32>(base);
    if is_mirrored() {
        t = t.xzy;
    }
    if HAS_VOIDS && (is_void(t.x) || is_void(t.y) || is_void(t.z)) {
        t = vec3<u32>(t.x); // collapsed: covers nothing, and the counts stay what they were
    }
    indices[at] = t.x;
    indices[at + 1u] = t.y;
    indices[at + 2u] = t.z;
}

// A vertex of the current chart; on a border it may belong to another.
fn put_owned(at: u32, own_level: u32, base: vec2<i32>, tag: u32, on_border: bool) {
    if !on_border {
        put_vertex(at, own_level, base, tag_at(tag, own_level, base));
        return;
    }
    let home = current_chart();
    let owner = owner_across(own_level, base);
    put_vertex(at, owner.level, owner.base, tag_at(tag, owner.level, owner.base));
    enter_chart(home);
}
