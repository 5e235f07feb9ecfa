// Bounds of a block on a plane: its lowest and highest height, (VOID, -VOID) when there is none.

@group(0) @binding(3) var<storage, read> samples: array<f32>;
@group(0) @binding(4) var<storage, read_write> block_bounds: array<vec2<f32>>;

fn bound_block(level: u32, block: vec2<i32>, lo: vec2<i32>, hi: vec2<i32>) {
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
