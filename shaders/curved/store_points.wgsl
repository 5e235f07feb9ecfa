// Samples that are positions already: offsets from their block's anchor, in the level's units.

const WORDS_PER_SAMPLE = 3u;

@group(0) @binding(3) var<storage, read_write> windows: array<vec4<i32>>;

fn store_sample(level: u32, node: vec2<i32>, first: u32, k: u32) {
    let at = first + 3u * k;
    let offset = bitcast<vec3<i32>>(vec3<u32>(staging[at], staging[at + 1u], staging[at + 2u]));
    let anchor = anchor_of(level, node);
    // World height: the anchor's own, then the offset; for the colours only.
    let unit = curve.levels[level].unit_m;
    let high = f32(anchors[anchor].z) * (unit * 16777216.0);
    let height = high + f32(anchors[anchor + 1u].z + offset.z) * unit;
    let shade = i32(shade_of(vec3<f32>(0.0, 0.0, 1.0), height));
    windows[sample_address(level, node)] = vec4<i32>(offset, select(shade, 0i, offset.x == VOID_POSITION));
}
