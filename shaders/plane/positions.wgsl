// Vertices on a plane, from the heights in the windows.
// Twin: src/reference/positions.rs.

override MORPH: bool = false; // geomorph near a level's perimeter
override NORMALS: bool = true; // colours that no light falls on need none

@group(0) @binding(3) var<storage, read> samples: array<f32>;

fn height_at(level: u32, node: vec2<i32>) -> f32 {
    return samples[sample_address(level, node)];
}

// One multiplication, nothing to fuse: the same bits for the same point, whichever patch asks.
fn ground_at(base: vec2<i32>) -> vec2<f32> {
    return vec2<f32>(base - frame.anchor) * frame.spacing_m;
}

// Nodes of the coarser level at the ends of the edge that a node of the finer lattice halves; twice the same
// where it stands on one.
fn coarse_ends(level: u32, node: vec2<i32>) -> vec4<i32> {
    let last = node_of(level - 1u, data_last());
    let odd = ((node & vec2<i32>(1i)) == vec2<i32>(1i)) & (node != last);
    let low = select((node + vec2<i32>(1i)) >> vec2<u32>(1u), node >> vec2<u32>(1u), odd);
    let step = vec2<i32>(odd);
    return vec4<i32>(low + vec2<i32>(step.x, 0i), low + vec2<i32>(0i, step.y));
}

// The coarser level's surface at a node of the finer lattice, on its own triangles: cells are cut
// from south-east to north-west, so a cell's middle is the mean of those corners.
fn coarse_height(level: u32, node: vec2<i32>) -> f32 {
    let ends = coarse_ends(level, node);
    let a = height_at(level, ends.xy);
    let b = height_at(level, ends.zw);
    return select((a + b) * 0.5, VOID, a == VOID || b == VOID);
}

// 0 in the middle of the window, 1 before its perimeter (Losasso and Hoppe 2004, section 5); at least as much
// as a level that has just arrived still shows of the coarser one.
fn morph_weight(level: u32, base: vec2<i32>) -> f32 {
    let cells = f32(frame.window_cells);
    let width = cells * 0.1;
    // The camera may stand three units off the window's centre.
    let start = cells * 0.5 - 3.0 * f32(layout_unit()) - width;
    let scale = 1.0 / f32(1u << level);
    let away = abs((vec2<f32>(base - frame.anchor) - frame.eye_samples) * scale);
    let near = clamp((max(away.x, away.y) - start) / width, 0.0, 1.0);
    return max(near, bitcast<f32>(frame.origins[level].z));
}

// Height of a vertex owned by `level`, VOID where there is none.
fn vertex_height(level: u32, base: vec2<i32>) -> f32 {
    let node = node_of(level, base);
    let own = height_at(level, node);
    if !MORPH || level + 1u >= frame.level_count || own == VOID {
        return own;
    }
    let alpha = morph_weight(level, base);
    if alpha == 0.0 {
        return own;
    }
    let coarse = coarse_height(level + 1u, node);
    // Clamped, or rounding could lift it out of the bounds of both.
    let between = clamp(own * (1.0 - alpha) + coarse * alpha, min(own, coarse), max(own, coarse));
    return select(between, own, coarse == VOID);
}

fn height_or(level: u32, node: vec2<i32>, centre: f32) -> f32 {
    let h = height_at(level, node);
    return select(h, centre, h == VOID);
}

// Slope at a node from central differences (one-sided at the window's border, so that both sides of a shared
// edge read the same samples).
fn slope_at(level: u32, node: vec2<i32>) -> vec2<f32> {
    let area = loaded(level);
    let centre = height_at(level, node);
    let lo = max(node - vec2<i32>(1i), area.lo);
    let hi = min(node + vec2<i32>(1i), area.hi);
    let run = vec2<f32>(base_of(level, hi) - base_of(level, lo)) * frame.spacing_m;
    let west = height_or(level, vec2<i32>(lo.x, node.y), centre);
    let east = height_or(level, vec2<i32>(hi.x, node.y), centre);
    let south = height_or(level, vec2<i32>(node.x, lo.y), centre);
    let north = height_or(level, vec2<i32>(node.x, hi.y), centre);
    return vec2<f32>(east - west, north - south) / run;
}

// The coarser level's slope at a node of the finer lattice: half-way along an edge, the mean of both ends.
fn coarse_slope(level: u32, node: vec2<i32>) -> vec2<f32> {
    let ends = coarse_ends(level, node);
    return (slope_at(level, ends.xy) + slope_at(level, ends.zw)) * 0.5;
}

// Octahedral normal of the upper half space, 12 bits a component.
fn packed_normal(level: u32, base: vec2<i32>) -> u32 {
    let node = node_of(level, base);
    var slope = slope_at(level, node);
    if MORPH && level + 1u < frame.level_count {
        let alpha = morph_weight(level, base);
        if alpha > 0.0 && coarse_height(level + 1u, node) != VOID {
            slope = slope * (1.0 - alpha) + coarse_slope(level + 1u, node) * alpha;
        }
    }
    // Only the sum of magnitudes is needed: no square that could overflow on a cliff.
    let uv = -slope / (abs(slope.x) + abs(slope.y) + 1.0);
    let q = vec2<u32>(round((uv * 0.5 + 0.5) * 4095.0));
    return q.x | (q.y << 12u);
}
