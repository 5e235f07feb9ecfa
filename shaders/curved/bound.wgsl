// Bounds of a block on a curved surface: the box around its positions, in 2^BOX_BITS of the level's units
// from the anchor of its first node's block, rounded outwards; lo > hi when all of them are void.

@group(0) @binding(3) var<storage, read> samples: array<vec4<i32>>;
@group(0) @binding(4) var<storage, read_write> block_bounds: array<vec4<i32>>;

fn bound_block(level: u32, block: vec2<i32>, lo: vec2<i32>, hi: vec2<i32>) {
    var low = vec3<i32>(2147483647i);
    var high = vec3<i32>(-2147483647i);
    let home = anchor_of(level, lo);
    for (var y = lo.y; y <= hi.y; y++) {
        for (var x = lo.x; x <= hi.x; x++) {
            let node = vec2<i32>(x, y);
            let sample = samples[sample_address(level, node)].xyz;
            if sample.x != VOID_POSITION {
                let at = coarse_offset(home, anchor_of(level, node), sample);
                low = min(low, at);
                high = max(high, at + vec3<i32>(2i));
            }
        }
    }
    let address = 2u * block_address(level, block);
    block_bounds[address] = vec4<i32>(low, 0i);
    block_bounds[address + 1u] = vec4<i32>(high, 0i);
}
