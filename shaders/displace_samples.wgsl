// Refill strips -> toroidal windows of samples. (On a plane the displaced sample is its height; the
// position is made of it in expand_patches.)
// Input: `staging`: four words a strip (level, x, y, width | height << 16), then all samples, strip after
// strip, row by row. One invocation = one sample; workgroup y = strip.
// Total: (largest strip / 64) x strips workgroups. Nothing to clear.

@group(0) @binding(11) var<storage, read> staging: array<u32>;
@group(0) @binding(3) var<storage, read_write> windows: array<f32>;

fn strip_samples(strip: u32) -> u32 {
    let size = staging[strip * 4u + 3u];
    return (size & 0xffffu) * (size >> 16u);
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
        first += strip_samples(s);
    }
    let width = staging[strip * 4u + 3u] & 0xffffu;
    let corner = vec2<i32>(bitcast<i32>(staging[strip * 4u + 1u]), bitcast<i32>(staging[strip * 4u + 2u]));
    let node = corner + vec2<i32>(i32(id.x % width), i32(id.x / width));
    windows[sample_address(staging[strip * 4u], node)] = bitcast<f32>(staging[first + id.x]);
}
