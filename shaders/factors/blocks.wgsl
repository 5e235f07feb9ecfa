// Blocks of 16 x 16 cells: each patch is one. What a block's neighbours across each side are, from the windows
// alone, so that both sides of an edge find each other. Rules: src/quads/by_error.rs.

// Limits of this frame's choice.
struct Choice {
    half_px: vec2<f32>, // half the picture
    reference_px: f32,  // screen-space error
    reference_bin: f32, // of this threshold; none below 0 is taken
    budget: u32,        // most triangles; 0: as many as threshold 0 asks for
    bend_m: f32,        // how far a level-0 cell's chord lies off the base surface; four times that a level up
    spare_a: u32,
    spare_b: u32,
}

@group(0) @binding(17) var<uniform> choice: Choice;

const NEVER = 255u;          // threshold of a step that must not be taken
const COARSEST = 254u;       // greatest threshold there is
const BINS_PER_OCTAVE = 20.0;

// Whole blocks a side of a window's toroidal tables.
fn table_address(level: u32, block: vec2<i32>) -> u32 {
    let side = (frame.n + 1u) >> 4u;
    let wrapped = vec2<u32>(block & vec2<i32>(i32(side) - 1i));
    return (lane_of(level) * side + wrapped.y) * side + wrapped.x;
}

// Blocks a level draws where no finer one does: first, and one past the last.
fn drawn_blocks(level: u32) -> Rect {
    let area = loaded(level);
    return Rect(area.lo >> vec2<u32>(4u), (area.hi + vec2<i32>(15i)) >> vec2<u32>(4u));
}

fn among(block: vec2<i32>, blocks: Rect) -> bool {
    return all(block >= blocks.lo) && all(block < blocks.hi);
}

// Where a patch lies.
struct Seat {
    level: u32,
    lo: vec2<i32>,
    hi: vec2<i32>,
    block: vec2<i32>,
}

// Makes the patch's chart the current one.
fn seat_of(slot: u32, record: PatchRecord) -> Seat {
    let level = enter_lane(slot / frame.slots_per_level);
    let size = vec2<i32>(vec2<u32>(record.shape & 0xffu, (record.shape >> 8u) & 0xffu));
    return Seat(level, record.cell, record.cell + size, record.cell >> vec2<u32>(4u));
}

// First and last node of a side along it, and the data's last base sample there.
fn side_nodes(seat: Seat, side: u32) -> vec3<i32> {
    return select(vec3<i32>(seat.lo.x, seat.hi.x, data_last().x), vec3<i32>(seat.lo.y, seat.hi.y, data_last().y), side >= 2u);
}

// Steps of 2^k cells that a patch has east and north.
fn steps_of(seat: Seat, k: u32) -> vec2<i32> {
    return (seat.hi - seat.lo + vec2<i32>((1i << k) - 1i)) >> vec2<u32>(k);
}

struct Beyond {
    found: bool,
    chart: u32,
    level: u32,
    block: vec2<i32>,
}

// Where the thresholds of what lies beyond stand. The current chart is the same before and after.
fn address_of(next: Beyond) -> u32 {
    let home = current_chart();
    enter_chart(next.chart);
    let address = table_address(next.level, next.block);
    enter_chart(home);
    return address;
}

// The block beyond half a side (0: its west or south half).
fn beyond(level: u32, block: vec2<i32>, side: u32, half: u32) -> Beyond {
    let home = current_chart();
    let across = select(vec2<i32>(0i, 1i), vec2<i32>(1i, 0i), side >= 2u);
    let step = select(-1i, 1i, (side & 1u) == 1u);
    let next = block + across * step;
    if among(next, drawn_blocks(level)) {
        if level > finest_level() {
            let fine = drawn_blocks(level - 1u);
            if among(2i * next, fine) {
                let low = 2i * next + select(vec2<i32>(0i), across, step < 0i);
                let at = low + (vec2<i32>(1i) - across) * i32(half);
                return Beyond(among(at, fine), home, level - 1u, at);
            }
        }
        return Beyond(true, home, level, next);
    }
    // Beyond the data there may be another chart.
    let ends = (node_of(level, data_last()) - vec2<i32>(1i)) >> vec2<u32>(4u);
    if is_glued() && any((next < vec2<i32>(0i)) | (next > ends)) {
        return across_border(level, select(block.x, block.y, side >= 2u), side, half);
    }
    if level + 1u < frame.level_count {
        let coarse = next >> vec2<u32>(1u);
        // Where the data ends the block beyond may be our own parent: nothing is drawn there.
        let parent = any((coarse == (block >> vec2<u32>(1u))) & (across == vec2<i32>(1i)));
        return Beyond(!parent && among(coarse, drawn_blocks(level + 1u)), home, level + 1u, coarse);
    }
    return Beyond(false, home, level, next);
}

// The block of the chart beyond a side at `along` on it: charts count alike along their border, and their levels
// differ by one at most there (src/clipmap/charts.rs).
fn across_border(level: u32, along: i32, side: u32, half: u32) -> Beyond {
    let home = current_chart();
    var found = Beyond(false, home, level, vec2<i32>(0i));
    if !cross_over(side) {
        return found;
    }
    let entry = entry_side();
    let first = select(level - 1u, level, level == 0u);
    for (var l = max(first, finest_level()); l <= min(level + 1u, frame.level_count - 1u); l++) {
        var at = along;
        if l < level { at = 2i * along + i32(half); }
        if l > level { at = along >> 1u; }
        let far = (node_of(l, data_last()) - vec2<i32>(1i)) >> vec2<u32>(4u);
        let line = select(vec2<i32>(0i), far, (entry & 1u) == 1u);
        let block = select(vec2<i32>(at, line.y), vec2<i32>(line.x, at), entry >= 2u);
        if among(block, drawn_blocks(l)) {
            found = Beyond(true, current_chart(), l, block);
            break;
        }
    }
    enter_chart(home);
    return found;
}

// Largest step, log2, at a threshold: a block's thresholds only grow with the step.
fn step_at(wish: u32, threshold: u32) -> u32 {
    let bins = (vec4<u32>(wish) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(255u);
    let fits = vec4<u32>(bins <= vec4<u32>(threshold));
    return fits.x + fits.y + fits.z + fits.w;
}

// Threshold at which a step of 2^k is first taken.
fn threshold_of(wish: u32, k: u32) -> u32 {
    return (wish >> (8u * (k - 1u))) & 255u;
}

// Segments of a side's cells between two nodes when its chain's vertices are 2^exponent base samples apart.
fn segments_between(level: u32, from_node: i32, to_node: i32, last: i32, exponent: u32) -> u32 {
    let length = min(to_node << level, last) - (from_node << level);
    return u32((length + (1i << exponent) - 1i) >> exponent);
}
