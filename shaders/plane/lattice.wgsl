// One chart with open borders: a lane is a level.

const BOUNDS_SHIFT = 4u; // log2 of the cells of a block of bounds
const BOUNDS_CELLS = 16i;

fn lane_of(level: u32) -> u32 {
    return level;
}

fn lane_count() -> u32 {
    return frame.level_count;
}

// Makes the lane's chart the current one and gives its level.
fn enter_lane(lane: u32) -> u32 {
    return lane;
}

fn origin_of(level: u32) -> vec2<i32> {
    return frame.origins[level].xy;
}

fn data_last() -> vec2<i32> {
    return frame.last;
}

fn finest_level() -> u32 {
    return frame.finest;
}

fn is_shifted(level: u32) -> bool {
    return (frame.shifted_levels & (1u << level)) != 0u;
}

fn apron_lo() -> vec2<i32> {
    return vec2<i32>(0i);
}

fn apron_hi() -> vec2<i32> {
    return vec2<i32>(0i);
}

// The current chart, for the patch record, and whether its triangles turn the other way.
fn current_chart() -> u32 {
    return 0u;
}

fn is_glued() -> bool {
    return false;
}

fn is_mirrored() -> bool {
    return false;
}

// Moves to the chart beyond a side; false where the surface ends.
fn cross_over(side: u32) -> bool {
    return false;
}

// Back to a chart.
fn enter_chart(chart: u32) {
}

// Remembers what a patch's vertices ask for again and again; nothing on a plane.
fn remember(level: u32) {
}

// The side of the current chart that the last crossing came in by.
fn entry_side() -> u32 {
    return 0u;
}

// Level and base sample that own a vertex; makes the owner's chart the current one.
fn owner_across(level: u32, base: vec2<i32>) -> Owner {
    return Owner(level, base);
}
