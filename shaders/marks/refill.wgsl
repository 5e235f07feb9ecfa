// Vertices are marked whose samples this frame brought: inside their level's window, and outside what it held
// before.

// By lane: low and high node held before, hi < lo where there were none.
@group(0) @binding(21) var<uniform> held_before: array<vec4<i32>, 144>;

fn tag_of(record: PatchRecord) -> u32 {
    return 0u;
}

fn tag_at(tag: u32, level: u32, base: vec2<i32>) -> u32 {
    let before = held_before[lane_of(level)];
    let node = node_of(level, base);
    return select(0xff000000u, 0u, all(node >= before.xy) && all(node <= before.zw));
}
