// Heights over an analytic surface -> positions. A block's record holds the surface about its middle
// (src/surface/blocks.rs): the linear part in integers, so that it is exact; the rest, which is small, as a
// polynomial in f32; and the surface's normal, along which the height is added.

const WORDS_PER_SAMPLE = 1u;
const RECORD_WORDS = 21u; // of 16 bytes

@group(0) @binding(3) var<storage, read_write> windows: array<vec4<i32>>;
@group(0) @binding(16) var<storage, read> records: array<vec4<i32>>;

fn record_of(level: u32, block: vec2<i32>) -> u32 {
    let side = i32(curve.record_side);
    let at = vec2<u32>(((block % side) + side) % side);
    return RECORD_WORDS * ((lane_of(level) * curve.record_side + at.y) * curve.record_side + at.x);
}

fn coefficient(record: u32, k: u32) -> vec3<f32> {
    let w = record * 4u + 8u + 3u * k;
    return bitcast<vec3<f32>>(vec3<i32>(records[w / 4u][w % 4u], records[(w + 1u) / 4u][(w + 1u) % 4u], records[(w + 2u) / 4u][(w + 2u) % 4u]));
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
    // Terms of the base surface by total degree, to the fourth: 1 u v uu uv vv uuu uuv uvv vvv ...
    let u = s.x;
    let v = s.y;
    var terms = array<f32, 15>(
        1.0, u, v, u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v,
        u * u * u * u, u * u * u * v, u * u * v * v, u * v * v * v, v * v * v * v,
    );
    var rest = vec3<f32>(0.0);
    for (var i = 14i; i >= 0i; i--) {
        rest += coefficient(r, u32(i)) * terms[i];
    }
    var up = vec3<f32>(0.0);
    for (var i = 9i; i >= 0i; i--) {
        up += coefficient(r, 15u + u32(i)) * terms[i];
    }
    rest += up * height;
    let linear = records[r].xyz * cell.x + records[r + 1u].xyz * cell.y;
    let offset = linear + vec3<i32>(round(rest / curve.levels[level].unit_m));
    windows[address] = vec4<i32>(offset, i32(shade_of(normalize(up), height)));
}
