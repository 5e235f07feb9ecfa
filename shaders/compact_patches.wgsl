// Visible patch records -> dense list, each with its place in the vertex and index buffers, and the
// arguments of the indirect dispatch and draws. One workgroup walks all slots in order, so the mesh is
// the same bit for bit whenever the camera is: atomics would leave the order to chance.
// Total: 64 invocations, slots / 64 records each. All counters are written, nothing to clear.

@group(0) @binding(5) var<storage, read_write> patches: array<PatchRecord>;
@group(0) @binding(6) var<storage, read_write> visible_slots: array<u32>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;

const THREADS = 64u;

struct Need {
    vertices: u32,
    indices: u32,
    patches: u32,
}

var<workgroup> needs: array<Need, THREADS>;
var<workgroup> fitting_patches: atomic<u32>;
var<workgroup> fitting_indices: atomic<u32>;

fn need_of(record: PatchRecord) -> Need {
    let needs = needs_of(record);
    return Need(needs.x, 3u * needs.y, 1u);
}

fn is_seen(slot: u32) -> bool {
    return (patches[slot].visible & 1u) == 1u;
}

@compute @workgroup_size(64)
fn compact_patches(@builtin(local_invocation_index) thread: u32) {
    let total = lane_count() * frame.slots_per_level;
    let share = (total + THREADS - 1u) / THREADS;
    let begin = min(thread * share, total);
    let end = min(begin + share, total);
    var mine = Need(0u, 0u, 0u);
    for (var slot = begin; slot < end; slot++) {
        if is_seen(slot) {
            let need = need_of(patches[slot]);
            mine = Need(mine.vertices + need.vertices, mine.indices + need.indices, mine.patches + 1u);
        }
    }
    needs[thread] = mine;
    workgroupBarrier();
    var before = Need(0u, 0u, 0u);
    for (var t = 0u; t < thread; t++) {
        let n = needs[t];
        before = Need(before.vertices + n.vertices, before.indices + n.indices, before.patches + n.patches);
    }
    var at = before;
    for (var slot = begin; slot < end; slot++) {
        if is_seen(slot) {
            let need = need_of(patches[slot]);
            patches[slot].first_vertex = at.vertices;
            patches[slot].first_index = at.indices;
            let after = Need(at.vertices + need.vertices, at.indices + need.indices, at.patches + 1u);
            // Offsets only grow, so whatever fits precedes whatever does not.
            if after.vertices <= frame.vertex_capacity && after.indices <= frame.index_capacity {
                visible_slots[at.patches] = slot;
                atomicAdd(&fitting_patches, 1u);
                atomicAdd(&fitting_indices, need.indices);
            }
            at = after;
        }
    }
    workgroupBarrier();
    if thread == THREADS - 1u {
        let drawn = atomicLoad(&fitting_patches);
        let indices = atomicLoad(&fitting_indices);
        counters.index_count = indices;
        counters.instance_count = 1u;
        counters.first_index = 0u;
        counters.base_vertex = 0i;
        counters.first_instance = 0u;
        counters.wire_vertex_count = indices;
        counters.wire_instance_count = 1u;
        counters.wire_first_vertex = 0u;
        counters.wire_first_instance = 0u;
        counters.expand_x = drawn;
        counters.expand_y = 1u;
        counters.expand_z = 1u;
        counters.vertices_needed = at.vertices;
        counters.indices_needed = at.indices;
        counters.patches_visible = at.patches;
        counters.patches_dropped = at.patches - drawn;
    }
}
