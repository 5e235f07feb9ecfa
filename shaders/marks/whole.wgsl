// Where factors are uniform, nothing is left out of a patch but what its level does not hold.

fn left_out_m(slot: u32, block: u32, level: u32, cells: vec2<u32>) -> f32 {
    let finest = deviation(block, 0u);
    return select(finest + bend_m(level), VOID, finest == VOID);
}
