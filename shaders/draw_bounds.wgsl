// The boxes that visible patches are culled by, as lines: one instance a patch, 24 vertices for its 12 edges.
// What cull_quads adds along borders with other charts is left out.

override MORPH: bool = false;

@group(0) @binding(5) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(6) var<storage, read> visible_slots: array<u32>;

struct Edge {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat, either) level: u32,
}

// Corners of the edges, four along each axis: bit a of a corner says which end of axis a.
fn corner_of(vertex: u32) -> vec3<u32> {
    let axis = vertex / 8u;
    let edge = (vertex % 8u) / 2u;
    let end = vertex & 1u;
    let others = vec2<u32>(edge & 1u, edge >> 1u);
    switch axis {
        case 0u: { return vec3<u32>(end, others); }
        case 1u: { return vec3<u32>(others.x, end, others.y); }
        default: { return vec3<u32>(others, end); }
    }
}

@vertex
fn vs_bounds(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Edge {
    let slot = visible_slots[instance];
    let record = patches[slot];
    let level = enter_lane(slot / frame.slots_per_level);
    let size = vec2<i32>(vec2<u32>(record.shape & 0xffu, (record.shape >> 8u) & 0xffu));
    let lo = record.cell;
    let hi = record.cell + size;
    let base_lo = base_of(level, lo);
    let base_hi = base_of(level, hi);
    var box = box_over(level, lo, hi);
    if MORPH {
        box = joined(box, coarse_box(level, base_lo, base_hi));
    }
    box = patch_box(box, level, base_lo, base_hi);
    let at = select(box.lo, box.hi, corner_of(vertex) == vec3<u32>(1u));
    return Edge(clip_position(at), level);
}

@fragment
fn fs_bounds(edge: Edge) -> @location(0) vec4<f32> {
    return vec4<f32>(palette(edge.level), 1.0);
}
