// Visible patches -> their marks: bounds on their screen-space error, for the colouring that shows it. One
// invocation = one patch slot; total: lanes x slots_per_level.
// Held against measured errors: tests/views.rs.

@group(0) @binding(5) var<storage, read_write> patches: array<PatchRecord>;

// 1/16 px to 16 px on a scale of logarithms; all under is 0, all over the last one.
const LEAST_LOG2_PX = -4.0;
const MARKS_PER_OCTAVE = 31.75; // 254 over eight octaves
const LAST_MARK = 254u;
const NOT_KNOWN = 255u;

@compute @workgroup_size(64)
fn mark_patches(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= lane_count() * frame.slots_per_level || patches[slot].visible != 1u {
        return;
    }
    let record = patches[slot];
    let seat = seat_of(slot, record);
    let level = seat.level;
    let address = table_address(level, seat.block);
    let box = patch_box(box_over(level, seat.lo, seat.hi), level, base_of(level, seat.lo), base_of(level, seat.hi));
    // The true surface, which the error is measured on, lies no further off than this.
    let scale = px_per_m(widened(box, deviation(address, 0u)));
    let metres = left_out_m(slot, address, level, vec2<u32>(seat.hi - seat.lo));
    var mark = NOT_KNOWN;
    if metres != VOID {
        let px = metres * scale;
        let at = (log2(clamp(px, 1e-6, 1e6)) - LEAST_LOG2_PX) * MARKS_PER_OCTAVE;
        mark = u32(clamp(ceil(at), 0.0, f32(LAST_MARK)));
    }
    patches[slot].visible = 1u | (mark << 8u);
}
