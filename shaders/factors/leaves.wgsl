// The triangles of a patch whose vertices were chosen by error. Every leaf stands with the node at its right angle;
// every extra vertex of a side has one triangle more, fanned from the corner opposite to the edge that it divides.
// Written without branches where most invocations would not take them: software devices take them all.

// As set_factors and compact_patches leave them.
@group(0) @binding(24) var<storage, read> leaves: array<u32>;

// Corners of leaves at a node, counter-clockwise: per number east + 1 and north + 1 of both, in scales, two bits each.
const AROUND_CENTRES = 0xa2088a20u;   // south, north, west, east
const AROUND_MIDPOINTS = 0x96496114u; // south-west, south-east, north-west, north-east

// The patch in hand, unpacked for the whole workgroup.
var<workgroup> cells: vec2<u32>;
var<workgroup> own_rows: array<u32, 17>;  // own nodes | vertices before << 17
var<workgroup> own_sides: array<u32, 4>;
var<workgroup> side_extras: array<u32, 4>;
var<workgroup> side_starts: array<u32, 4>;
var<workgroup> node_list: array<u32, 289>; // x | y << 5
var<workgroup> leaf_list: array<u32, 512>; // x | y << 5 | number << 10

fn below(bit: u32) -> u32 {
    return select((1u << bit) - 1u, 0xffffffffu, bit > 31u);
}

fn grid_size() -> u32 {
    return (own_rows[cells.y] >> 17u) + countOneBits(own_rows[cells.y] & 0x1ffffu);
}

fn is_own(node: vec2<u32>) -> bool {
    return ((own_rows[node.y] >> node.x) & 1u) == 1u;
}

// Vertex of an own node.
fn vertex_of(node: vec2<u32>) -> u32 {
    let row = own_rows[node.y];
    return (row >> 17u) + countOneBits(row & below(node.x));
}

// Vertex of an extra.
fn extra_vertex(side: u32, j: u32) -> u32 {
    return grid_size() + side_starts[side] + countOneBits(side_extras[side] & below(j));
}

// The vertex after half cell `j` of a side on the way to the own node at half cell `to`.
fn next_on_side(side: u32, j: u32, to: u32) -> u32 {
    let ahead = side_extras[side] & ~below(j + 1u) & below(to);
    let behind = side_extras[side] & below(j) & ~below(to);
    let next = select(31u - countLeadingZeros(behind), countTrailingZeros(ahead), to > j);
    let none = select(behind, ahead, to > j) == 0u;
    let end = vertex_of(on_side_of(side, to / 2u, cells));
    return select(extra_vertex(side, min(next, 31u)), end, none);
}

// The side that an edge between two nodes lies on; 4 where it lies inside.
fn side_of(a: vec2<u32>, b: vec2<u32>) -> u32 {
    let level = a.y == b.y;
    let upright = a.x == b.x;
    var side = 4u;
    if upright && a.x == cells.x { side = 3u; }
    if upright && a.x == 0u { side = 2u; }
    if level && a.y == cells.y { side = 1u; }
    if level && a.y == 0u { side = 0u; }
    return side;
}

// The vertex that follows `a` on the edge to `b`: `b`, or the first extra on the way.
fn next_to(a: vec2<u32>, b: vec2<u32>) -> u32 {
    let side = side_of(a, b);
    let upright = side >= 2u;
    let next = next_on_side(min(side, 3u), 2u * select(a.x, a.y, upright), 2u * select(b.x, b.y, upright));
    return select(next, vertex_of(b), side == 4u);
}

// Corners of an entry of the list, counter-clockwise from its right angle; what follows those on sides.
fn leaf_corners(entry: u32) -> vec3<u32> {
    let node = vec2<u32>(entry & 31u, (entry >> 5u) & 31u);
    let kx = scale_of(node.x);
    let ky = scale_of(node.y);
    let k = min(kx, ky);
    let centre = kx == ky && k < 4u;
    // A root has both its legs on sides, as the midpoints of the cells around it would.
    let number = select((entry >> 10u) & 3u, select(0u, 3u, node.y == 0u), k == 4u);
    let bits = select(AROUND_MIDPOINTS, AROUND_CENTRES, centre) >> (8u * number);
    let offsets = (vec4<i32>((vec4<u32>(bits) >> vec4<u32>(0u, 2u, 4u, 6u)) & vec4<u32>(3u)) - vec4<i32>(1i)) << vec4<u32>(k);
    let b = vec2<u32>(vec2<i32>(node) + offsets.xy);
    let c = vec2<u32>(vec2<i32>(node) + offsets.zw);
    return vec3<u32>(vertex_of(node), next_to(node, b), next_to(select(node, b, centre), c));
}

// Half cell of the side's extra number n.
fn nth_extra(side: u32, number: u32) -> u32 {
    let bits = side_extras[side];
    var at = 0u;
    for (var width = 16u; width > 0u; width = width >> 1u) {
        at += select(0u, width, countOneBits(bits & below(at + width)) <= number);
    }
    return at;
}

// Corners of the triangle of an extra vertex.
fn extra_corners(e: u32) -> vec3<u32> {
    let side = u32(e >= side_starts[1]) + u32(e >= side_starts[2]) + u32(e >= side_starts[3]);
    let j = nth_extra(side, e - side_starts[side]);
    let own = grid_size() + e;
    // Along south and east sides the patch is on the left, along the others on the right.
    let left = side == 0u || side == 3u;
    if all(cells == vec2<u32>(16u)) && !is_own(vec2<u32>(8u)) {
        // In a root: legs along x are fanned from the other leg's end, legs along y from the first vertex of that.
        let low = (side & 1u) == 0u;
        let corner = select(vec2<u32>(16u), vec2<u32>(0u), low);
        let next = next_on_side(side, j, select(0u, 32u, low));
        let far_x = next_to(corner, vec2<u32>(16u - corner.x, corner.y));
        let far_y = vertex_of(vec2<u32>(corner.x, 16u - corner.y));
        return select(vec3<u32>(own, far_x, next), vec3<u32>(own, next, far_y), side < 2u);
    }
    // Own nodes of the side before and after it.
    let nodes = own_sides[side];
    let lo = 31u - countLeadingZeros(nodes & below(j / 2u + 1u));
    let hi = countTrailingZeros(nodes & ~below((j + 1u) / 2u));
    let length = hi - lo;
    let inwards = select(vec2<i32>(0i, 1i), vec2<i32>(1i, 0i), side >= 2u) * select(1i, -1i, (side & 1u) == 1u);
    let h = length / 2u;
    let centre = vec2<u32>(vec2<i32>(on_side_of(side, lo + h, cells)) + inwards * i32(h));
    if length > 1u && is_own(centre) {
        return vec3<u32>(vertex_of(centre), own, next_on_side(side, j, select(2u * lo, 2u * hi, left)));
    }
    // A leg: the right angle is where the coordinates, counted in its lengths, have an odd sum.
    let low_end = on_side_of(side, lo, cells);
    let from_low = (((low_end.x / length) + (low_end.y / length)) & 1u) == 1u;
    let corner = on_side_of(side, select(hi, lo, from_low), cells);
    let opposite = vec2<u32>(vec2<i32>(corner) + inwards * i32(length));
    // Where the data ends inside a block both legs may lie on sides, as in a root.
    let third = select(next_to(corner, opposite), vertex_of(opposite), side < 2u);
    let next = next_on_side(side, j, 2u * select(lo, hi, from_low));
    return select(vec3<u32>(own, next, third), vec3<u32>(own, third, next), from_low != left);
}
