// Heights over an analytic surface -> positions. A block's record holds the surface about its middle
// (src/surface/blocks.rs): the linear part in integers, so that it is exact; the rest, which is small, as a
// polynomial in f32; and the surface's normal, along which the height is added, its coarse part apart.

const WORDS_PER_SAMPLE = 1u;
const RECORD_WORDS = 33u; // of 16 bytes

@group(0) @binding(3) var<storage, read_write> windows: array<vec4<i32>>;
@group(0) @binding(16) var<storage, read> records: array<vec4<i32>>;

fn record_of(level: u32, block: vec2<i32>) -> u32 {
    let side = i32(curve.record_side);
    let at = vec2<u32>(((block % side) + side) % side);
    return RECORD_WORDS * ((lane_of(level) * curve.record_side + at.y) * curve.record_side + at.x);
}

fn word(record: u32, k: u32) -> i32 {
    let w = record * 4u + k;
    return records[w / 4u][w % 4u];
}

fn coefficient(record: u32, k: u32) -> vec3<f32> {
    let w = 9u + 3u * k;
    return bitcast<vec3<f32>>(vec3<i32>(word(record, w), word(record, w + 1u), word(record, w + 2u)));
}

fn store_sample(level: u32, node: vec2<i32>, first: u32, k: u32) {
    let height = staged_height(first, k);
    let address = sample_address(level, node);
    if height == VOID {
        windows[address] = vec4<i32>(VOID_POSITION, 0i, 0i, 0i);
        return;
    }
    let block = block_of(level, node);
    let r = record_of(level, block.at);
    let half = 1i << (curve.block_shift - 1u);
    let cell = block.local - vec2<i32>(half);
    let s = vec2<f32>(cell) / f32(half);
    // Terms by total degree: 1 u v uu uv vv uuu uuv uvv vvv uuuu uuuv uuvv uvvv vvvv, then the products of
    // higher degree, which only coarse levels need.
    let u = s.x;
    let v = s.y;
    let u2 = u * u;
    let v2 = v * v;
    var terms = array<f32, 25>(
        1.0, u, v, u2, u * v, v2, u2 * u, u2 * v, u * v2, v2 * v,
        u2 * u2, u2 * u * v, u2 * v2, u * v2 * v, v2 * v2,
        u2 * u2 * v, u2 * u * v2, u2 * v2 * v, u * v2 * v2,
        u2 * u2 * v2, u2 * u * v2 * v, u2 * v2 * v2,
        u2 * u2 * v2 * v, u2 * u * v2 * v2, u2 * u2 * v2 * v2,
    );
    var rest = vec3<f32>(0.0);
    for (var i = curve.levels[level].terms - 1u; i >= 15u; i--) {
        rest += coefficient(r, 10u + i) * terms[i];
    }
    for (var i = 14i; i >= 0i; i--) {
        rest += coefficient(r, u32(i)) * terms[i];
    }
    var turn = vec3<f32>(0.0);
    if curve.levels[level].terms > 15u {
        for (var i = 14u; i >= 10u; i--) {
            turn += coefficient(r, 25u + i) * terms[i];
        }
    }
    for (var i = 9i; i >= 0i; i--) {
        turn += coefficient(r, 15u + u32(i)) * terms[i];
    }
    // Kilometres along a normal of 24 bits would be off by tenths of a millimetre. Both are cut in two, so
    // that the great products are exact: 12 bits times 12; what is left of the normal is small.
    let up = vec3<f32>(vec3<i32>(records[r].w, records[r + 1u].w, word(r, 8u))) / 2048.0;
    let coarse = bitcast<f32>(bitcast<u32>(height) & 0xfffff000u);
    let per_unit = 1.0 / curve.levels[level].unit_m;
    let great = up * coarse * per_unit;
    rest += turn * height + up * (height - coarse);
    let whole = round(great);
    let linear = records[r].xyz * cell.x + records[r + 1u].xyz * cell.y;
    let offset = linear + vec3<i32>(whole) + vec3<i32>(round((great - whole) + rest * per_unit));
    windows[address] = vec4<i32>(offset, i32(shade_of(normalize(up + turn), height)));
}
