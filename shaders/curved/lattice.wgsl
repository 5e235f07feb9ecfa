// Charts glued along their borders: a lane is a level of a chart. Rules: src/clipmap/charts.rs.

// log2 of the cells of a block of bounds. A patch lies on up to 5 x 5 of them: boxes have no other extent, so
// blocks as large as patches would make them twice as wide as they are.
const BOUNDS_SHIFT = 2u;
const BOUNDS_CELLS = 4i;

struct Chart {
    last: vec2<i32>,
    finest: u32,
    flags: u32,            // bit 0: mirrored
    neighbours: vec4<u32>, // beyond south, north, west, east: chart | side << 8 | 1 << 16, or 0
    anchor: vec2<i32>,     // base node near the middle of its windows, for the geomorph
    eye: vec2<f32>,        // middle of its windows from there, base cells
    origins: array<vec2<i32>, 16>,
}

@group(0) @binding(13) var<storage, read> charts: array<Chart>;

var<private> chart: u32;
// What most vertices of a patch ask for, looked up once; `memory_of` names its chart and level.
var<private> memory_of: u32 = 0xffffffffu;
var<private> memory_last: vec2<i32>;
var<private> memory_held: Rect;
var<private> came_by: u32;

fn lane_of(level: u32) -> u32 {
    return chart * frame.level_count + level;
}

fn lane_count() -> u32 {
    return frame.level_count * curve.chart_count;
}

fn enter_lane(lane: u32) -> u32 {
    chart = lane / frame.level_count;
    return lane % frame.level_count;
}

fn origin_of(level: u32) -> vec2<i32> {
    return charts[chart].origins[level];
}

fn data_last() -> vec2<i32> {
    return charts[chart].last;
}

fn finest_level() -> u32 {
    return charts[chart].finest;
}

fn is_shifted(level: u32) -> bool {
    return (curve.shifted[chart / 4u][chart % 4u] & (1u << level)) != 0u;
}

fn apron_lo() -> vec2<i32> {
    let n = charts[chart].neighbours;
    return vec2<i32>(select(0i, -1i, n.z != 0u), select(0i, -1i, n.x != 0u));
}

fn apron_hi() -> vec2<i32> {
    let n = charts[chart].neighbours;
    return vec2<i32>(select(0i, 1i, n.w != 0u), select(0i, 1i, n.y != 0u));
}

fn current_chart() -> u32 {
    return chart;
}

fn is_glued() -> bool {
    return curve.chart_count > 1u;
}

fn is_mirrored() -> bool {
    return (charts[chart].flags & 1u) != 0u;
}

fn cross_over(side: u32) -> bool {
    let next = charts[chart].neighbours[side];
    if next == 0u {
        return false;
    }
    came_by = (next >> 8u) & 3u;
    chart = next & 0xffu;
    return true;
}

fn enter_chart(number: u32) {
    chart = number;
}

fn remember(level: u32) {
    memory_of = lane_of(level);
    memory_last = node_of(level, data_last());
    memory_held = held(level);
}

// Last node of a level of the current chart.
fn last_node(level: u32) -> vec2<i32> {
    if memory_of == lane_of(level) {
        return memory_last;
    }
    return node_of(level, data_last());
}

// Units of a level, and the frame's anchor in them.
fn units_of(level: u32) -> CurveLevel {
    return curve.levels[level];
}

// As held().
fn held_area(level: u32) -> Rect {
    if memory_of == lane_of(level) {
        return memory_held;
    }
    return held(level);
}

fn entry_side() -> u32 {
    return came_by;
}

// Base node of the current chart at `along` on its side.
fn on_side(side: u32, along: i32) -> vec2<i32> {
    let last = data_last();
    let across = select(vec2<i32>(0i), last, (side & 1u) == 1u);
    return select(vec2<i32>(along, across.y), vec2<i32>(across.x, along), side >= 2u);
}

fn lies_on(side: u32, base: vec2<i32>) -> bool {
    let line = on_side(side, 0i);
    return select(base.y == line.y, base.x == line.x, side >= 2u);
}

// Finest drawn level of the current chart whose window holds a node, border included.
fn finest_at(base: vec2<i32>) -> u32 {
    var level = finest_level();
    while level < frame.level_count {
        let area = loaded(level);
        let lo = base_of(level, area.lo);
        let hi = base_of(level, area.hi);
        if all(area.hi >= area.lo) && all(base >= lo) && all(base <= hi) {
            break;
        }
        level++;
    }
    return level;
}

// Of all names of a border node the one with the finest level, then the lowest chart: every patch around it
// takes the vertex from there.
fn owner_across(own_level: u32, base: vec2<i32>) -> Owner {
    var best = Owner(own_level, base);
    let ends = charts[chart].last;
    if all(base > vec2<i32>(0i)) && all(base < ends) {
        return best;
    }
    let home = chart;
    var best_chart = home;
    // Two crossings reach every chart that meets at a corner.
    for (var side = 0u; side < 4u; side++) {
        chart = home;
        if !lies_on(side, base) || !cross_over(side) {
            continue;
        }
        let near = on_side(came_by, select(base.x, base.y, side >= 2u));
        let near_chart = chart;
        var level = finest_at(near);
        if level < best.level || (level == best.level && chart < best_chart) {
            best = Owner(level, near);
            best_chart = chart;
        }
        for (var turn = 0u; turn < 4u; turn++) {
            chart = near_chart;
            if !lies_on(turn, near) || !cross_over(turn) {
                continue;
            }
            let far = on_side(came_by, select(near.x, near.y, turn >= 2u));
            level = finest_at(far);
            if level < best.level || (level == best.level && chart < best_chart) {
                best = Owner(level, far);
                best_chart = chart;
            }
        }
    }
    chart = best_chart;
    return best;
}
