// The nodes of a block in the order of longest-edge bisection (Lindstrom and Pascucci 2002, section 2): every node
// halves the longest edge of the two triangles beside it. Midpoints halve an edge along an axis, of twice their
// scale; centres halve the diagonal of a cell of twice their scale. Rules: src/quads/nodes.rs.

const SIDE_NODES = 17u; // a row of a block

// log2 of a coordinate's scale; 4 at the block's ends.
fn scale_of(v: u32) -> u32 {
    return min(countTrailingZeros(v), 4u);
}

// Bits of the coordinates of one scale, and of all greater ones.
fn at_scale(k: u32) -> u32 {
    var all = array<u32, 5>(0xaaaau, 0x4444u, 0x1010u, 0x0100u, 0x10001u);
    return all[k];
}

fn above_scale(k: u32) -> u32 {
    var all = array<u32, 5>(0x15555u, 0x11111u, 0x10101u, 0x10001u, 0u);
    return all[k];
}

// Node at a place of a block's side.
fn on_side_of(side: u32, t: u32, cells: vec2<u32>) -> vec2<u32> {
    let line = select(vec2<u32>(0u), cells, (side & 1u) == 1u);
    return select(vec2<u32>(t, line.y), vec2<u32>(line.x, t), side >= 2u);
}
