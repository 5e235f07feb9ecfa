// Blocks' deviations -> thresholds: at which screen-space error each step of a patch may be taken. One invocation
// = one patch slot; total: lanes x slots_per_level. Seen or not, because seen patches share edges with unseen
// ones. Also clears the weights for the next pass.
// Held against the formula in f64: tests/factors.rs.

@group(0) @binding(5) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(18) var<storage, read> deviations: array<u32>; // three words a block
@group(0) @binding(19) var<storage, read_write> wishes: array<u32>; // thresholds of steps 2, 4, 8, 16, eight bits each
@group(0) @binding(20) var<storage, read_write> weights: array<i32>;

const WEIGHTS = 256u;
const UNKNOWN = 0x7f7f0000u; // bits of a deviation that is not known

fn joined(a: Box, b: Box) -> Box {
    return Box(min(a.lo, b.lo), max(a.hi, b.hi));
}

fn deviation(block: u32, k: u32) -> f32 {
    let word = deviations[3u * block + k / 2u];
    let bits = select(word << 16u, word & 0xffff0000u, (k & 1u) == 1u);
    return select(bitcast<f32>(bits), VOID, bits >= UNKNOWN);
}

// Most pixels that a metre of deviation anywhere in a box may take of the picture. A point p shows at
// (row . p) / w; its derivative along a direction is (row . direction - ndc (w_row . direction)) / w: moved_px()
// bounds it for the directions there are. Points out of the picture do not count: ndc is cut to it, and what is
// seen is no nearer, along the view, than its distance allows.
fn px_per_m(box: Box) -> f32 {
    let m = transpose(frame.clip_from_near);
    let eye = frame.eye_from_anchor_m;
    let lo = box.lo - eye;
    let hi = box.hi - eye;
    let away = length(max(max(lo, -hi), vec3<f32>(0.0)));
    let corner = sqrt(1.0 + 1.0 / dot(m[0].xyz, m[0].xyz) + 1.0 / dot(m[1].xyz, m[1].xyz));
    var nearest = VOID;
    var least = vec2<f32>(VOID);
    var most = vec2<f32>(-VOID);
    for (var c = 0u; c < 8u; c++) {
        let pick = (vec3<u32>(c) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u);
        let p = select(lo, hi, pick == vec3<u32>(1u));
        let w = dot(m[3].xyz, p);
        nearest = min(nearest, w);
        let ndc = vec2<f32>(dot(m[0].xyz, p), dot(m[1].xyz, p)) / max(w, 1e-30);
        least = min(least, ndc);
        most = max(most, ndc);
    }
    // A box that reaches behind the eye may show anywhere.
    let whole = nearest <= 0.0;
    least = select(clamp(least, vec2<f32>(-1.0), vec2<f32>(1.0)), vec2<f32>(-1.0), whole);
    most = select(clamp(most, vec2<f32>(-1.0), vec2<f32>(1.0)), vec2<f32>(1.0), whole);
    let w = max(nearest, away / corner);
    let px = max(moved_px(m, least), moved_px(m, most));
    // Rounding must never make it less.
    return length(px * choice.half_px) * 1.0001 / max(w, 1e-30);
}

// However large an error is, a budget may ask for it: the scale's top is the coarsest mesh there is.
fn bin_of(px: f32) -> u32 {
    if !(px < 1e30) {
        return COARSEST;
    }
    let bin = ceil(log2(max(px, 1e-30) / choice.reference_px) * BINS_PER_OCTAVE + choice.reference_bin + 1e-3);
    return u32(clamp(bin, 0.0, f32(COARSEST)));
}

@compute @workgroup_size(64)
fn wish_factors(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    for (var w = id.x; w < WEIGHTS; w += groups.x * 64u) {
        weights[w] = 0i;
    }
    let slot = id.x;
    if slot >= lane_count() * frame.slots_per_level || patches[slot].shape == 0u {
        return;
    }
    let seat = seat_of(slot, patches[slot]);
    let level = seat.level;
    let block = seat.block;
    let address = table_address(level, block);
    var box = patch_box(box_over(level, seat.lo, seat.hi), level, base_of(level, seat.lo), base_of(level, seat.hi));
    // The true surface, which the error is measured on, lies no further off than this.
    let off = deviation(address, 0u);
    let scale = px_per_m(widened(box, off));
    var bins = vec4<u32>(0u);
    for (var k = 1u; k <= 4u; k++) {
        let metres = deviation(address, k);
        bins[k - 1u] = select(bin_of((metres + bend_m(level + k)) * scale), NEVER, metres == VOID);
    }
    // Beside a finer level halves of a side differ: a step must not span both.
    for (var side = 0u; side < 4u; side++) {
        for (var half = 0u; half < 2u; half++) {
            let next = beyond(level, block, side, half);
            if next.found && next.level < level {
                bins.w = NEVER;
            }
        }
    }
    wishes[address] = bins.x | (bins.y << 8u) | (bins.z << 16u) | (bins.w << 24u);
}
