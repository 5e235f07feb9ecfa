// How far a block's surface moves without a node and all that needs it: the node's grade in metres. The arrays are the
// workgroup's; nodes of one rank ask those of lower ranks only.

override HAS_VOIDS: bool = false; // some samples are no samples

const NODES = 289u;
const NO_SIDE = 68u;  // place of what lies on no side
const ENDLESS = 1e37; // deviations from here on are no use: the node is never left out

var<workgroup> value: array<f32, NODES>;
var<workgroup> worst: array<f32, NODES>;   // along the axis in hand
var<workgroup> squares: array<f32, NODES>; // over the axes before
var<workgroup> found: array<u32, NODES>;   // bit 0: samples around, bit 1: voids
var<workgroup> side_low: array<f32, 69>;   // of midpoints on sides: along the side alone
var<workgroup> side_high: array<f32, 69>;
var<workgroup> most: atomic<u32>;
var<workgroup> extent: atomic<u32>;        // greatest value

struct Graded {
    level: u32,
    lo: vec2<i32>,    // first node
    cells: vec2<u32>,
    full: vec2<u32>,  // last node at its nominal place
    address: u32,
    keeps_sides: bool,
}

fn at(node: vec2<u32>) -> u32 {
    return node.y * SIDE_NODES + node.x;
}

fn is_inside(block: Graded, node: vec2<u32>) -> bool {
    return all(node <= block.cells);
}

fn is_corner(block: Graded, node: vec2<u32>) -> bool {
    return (node.x == 0u || node.x == block.cells.x) && (node.y == 0u || node.y == block.cells.y);
}

// Whether a triangle touches the data's inside and reaches beyond its last whole cell.
fn straddles(block: Graded, lo: vec2<u32>, hi: vec2<u32>) -> bool {
    return all(lo < block.cells) && any(hi > block.full);
}

// A midpoint's place among those of the block's sides.
fn on_sides(block: Graded, node: vec2<u32>, along_x: bool) -> u32 {
    let line = select(node.x, node.y, along_x);
    let end = select(block.cells.x, block.cells.y, along_x);
    let first = select(2u * SIDE_NODES, 0u, along_x) + select(node.y, node.x, along_x);
    return select(select(NO_SIDE, first + SIDE_NODES, line == end), first, line == 0u);
}

// The two triangles that a node halves, as one function of what lies `along` the halved edge and `across` it, both -1 to
// 1: a ridge along the edge, a slope to either corner.
struct Tent {
    middle: f32,
    along: f32,
    before: f32, // at the corners, less the middle
    after: f32,
}

fn tent(first: u32, last: u32, before: u32, after: u32) -> Tent {
    let middle = 0.5 * value[first] + 0.5 * value[last];
    return Tent(middle, 0.5 * value[last] - 0.5 * value[first], value[before] - middle, value[after] - middle);
}

fn tent_at(t: Tent, along: f32, across: f32) -> f32 {
    return t.middle + t.along * along + select(t.after, t.before, across < 0.0) * abs(across);
}

// Deviations found in a diamond.
struct Spread {
    range: vec2<f32>, // least and greatest
    found: u32,
}

fn with_sample(all: Spread, i: u32, flat_at: f32) -> Spread {
    let off = value[i] - flat_at;
    return Spread(vec2<f32>(min(all.range.x, off), max(all.range.y, off)), all.found | found[i]);
}

// Extra vertices on a side add between nothing and what that side deviates by. What a node needs is worth no less.
fn put_grade(i: u32, all: Spread, beside: vec2<f32>, needed: f32, never: bool) {
    var left_out = never;
    if HAS_VOIDS {
        left_out = never || all.found == 3u; // samples and voids: how far it moves is not known
    }
    worst[i] = select(max(needed, max(all.range.y - beside.x, beside.y - all.range.x)), VOID, left_out);
}

// A midpoint of an edge between nodes `u` before and after it; the triangles' other corners lie `v` off the edge.
// Where there are voids that the level may not show, sides keep all their nodes: a finer level may put its own there.
fn grade_midpoint(block: Graded, node: vec2<u32>, k: u32, along_x: bool) {
    let s = 1u << k;
    let i = at(node);
    let u = select(vec2<u32>(0u, s), vec2<u32>(s, 0u), along_x);
    let v = u.yx;
    let line = select(node.x, node.y, along_x);
    let down = line > 0u;
    let up = line < select(block.cells.x, block.cells.y, along_x);
    let first = node - u;
    let last = node + u;
    let never = straddles(block, first, last + v) || (down && straddles(block, first - v, last)) || is_corner(block, node);
    let roof = tent(at(first), at(last), at(select(node, node - v, down)), at(select(node, node + v, up)));
    // Steps through the tables of nodes.
    let next = select(SIDE_NODES, 1u, along_x);
    let row = select(1u, SIDE_NODES, along_x);
    let size = i32(s);
    let per_node = 1.0 / f32(s);
    let corners = found[at(first)] | found[at(last)]
        | found[at(select(node, node - v, down))] | found[at(select(node, node + v, up))];
    var all = Spread(vec2<f32>(0.0), corners);
    var along = Spread(vec2<f32>(0.0), 0u);
    // Corners do not deviate: left out, because rounding might say otherwise.
    for (var x = 1i - size; x < size; x++) {
        let j = u32(i32(i) + x * i32(next));
        along = with_sample(along, j, tent_at(roof, f32(x) * per_node, 0.0));
    }
    let low_row = select(0i, 1i - size, down);
    let high_row = select(0i, size - 1i, up);
    for (var y = low_row; y <= high_row; y++) {
        let reach = size - max(abs(y), 1i);
        for (var x = -reach; x <= reach; x++) {
            let j = u32(i32(i) + x * i32(next) + y * i32(row));
            all = with_sample(all, j, tent_at(roof, f32(x) * per_node, f32(y) * per_node));
        }
    }
    // The nodes that need this one, where it is no finest one: centres a half of its scale away.
    let half = s >> 1u;
    let off = half * next;
    let low_need = select(0u, half * row, down);
    let high_need = select(0u, half * row, up);
    let needs_low = select(0.0, max(worst[i - low_need - select(0u, off, down)], worst[i - low_need + select(0u, off, down)]), half > 0u);
    let needs_high = select(0.0, max(worst[i + high_need - select(0u, off, up)], worst[i + high_need + select(0u, off, up)]), half > 0u);
    let place = on_sides(block, node, along_x);
    let beside = select(vec2<f32>(0.0), along.range, place < NO_SIDE);
    if place < NO_SIDE {
        side_low[place] = beside.x;
        side_high[place] = beside.y;
    }
    put_grade(i, all, beside, max(needs_low, needs_high), never || (block.keeps_sides && place < NO_SIDE && all.found != 2u));
}

// A centre of a cell whose diagonal it halves.
fn grade_centre(block: Graded, node: vec2<u32>, k: u32) {
    let s = 1u << k;
    let i = at(node);
    let x = vec2<u32>(s, 0u);
    let y = vec2<u32>(0u, s);
    let never = straddles(block, node - x - y, node + x + y);
    let sw = at(node - x - y);
    let se = at(node + x - y);
    let nw = at(node - x + y);
    let ne = at(node + x + y);
    // The diagonal's ends are the corners that the next greater cell has as well, or its middle.
    let rising = (((node.x >> (k + 1u)) + (node.y >> (k + 1u))) & 1u) == select(0u, 1u, k == 3u);
    let roof = tent(select(nw, sw, rising), select(se, ne, rising), select(sw, nw, rising), select(ne, se, rising));
    let size = i32(s);
    let per_node = 0.5 / f32(s);
    var all = Spread(vec2<f32>(0.0), found[sw] | found[se] | found[nw] | found[ne]);
    for (var dy = -size; dy <= size; dy++) {
        let reach = size - i32(abs(dy) == size);
        for (var dx = -reach; dx <= reach; dx++) {
            let j = u32(i32(i) + dy * i32(SIDE_NODES) + dx);
            let sum = f32(dx + dy) * per_node;
            let difference = f32(dx - dy) * per_node;
            all = with_sample(all, j, tent_at(roof, select(difference, sum, rising), select(sum, difference, rising)));
        }
    }
    let needed = max(max(worst[at(node - x)], worst[at(node + x)]), max(worst[at(node - y)], worst[at(node + y)]));
    var beside = vec2<f32>(0.0);
    let places = vec4<u32>(
        on_sides(block, node - y, true), on_sides(block, node + y, true),
        on_sides(block, node - x, false), on_sides(block, node + x, false),
    );
    for (var side = 0u; side < 4u; side++) {
        let place = places[side];
        beside = vec2<f32>(min(beside.x, side_low[place]), max(beside.y, side_high[place]));
    }
    put_grade(i, all, beside, needed, never);
}
