// Blocks' deviations -> thresholds: at which screen-space error each step of a patch may be taken. One invocation
// = one patch slot; total: lanes x slots_per_level. Seen or not, because seen patches share edges with unseen
// ones. Also clears the weights for the next pass.
// Held against the formula in f64: tests/factors.rs.

@group(0) @binding(5) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(19) var<storage, read_write> wishes: array<u32>; // thresholds of steps 2, 4, 8, 16, eight bits each
@group(0) @binding(20) var<storage, read_write> weights: array<i32>;

const WEIGHTS = 256u;

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
