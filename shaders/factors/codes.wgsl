// Grades of blocks' nodes, and what both sides of an edge make of them. A node's bin on the scale of thresholds is
// its code, moved by how large its block shows on screen; codes grow from nodes to those they need, so any
// threshold leaves a mesh without cracks.

@group(0) @binding(22) var<storage, read> grades: array<u32>;

const ALWAYS = 255u;      // code of what is never left out
const ALWAYS_BIN = 1023u;

// Threshold under which a node is drawn, or ALWAYS_BIN. Code 0 is for nodes that change nothing.
fn bin_of(code: u32, wish: i32) -> u32 {
    return select(u32(clamp(i32(code) - 254i + wish, 0i, i32(COARSEST))), ALWAYS_BIN, code == ALWAYS);
}

// Nodes with greater codes than this are drawn: those whose bin is above the threshold.
fn cut_of(wish: i32, threshold: u32) -> u32 {
    return select(u32(clamp(i32(threshold) + 254i - wish, 0i, 254i)), 254u, threshold >= COARSEST);
}

fn code_at(block: u32, node: vec2<u32>) -> u32 {
    let word = grades[GRADE_WORDS * block + 3u + 5u * node.y + (node.x >> 2u)];
    return (word >> (8u * (node.x & 3u))) & 255u;
}

// First of the five words of a side's codes.
fn side_words(block: u32, side: u32, cells: vec2<u32>) -> u32 {
    return GRADE_WORDS * block + 3u + select(5u * select(0u, cells.y, side == 1u), 75u + 5u * side, side >= 2u);
}

// Bits of the codes above a cut, 17 of them in five words.
fn above(first: u32, cut: u32) -> u32 {
    var bits = 0u;
    for (var i = 0u; i < 5u; i++) {
        let codes = (vec4<u32>(grades[first + i]) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(255u);
        let own = vec4<u32>(codes > vec4<u32>(cut)) << vec4<u32>(0u, 1u, 2u, 3u);
        bits |= (own.x | own.y | own.z | own.w) << (4u * i);
    }
    return bits & 0x1ffffu;
}

// Bits 1 to the last half cell along a side that stands before the data's end.
fn before_end(seat: Seat, side: u32) -> u32 {
    let lo = select(seat.lo.x, seat.lo.y, side >= 2u);
    let last = select(data_last().x, data_last().y, side >= 2u);
    let j = u32(clamp(((2i * last - 1i) >> seat.level) - 2i * lo, 0i, 31i));
    return ((2u << j) - 1u) & ~1u;
}

// What lies beyond half a side, for asking after its nodes.
struct Facing {
    found: bool,
    block: u32, // address in the tables
    first: u32, // of its side's words
    log2: u32,  // of our half cells between its nodes
    start: u32, // its first node along our side, or our half cell where its first one stands
}

fn facing(seat: Seat, side: u32, half: u32) -> Facing {
    let next = beyond(seat.level, seat.block, side, half);
    let home = current_chart();
    enter_chart(next.chart);
    let block = table_address(next.level, next.block);
    let first = side_words(block, next.side, cells_of(next.level, next.block));
    enter_chart(home);
    let finer = next.level < seat.level;
    let along = u32(select(seat.block.x, seat.block.y, side >= 2u));
    let start = select(select(0u, 8u * (along & 1u), next.level > seat.level), 16u * half, finer);
    return Facing(next.found, block, first, select(1u + next.level - seat.level, 0u, finer), start);
}

// Bit k to bit 2k, for 16 bits.
fn spread(bits: u32) -> u32 {
    var v = bits & 0xffffu;
    v = (v | (v << 8u)) & 0x00ff00ffu;
    v = (v | (v << 4u)) & 0x0f0f0f0fu;
    v = (v | (v << 2u)) & 0x33333333u;
    return (v | (v << 1u)) & 0x55555555u;
}

// Its nodes above a cut -> half cells of our side. Where two finer patches meet, each has its corner.
fn nodes_beyond(there: Facing, cut: u32) -> u32 {
    let nodes = above(there.first, cut);
    let same = spread(nodes);
    let coarser = spread(spread((nodes >> there.start) & 0xffu));
    return select(select(coarser, same, there.log2 == 1u), nodes << there.start, there.log2 == 0u);
}
