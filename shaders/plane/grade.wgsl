// What nodes are measured by on a plane: their heights over the block's first node, because f32 has few bits left for
// what deviates where ground is high.

@group(0) @binding(3) var<storage, read> samples: array<f32>;

const AXES = 1u;

fn measured(level: u32, home: vec2<i32>, node: vec2<i32>, axis: u32) -> f32 {
    let height = samples[sample_address(level, node)];
    let first = samples[sample_address(level, home)];
    return select(height - select(first, 0.0, first == VOID), VOID, height == VOID);
}
