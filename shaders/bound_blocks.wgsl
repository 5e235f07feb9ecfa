// Samples of the windows -> bounds of every block: of heights over 16 x 16 cells on a plane, boxes around
// 4 x 4 cells on curved surfaces. One invocation = one block (x, y; z = lane); lanes that did not move are skipped. A moved one is
// done whole: its border blocks must not remember samples that left, or culling would depend on history.
// Total: (n + 1)^2 / 64 x lanes invocations on a plane, 16 times as many on curved surfaces. Nothing to clear; a block outside holds empty bounds.

@compute @workgroup_size(8, 8)
fn bound_blocks(@builtin(global_invocation_id) id: vec3<u32>) {
    let side = block_side();
    let level = enter_lane(id.z);
    if id.x >= side || id.y >= side || !is_shifted(level) {
        return;
    }
    let area = loaded(level);
    // The one block of the window with this toroidal address, if there is one.
    let first = origin_of(level) >> vec2<u32>(BOUNDS_SHIFT);
    let offset = (vec2<i32>(id.xy) - first) & vec2<i32>(i32(side) - 1i);
    let block = first + offset;
    let lo = max(block * BOUNDS_CELLS, area.lo);
    let hi = min(block * BOUNDS_CELLS + vec2<i32>(BOUNDS_CELLS), area.hi);
    bound_block(level, block, lo, hi);
}
