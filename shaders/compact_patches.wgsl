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
}

var<workgroup> seen: array<u32, THREADS>;
var<workgroup> needs: array<Need, THREADS>;
var<workgroup> fitting_patches: atomic<u32>;
var<workgroup> fitting_indices: atomic<u32>;

fn need_of(record: PatchRecord) -> Need {
    let needs = needs_of(record);
    return Need(needs.x, 3u * needs.y);
}

fn is_seen(slot: u32) -> bool {
    return (patches[slot].visible & 1u) == 1u;
}

// What a thread takes of `total`: first, and one past the last.
fn share(total: u32, thread: u32) -> vec2<u32> {
    let each = (total + THREADS - 1u) / THREADS;
    return min(vec2<u32>(thread * each, (thread + 1u) * each), vec2<u32>(total));
}

@compute @workgroup_size(64)
fn compact_patches(@builtin(local_invocation_index) thread: u32) {
    // Slots first, records then: most slots are not seen, and every thread would walk through all it takes of them.
    let slots = share(lane_count() * frame.slots_per_level, thread);
    var count = 0u;
    for (var slot = slots.x; slot < slots.y; slot++) {
        count += u32(is_seen(slot));
    }
    seen[thread] = count;
    if thread == 0u {
        atomicStore(&fitting_patches, 0u);
        atomicStore(&fitting_indices, 0u);
    }
    workgroupBarrier();
    var place = 0u;
    var total = 0u;
    for (var t = 0u; t < THREADS; t++) {
        place += select(0u, seen[t], t < thread);
        total += seen[t];
    }
    for (var slot = slots.x; slot < slots.y; slot++) {
        if is_seen(slot) {
            visible_slots[place] = slot;
            place++;
        }
    }
    storageBarrier();
    let mine = share(total, thread);
    var sum = Need(0u, 0u);
    for (var k = mine.x; k < mine.y; k++) {
        let need = need_of(patches[visible_slots[k]]);
        sum = Need(sum.vertices + need.vertices, sum.indices + need.indices);
    }
    needs[thread] = sum;
    workgroupBarrier();
    var at = Need(0u, 0u);
    for (var t = 0u; t < thread; t++) {
        at = Need(at.vertices + needs[t].vertices, at.indices + needs[t].indices);
    }
    for (var k = mine.x; k < mine.y; k++) {
        let slot = visible_slots[k];
        let need = need_of(patches[slot]);
        let from_need = at;
        at = Need(at.vertices + need.vertices, at.indices + need.indices);
        // Offsets only grow, so whatever fits precedes whatever does not.
        let fits = at.vertices <= frame.vertex_capacity && at.indices <= frame.index_capacity;
        put_places(slot, from_need.vertices, from_need.indices, fits);
        if fits {
            atomicAdd(&fitting_patches, 1u);
            atomicAdd(&fitting_indices, need.indices);
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
        counters.patches_visible = total;
        counters.patches_dropped = total - drawn;
    }
}
