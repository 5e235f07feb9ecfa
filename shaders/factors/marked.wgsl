// What a patch leaves out: the worst of its nodes that are not drawn, or what its level does not hold.

@group(0) @binding(24) var<storage, read> leaves: array<u32>;

fn left_out_m(slot: u32, block: u32, level: u32, cells: vec2<u32>) -> f32 {
    let finest = deviation(block, 0u);
    if finest == VOID {
        return VOID;
    }
    var worst = 0u;
    for (var y = 0u; y <= cells.y; y++) {
        let row = leaves[slot * NODE_WORDS + 8u + y];
        for (var x = 0u; x <= cells.x; x++) {
            if ((row >> x) & 1u) == 0u {
                worst = max(worst, code_at(block, vec2<u32>(x, y)));
            }
        }
    }
    let top = f32(bitcast<i32>(grades[GRADE_WORDS * block]));
    let metres = exp2((top + f32(worst) - 254.0) / BINS_PER_OCTAVE) * 1.00001;
    return max(finest + bend_m(level), select(0.0, metres, worst > 0u));
}
