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

const COARSEST = 1022u;      // greatest threshold: 46 octaves over a pixel under a budget, whatever the relief
const BINS_PER_OCTAVE = 20.0; // the scale of thresholds and of grades
const BLOCK_CELLS = 16i;

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

struct Beyond {
    found: bool,
    chart: u32,
    level: u32,
    block: vec2<i32>,
    side: u32, // of it, the one that faces us
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
                return Beyond(among(at, fine), home, level - 1u, at, side ^ 1u);
            }
        }
        return Beyond(true, home, level, next, side ^ 1u);
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
        return Beyond(!parent && among(coarse, drawn_blocks(level + 1u)), home, level + 1u, coarse, side ^ 1u);
    }
    return Beyond(false, home, level, next, side ^ 1u);
}

// The block of the chart beyond a side at `along` on it: charts count alike along their border, and their levels
// differ by one at most there (src/clipmap/charts.rs).
fn across_border(level: u32, along: i32, side: u32, half: u32) -> Beyond {
    let home = current_chart();
    var found = Beyond(false, home, level, vec2<i32>(0i), side);
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
            found = Beyond(true, current_chart(), l, block, entry);
            break;
        }
    }
    enter_chart(home);
    return found;
}

// Cells of a block of the current chart; fewer than 16 where the data ends.
fn cells_of(level: u32, block: vec2<i32>) -> vec2<u32> {
    return vec2<u32>(clamp(node_of(level, data_last()) - BLOCK_CELLS * block, vec2<i32>(0i), vec2<i32>(BLOCK_CELLS)));
}
