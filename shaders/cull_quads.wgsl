// Control quads -> patch records: where each patch lies, how its edges are divided, whether it is seen.
// One invocation = one patch slot; total: lanes x slots_per_level. Every slot is written each frame.
// Twin: src/reference/cull_quads.rs; patch cutting and spans: src/quads.

override MORPH: bool = false;
override CULL: bool = true; // false draws every patch

@group(0) @binding(1) var<storage, read> control_points: array<u32>; // x | y << 16, samples from origin
@group(0) @binding(2) var<storage, read> control_quads: array<ControlQuad>;
@group(0) @binding(10) var<storage, read> quad_corners: array<u32>;  // SW, SE, NW, NE points, 8 bits each
@group(0) @binding(5) var<storage, read_write> patches: array<PatchRecord>;

fn control_point(lane: u32, ix: u32) -> vec2<i32> {
    let p = control_points[lane * CONTROL_POINTS + ix];
    return vec2<i32>(i32(p & 0xffffu), i32(p >> 16u));
}

// Span of the cells from `lo` to `hi` along an axis that lie on the finer ring: from | to << 5 | log2 << 10.
// The data's narrow last cell has no finer node inside and stays whole.
fn span(level: u32, lo: i32, hi: i32, ring_lo: i32, ring_hi: i32, last: i32, on_line: bool) -> u32 {
    let from_cell = max(lo, ring_lo);
    var to_cell = min(hi, ring_hi);
    if !on_line || to_cell <= from_cell {
        return 0u;
    }
    if ((2i * to_cell - 1i) << (level - 1u)) >= last {
        to_cell -= 1i;
    }
    if to_cell <= from_cell {
        return 0u;
    }
    return u32(from_cell - lo) | (u32(to_cell - lo) << 5u) | (1u << 10u);
}

// False only when the box lies wholly outside a plane (Assarsson and Moller 2000).
fn in_frustum(lo: vec3<f32>, hi: vec3<f32>) -> bool {
    for (var i = 0u; i < 5u; i++) {
        let plane = frame.planes[i];
        let term = plane.xyz * select(lo, hi, plane.xyz >= vec3<f32>(0.0));
        let sum = term.x + term.y + term.z + plane.w;
        let size = abs(term.x) + abs(term.y) + abs(term.z) + abs(plane.w);
        if sum < -1e-5 * size {
            return false;
        }
    }
    return true;
}

// What the chart beyond a side of a patch adds: doubling where it draws finer cells, whose vertices must lie
// in the patch's bounds. The current chart is the same before and after.
fn span_across(level: u32, side: u32, lo: vec2<i32>, hi: vec2<i32>, box: ptr<function, Box>) -> u32 {
    let home = current_chart();
    let last = node_of(level, data_last());
    let line = select(lo, hi, (side & 1u) == 1u);
    let border = select(vec2<i32>(0i), last, (side & 1u) == 1u);
    let on_border = select(line.y == border.y, line.x == border.x, side >= 2u);
    if !on_border || level == 0u {
        return 0u;
    }
    let length = select(data_last().x, data_last().y, side >= 2u);
    if !cross_over(side) {
        return 0u;
    }
    let entry = entry_side();
    var bits = 0u;
    if level > finest_level() {
        let fine = loaded(level - 1u);
        let fine_lo = base_of(level - 1u, fine.lo);
        let fine_hi = base_of(level - 1u, fine.hi);
        let far = data_last();
        var reaches = select(fine_lo.y == 0i, fine_hi.y == far.y, entry == 1u);
        if entry >= 2u {
            reaches = select(fine_lo.x == 0i, fine_hi.x == far.x, entry == 3u);
        }
        reaches = reaches && all(fine.hi > fine.lo);
        let ring = select(vec2<i32>(fine_lo.x, fine_hi.x), vec2<i32>(fine_lo.y, fine_hi.y), entry >= 2u);
        let ring_nodes = node_of(level, ring);
        let cells = select(vec2<i32>(lo.x, hi.x), vec2<i32>(lo.y, hi.y), side >= 2u);
        bits = span(level, cells.x, cells.y, ring_nodes.x, ring_nodes.y, length, reaches);
        if bits != 0u {
            // The border's nodes as the chart beyond counts them, one level finer.
            let along = vec2<i32>(2i * cells.x, min(2i * cells.y, (length + (1i << (level - 1u)) - 1i) >> (level - 1u)));
            let across = select(vec2<i32>(0i), node_of(level - 1u, far), (entry & 1u) == 1u);
            let from_node = select(vec2<i32>(along.x, across.y), vec2<i32>(across.x, along.x), entry >= 2u);
            let to_node = select(vec2<i32>(along.y, across.y), vec2<i32>(across.x, along.y), entry >= 2u);
            *box = joined(*box, box_over(level - 1u, from_node, to_node));
        }
    }
    enter_chart(home);
    return bits;
}

@compute @workgroup_size(64)
fn cull_quads(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    let lane = slot / frame.slots_per_level;
    if lane >= lane_count() {
        return;
    }
    let level = enter_lane(lane);
    let local = slot % frame.slots_per_level;
    var record: PatchRecord;
    if level < finest_level() {
        patches[slot] = record;
        return;
    }
    var quad_ix = 0u;
    for (var i = 1u; i < QUADS_PER_LEVEL; i++) {
        if control_quads[i].first_patch <= local {
            quad_ix = i;
        }
    }
    let quad = control_quads[quad_ix];
    let corners = quad_corners[lane * QUADS_PER_LEVEL + quad_ix];
    let is_finest = level == finest_level();
    let in_ring = quad.kind < KIND_L || (quad.kind == KIND_L && !is_finest) || (quad.kind == KIND_FILL && is_finest);
    let area = loaded(level);
    let k = local - quad.first_patch;
    let quad_lo = origin_of(level) + control_point(lane, corners & 0xffu);
    let quad_hi = origin_of(level) + control_point(lane, corners >> 24u);
    let start = quad_lo + vec2<i32>(vec2<u32>(k % quad.patches_east, k / quad.patches_east)) * PATCH_CELLS;
    let lo = max(start, area.lo);
    let hi = min(min(start + vec2<i32>(PATCH_CELLS), quad_hi), area.hi);
    if !in_ring || any(hi <= lo) {
        patches[slot] = record;
        return;
    }
    let base_lo = base_of(level, lo);
    let base_hi = base_of(level, hi);
    var box = box_over(level, lo, hi);
    var spans = vec4<u32>(0u); // south, north, west, east
    if !is_finest {
        let fine = loaded(level - 1u);
        let ring_lo = node_of(level, base_of(level - 1u, fine.lo));
        let ring_hi = node_of(level, base_of(level - 1u, fine.hi));
        let last = data_last();
        spans.x = span(level, lo.x, hi.x, ring_lo.x, ring_hi.x, last.x, lo.y == ring_lo.y || lo.y == ring_hi.y);
        spans.y = span(level, lo.x, hi.x, ring_lo.x, ring_hi.x, last.x, hi.y == ring_lo.y || hi.y == ring_hi.y);
        spans.z = span(level, lo.y, hi.y, ring_lo.y, ring_hi.y, last.y, lo.x == ring_lo.x || lo.x == ring_hi.x);
        spans.w = span(level, lo.y, hi.y, ring_lo.y, ring_hi.y, last.y, hi.x == ring_lo.x || hi.x == ring_hi.x);
        // Vertices on shared edges come from the finer level.
        box = joined(box, box_over(level - 1u, node_of(level - 1u, base_lo), node_of(level - 1u, base_hi)));
    }
    for (var side = 0u; side < 4u; side++) {
        let bits = span_across(level, side, lo, hi, &box);
        if bits != 0u {
            spans[side] = bits;
        }
    }
    record.outer_sn = spans.x | (spans.y << 16u);
    record.outer_we = spans.z | (spans.w << 16u);
    if MORPH {
        box = joined(box, coarse_box(level, base_lo, base_hi));
    }
    record.cell = lo;
    let cells = vec2<u32>(hi - lo);
    record.shape = cells.x | (cells.y << 8u) | (level << 16u) | (quad.kind << 24u) | (current_chart() << 28u);
    let all_void = box.lo.z > box.hi.z;
    let around = patch_box(box, level, base_lo, base_hi);
    let seen = !all_void && (!CULL || (in_frustum(around.lo, around.hi) && !over_the_horizon(around)));
    record.visible = select(0u, 1u, seen);
    patches[slot] = record;
}
