// Samples of the windows -> lowest and highest height of every block of 16 x 16 cells.
// One invocation = one block (x, y; z = level); levels that did not move are skipped. A moved level is
// done whole: its border blocks must not remember samples that left, or culling would depend on history.
// Total: (n + 1)^2 / 64 x levels invocations. Nothing to clear; a block outside holds (VOID, -VOID).

@group(0) @binding(3) var<storage, read> samples: array<f32>;
@group(0) @binding(4) var<storage, read_write> block_bounds: array<vec2<f32>>;

@compute @workgroup_size(8, 8)
fn bound_blocks(@builtin(global_invocation_id) id: vec3<u32>) {
    let side = block_side();
    let level = id.z;
    if id.x >= side || id.y >= side || (frame.shifted_levels & (1u << level)) == 0u {
        return;
    }
    let area = loaded(level);
    // The one block of the window with this toroidal address, if there is one.
    let first = frame.origins[level].xy >> vec2<u32>(4u);
    let offset = (vec2<i32>(id.xy) - first) & vec2<i32>(i32(side) - 1i);
    let block = first + offset;
    let lo = max(block * PATCH_CELLS, area.lo);
    let hi = min(block * PATCH_CELLS + vec2<i32>(PATCH_CELLS), area.hi);
    var range = vec2<f32>(VOID, -VOID);
    for (var y = lo.y; y <= hi.y; y++) {
        for (var x = lo.x; x <= hi.x; x++) {
            let h = samples[sample_address(level, vec2<i32>(x, y))];
            if h != VOID {
                range = vec2<f32>(min(range.x, h), max(range.y, h));
            }
        }
    }
    block_bounds[block_address(level, block)] = range;
}
