// Control quads -> patch records: where each patch lies, how its edges are divided, whether it is seen.
// One invocation = one patch slot; total: levels x slots_per_level. Every slot is written each frame.
// Twin: src/reference/cull_quads.rs; patch cutting and spans: src/quads.

override MORPH: bool = false;

@group(0) @binding(1) var<storage, read> control_points: array<u32>; // x | y << 16, samples from origin
@group(0) @binding(2) var<storage, read> control_quads: array<ControlQuad>;
@group(0) @binding(10) var<storage, read> quad_corners: array<u32>;  // SW, SE, NW, NE points, 8 bits each
@group(0) @binding(4) var<storage, read> block_bounds: array<vec2<f32>>;
@group(0) @binding(5) var<storage, read_write> patches: array<PatchRecord>;

fn control_point(level: u32, ix: u32) -> vec2<i32> {
    let p = control_points[level * CONTROL_POINTS + ix];
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

// Range of heights of all blocks that touch a rectangle of a level's nodes.
fn range_over(level: u32, rect_lo: vec2<i32>, rect_hi: vec2<i32>) -> vec2<f32> {
    let area = loaded(level);
    let lo = max(rect_lo, area.lo);
    let hi = min(rect_hi, area.hi);
    var range = vec2<f32>(VOID, -VOID);
    if any(hi < lo) {
        return range;
    }
    // Blocks are closed: one whose far border is our near one need not be read, unless we are that border.
    let first = lo >> vec2<u32>(4u);
    let last = max(first, (hi - vec2<i32>(1i)) >> vec2<u32>(4u));
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let r = block_bounds[block_address(level, vec2<i32>(x, y))];
            range = vec2<f32>(min(range.x, r.x), max(range.y, r.y));
        }
    }
    return range;
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

@compute @workgroup_size(64)
fn cull_quads(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    let level = slot / frame.slots_per_level;
    if level >= frame.level_count {
        return;
    }
    let local = slot % frame.slots_per_level;
    var record: PatchRecord;
    var quad_ix = 0u;
    for (var i = 1u; i < QUADS_PER_LEVEL; i++) {
        if control_quads[i].first_patch <= local {
            quad_ix = i;
        }
    }
    let quad = control_quads[quad_ix];
    let corners = quad_corners[level * QUADS_PER_LEVEL + quad_ix];
    let is_finest = level == frame.finest;
    let in_ring = quad.kind < KIND_L || (quad.kind == KIND_L && !is_finest) || (quad.kind == KIND_FILL && is_finest);
    let area = loaded(level);
    let k = local - quad.first_patch;
    let quad_lo = frame.origins[level].xy + control_point(level, corners & 0xffu);
    let quad_hi = frame.origins[level].xy + control_point(level, corners >> 24u);
    let start = quad_lo + vec2<i32>(vec2<u32>(k % quad.patches_east, k / quad.patches_east)) * PATCH_CELLS;
    let lo = max(start, area.lo);
    let hi = min(min(start + vec2<i32>(PATCH_CELLS), quad_hi), area.hi);
    if level < frame.finest || !in_ring || any(hi <= lo) {
        patches[slot] = record;
        return;
    }
    let base_lo = base_of(level, lo);
    let base_hi = base_of(level, hi);
    var range = range_over(level, lo, hi);
    if level > frame.finest {
        let fine = loaded(level - 1u);
        let ring_lo = node_of(level, base_of(level - 1u, fine.lo));
        let ring_hi = node_of(level, base_of(level - 1u, fine.hi));
        let south = span(level, lo.x, hi.x, ring_lo.x, ring_hi.x, frame.last.x, lo.y == ring_lo.y || lo.y == ring_hi.y);
        let north = span(level, lo.x, hi.x, ring_lo.x, ring_hi.x, frame.last.x, hi.y == ring_lo.y || hi.y == ring_hi.y);
        let west = span(level, lo.y, hi.y, ring_lo.y, ring_hi.y, frame.last.y, lo.x == ring_lo.x || lo.x == ring_hi.x);
        let east = span(level, lo.y, hi.y, ring_lo.y, ring_hi.y, frame.last.y, hi.x == ring_lo.x || hi.x == ring_hi.x);
        record.outer_sn = south | (north << 16u);
        record.outer_we = west | (east << 16u);
        // Vertices on shared edges come from the finer level.
        let r = range_over(level - 1u, node_of(level - 1u, base_lo), node_of(level - 1u, base_hi));
        range = vec2<f32>(min(range.x, r.x), max(range.y, r.y));
    }
    if MORPH && level + 1u < frame.level_count {
        let coarse_lo = (base_lo >> vec2<u32>(level + 1u)) - vec2<i32>(1i);
        let coarse_hi = (base_hi >> vec2<u32>(level + 1u)) + vec2<i32>(2i);
        let r = range_over(level + 1u, coarse_lo, coarse_hi);
        range = vec2<f32>(min(range.x, r.x), max(range.y, r.y));
    }
    record.cell = lo;
    let cells = vec2<u32>(hi - lo);
    record.shape = cells.x | (cells.y << 8u) | (level << 16u) | (quad.kind << 24u);
    let all_void = range.x > range.y;
    let box_lo = vec3<f32>(vec2<f32>(base_lo - frame.anchor) * frame.spacing_m, range.x - frame.anchor_height_m);
    let box_hi = vec3<f32>(vec2<f32>(base_hi - frame.anchor) * frame.spacing_m, range.y - frame.anchor_height_m);
    let seen = !all_void && (frame.cull == 0u || in_frustum(box_lo, box_hi));
    record.visible = select(0u, 1u, seen);
    patches[slot] = record;
}
