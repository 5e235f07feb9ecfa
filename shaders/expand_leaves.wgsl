// Visible patches whose vertices were chosen by error -> vertices and triangles. One workgroup = one patch; its 64
// invocations share its nodes, then the places of its sides. Total: 64 x visible patches. Nothing to clear.
// Which triangles: factors/leaves.wgsl. Twin: src/reference/expand_leaves.rs.

@group(0) @binding(6) var<storage, read> visible_slots: array<u32>;

const THREADS = 64u;

// Lists what the masks of a patch hold: a bit after the other, so that all invocations share it alike.
fn list_bits(bits: u32, first: u32, word: u32, is_leaf: bool) {
    var left = bits;
    var at = first;
    while left != 0u {
        let entry = word | countTrailingZeros(left);
        if is_leaf { leaf_list[at] = entry; } else { node_list[at] = entry; }
        left &= left - 1u;
        at++;
    }
}

@compute @workgroup_size(64)
fn expand_leaves(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let slot = visible_slots[group.x];
    let head = slot * NODE_WORDS;
    let leaf = lane_count() * frame.slots_per_level * NODE_WORDS + slot * LEAF_WORDS;
    let cell = bitcast<vec2<i32>>(vec2<u32>(leaves[head], leaves[head + 1u]));
    let shape = leaves[head + 2u];
    let size = vec2<u32>(shape & 0xffu, (shape >> 8u) & 0xffu);
    let level = (shape >> 16u) & 0xffu;
    let tag = tag_of(PatchRecord(cell, shape, 0u, 0u, 0u, 0u, leaves[head + 3u]));
    let first_vertex = leaves[head + 4u];
    let first_index = leaves[head + 5u];
    enter_chart(shape >> 28u);
    remember(level);
    if thread == 0u {
        cells = size;
    }
    if thread < SIDE_NODES {
        // Rows beyond the data own nothing.
        let row = leaves[head + 8u + thread] | (leaves[leaf + 68u + thread] << 17u);
        own_rows[thread] = select(0u, row, thread <= size.y);
    }
    if thread < 4u {
        let word = leaves[leaf + 85u + thread];
        own_sides[thread] = word & 0x1ffffu;
        side_starts[thread] = word >> 24u;
        side_extras[thread] = leaves[head + 25u + thread];
    }
    for (var y = thread; y <= size.y; y += THREADS) {
        let starts = leaves[leaf + 68u + y];
        list_bits(leaves[head + 8u + y], starts & 0xffffu, y << 5u, false);
        var first = starts >> 16u;
        for (var k = 0u; k < 4u; k++) {
            let mask = leaves[leaf + 4u * y + k];
            list_bits(mask, first, (y << 5u) | (k << 10u), true);
            first += countOneBits(mask);
        }
    }
    workgroupBarrier();
    let grid = grid_size();
    let extras = leaves[head + 6u] - grid;
    let leaf_count = leaves[head + 7u] - extras;
    // Own nodes, then extras.
    for (var v = thread; v < grid + extras; v += THREADS) {
        let is_extra = v >= grid;
        let e = max(v, grid) - grid;
        let side = u32(e >= side_starts[1]) + u32(e >= side_starts[2]) + u32(e >= side_starts[3]);
        let entry = node_list[min(v, grid - 1u)];
        let node = select(vec2<u32>(entry & 31u, entry >> 5u), on_side_of(side, 0u, size), is_extra);
        var base = base_of(level, cell + vec2<i32>(node));
        let far = select(0i, i32((nth_extra(side, e - side_starts[side]) << level) >> 1u), is_extra);
        base += select(vec2<i32>(far, 0i), vec2<i32>(0i, far), side >= 2u);
        // Only those on a border with another chart may be vertices of that one.
        let on_border = is_glued() && (any(base == vec2<i32>(0i)) || any(base == data_last()));
        put_owned(first_vertex + v, owner_of(level, base), base, tag, on_border);
    }
    if HAS_VOIDS {
        storageBarrier();
    }
    for (var t = thread; t < leaf_count; t += THREADS) {
        let corners = leaf_corners(leaf_list[t]);
        put_triangle(first_vertex, first_index + 3u * t, corners.x, corners.y, corners.z);
    }
    for (var e = thread; e < extras; e += THREADS) {
        let corners = extra_corners(e);
        put_triangle(first_vertex, first_index + 3u * (leaf_count + e), corners.x, corners.y, corners.z);
    }
}
