// Vertices on a curved base surface, from the positions in the windows.
// Held against an f64 oracle: src/measure/oracle.rs.

override MORPH: bool = false; // geomorph near a level's perimeter

@group(0) @binding(3) var<storage, read> samples: array<vec4<i32>>;
@group(0) @binding(8) var<storage, read_write> vertices: array<Vertex>;
@group(0) @binding(15) var<storage, read_write> shades: array<u32>;

struct Point {
    at: vec3<f32>, // metres from the frame's anchor
    shade: u32,
    valid: bool,
}

fn point_at(level: u32, node: vec2<i32>) -> Point {
    let sample = samples[sample_address(level, node)];
    return Point(placed(level, anchor_of(level, node), sample.xyz), u32(sample.w), sample.x != VOID_POSITION);
}

// 0 in the middle of the window, 1 before its perimeter (Losasso and Hoppe 2004, section 5).
fn morph_weight(level: u32, base: vec2<i32>) -> f32 {
    let cells = f32(frame.window_cells);
    let width = cells * 0.1;
    let start = cells * 0.5 - 3.0 * f32(layout_unit()) - width;
    let scale = 1.0 / f32(1u << level);
    let away = abs((vec2<f32>(base - charts[chart].anchor) - charts[chart].eye) * scale);
    return clamp((max(away.x, away.y) - start) / width, 0.0, 1.0);
}

// The coarser level's surface at a node of the finer lattice: cells are cut from south-east to
// north-west, so a cell's middle lies between those corners.
fn coarse_point(level: u32, node: vec2<i32>) -> Point {
    let last = node_of(level - 1u, data_last());
    let odd = ((node & vec2<i32>(1i)) == vec2<i32>(1i)) & (node != last);
    let low = select((node + vec2<i32>(1i)) >> vec2<u32>(1u), node >> vec2<u32>(1u), odd);
    let step = vec2<i32>(odd);
    let a = point_at(level, low + vec2<i32>(step.x, 0i));
    let b = point_at(level, low + vec2<i32>(0i, step.y));
    return Point((a.at + b.at) * 0.5, a.shade, a.valid && b.valid);
}

// Half a neighbour's offset as seen from an anchor; that of the centre where it is void. Anchors are read only
// where the neighbour lies on another block.
fn seen_from(anchor: u32, level: u32, node: vec2<i32>, centre: vec3<i32>) -> vec3<i32> {
    let offset = samples[sample_address(level, node)].xyz;
    if HAS_VOIDS && offset.x == VOID_POSITION {
        return centre >> vec3<u32>(1u);
    }
    let own = anchor_of(level, node);
    if own == anchor {
        return offset >> vec3<u32>(1u);
    }
    return (offset + apart(anchor, own)) >> vec3<u32>(1u);
}

// From central differences of positions, one-sided at the window's border; the base's own direction where
// cells are folded to nothing.
fn normal_at(level: u32, node: vec2<i32>, centre: vec4<i32>, anchor: u32) -> vec3<f32> {
    let area = held_area(level);
    let lo = max(node - vec2<i32>(1i), area.lo);
    let hi = min(node + vec2<i32>(1i), area.hi);
    let own = centre.xyz;
    // Halved first: offsets take all bits, and their difference one more.
    let u = vec3<f32>(seen_from(anchor, level, vec2<i32>(hi.x, node.y), own) - seen_from(anchor, level, vec2<i32>(lo.x, node.y), own));
    let v = vec3<f32>(seen_from(anchor, level, vec2<i32>(node.x, hi.y), own) - seen_from(anchor, level, vec2<i32>(node.x, lo.y), own));
    // At most 2^31: scaled before squares could overflow.
    let n = cross(u * 1e-6, v * 1e-6) * select(1.0, -1.0, is_mirrored());
    let length = sqrt(dot(n, n));
    return select(up_of(u32(centre.w)), n / max(length, 1e-30), length > 1e-12);
}

fn up_of(shade: u32) -> vec3<f32> {
    return from_octahedral(vec2<f32>(f32(shade & 1023u), f32((shade >> 10u) & 1023u)) / 511.0 - 1.0);
}

// Writes one vertex: the sample of `owner` at `base`; a void one is marked.
fn put_vertex(at: u32, owner: u32, base: vec2<i32>, tag: u32) {
    let node = node_of(owner, base);
    let sample = samples[sample_address(owner, node)];
    let anchor = anchor_of(owner, node);
    let own = Point(placed(owner, anchor, sample.xyz), u32(sample.w), sample.x != VOID_POSITION);
    if HAS_VOIDS && !own.valid {
        vertices[at] = Vertex(0.0, 0.0, 0.0, 0xffffffffu);
        return;
    }
    var position = own.at;
    if MORPH && owner + 1u < frame.level_count {
        let alpha = morph_weight(owner, base);
        if alpha > 0.0 {
            let coarse = coarse_point(owner + 1u, node);
            let between = own.at * (1.0 - alpha) + coarse.at * alpha;
            position = select(own.at, clamp(between, min(own.at, coarse.at), max(own.at, coarse.at)), coarse.valid);
        }
    }
    let normal = normal_at(owner, node, sample, anchor);
    let q = vec2<u32>(round((octahedral(normal) * 0.5 + 0.5) * 4094.0));
    vertices[at] = Vertex(position.x, position.y, position.z, tag | q.x | (q.y << 12u));
    // For the colours: cosine of the slope in 16 bits, height in 12.
    let slope = u32(round(clamp(dot(normal, up_of(own.shade)) * 0.5 + 0.5, 0.0, 1.0) * 65535.0));
    shades[at] = (own.shade & 0xfff00000u) | slope;
}
