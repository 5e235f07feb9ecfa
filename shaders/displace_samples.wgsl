// Refill strips -> toroidal windows of samples: of heights on a plane, of positions on curved surfaces.
// Input: `staging`: four words a strip (lane, x, y, width | height << 16), then all samples, strip after
// strip, row by row, each strip from a whole word on. One invocation = one sample; workgroup y = strip.
// Total: (largest strip / 64) x strips workgroups. Nothing to clear.

override SHORT: bool = false; // two bytes a sample, in units of Frame.sample_step_m

@group(0) @binding(11) var<storage, read> staging: array<u32>;

fn strip_samples(strip: u32) -> u32 {
    let size = staging[strip * 4u + 3u];
    return (size & 0xffffu) * (size >> 16u);
}

// Height k of the strip that begins at word `first`.
fn staged_height(first: u32, k: u32) -> f32 {
    if !SHORT {
        return bitcast<f32>(staging[first + k]);
    }
    let short = extractBits(bitcast<i32>(staging[first + (k >> 1u)]), (k & 1u) * 16u, 16u);
    return select(f32(short) * frame.sample_step_m, VOID, short == -32768i);
}

@compute @workgroup_size(64)
fn displace_samples(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let strip = id.y;
    if id.x >= strip_samples(strip) {
        return;
    }
    var first = 4u * groups.y;
    for (var s = 0u; s < strip; s++) {
        let count = strip_samples(s);
        first += select(count * WORDS_PER_SAMPLE, (count + 1u) >> 1u, SHORT);
    }
    let width = staging[strip * 4u + 3u] & 0xffffu;
    let corner = vec2<i32>(bitcast<i32>(staging[strip * 4u + 1u]), bitcast<i32>(staging[strip * 4u + 2u]));
    let node = corner + vec2<i32>(i32(id.x % width), i32(id.x / width));
    let level = enter_lane(staging[strip * 4u]);
    store_sample(level, node, first, id.x);
}
