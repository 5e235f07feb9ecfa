// Blocks -> wishes: bins by which the codes of a block's nodes move on the scale of thresholds, from how large a metre
// shows on screen there. One invocation = one patch slot; total: lanes x slots_per_level. Seen or not, because
// seen patches share edges with unseen ones. Also clears the weights for the next pass.
// Held against what is drawn, pixel by pixel: tests/factors.rs.

@group(0) @binding(5) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(19) var<storage, read_write> wishes: array<i32>;
@group(0) @binding(20) var<storage, read_write> weights: array<i32>;
@group(0) @binding(22) var<storage, read> grades: array<u32>;

const WEIGHTS = 1024u;

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
    let address = table_address(level, seat.block);
    let box = patch_box(box_over(level, seat.lo, seat.hi), level, base_of(level, seat.lo), base_of(level, seat.hi));
    // The true surface, which the error is measured on, lies no further off than this.
    let scale = px_per_m(widened(box, deviation(address, 0u)));
    let octaves = log2(clamp(scale / choice.reference_px, 1e-30, 1e30));
    // However large an error is, a budget may ask for it: bins are cut to the scale only where they are compared.
    let shown = i32(ceil(octaves * BINS_PER_OCTAVE + choice.reference_bin + 1e-3));
    // Beside a finer level that one's samples, which the block does not have, stand on its sides: leaves fanned to them
    // may deviate by figure 0 once more. What is coded is no less than figure 0, so twice all of it is enough.
    var beside_finer = false;
    for (var k = 0u; k < 8u; k++) {
        let next = beyond(level, seat.block, k / 2u, k & 1u);
        beside_finer = beside_finer || (next.found && next.level < level);
    }
    let shift = shown + select(0i, i32(BINS_PER_OCTAVE), beside_finer);
    wishes[address] = bitcast<i32>(grades[GRADE_WORDS * address]) + shift;
}
