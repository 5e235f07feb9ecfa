// Lattices, windows and edges. The same rules as src/clipmap and src/quads, which are tested against
// naive oracles; no heights here. A lane is one level of one chart; plane/ and curved/ say which.

struct Rect {
    lo: vec2<i32>,
    hi: vec2<i32>, // included
}

// Node of a level over a base sample; rounds up, so that the clamped last sample has a node.
fn node_of(level: u32, base: vec2<i32>) -> vec2<i32> {
    return (base + vec2<i32>((1i << level) - 1i)) >> vec2<u32>(level);
}

// Base sample under a node.
fn base_of(level: u32, node: vec2<i32>) -> vec2<i32> {
    return min(node << vec2<u32>(level), data_last());
}

// Cells a step of the layout: 1, or 16 where patches are whole blocks.
fn layout_unit() -> u32 {
    return (frame.n + 1u - frame.window_cells) / 2u;
}

// Samples a level draws: its window where there is data.
fn loaded(level: u32) -> Rect {
    let lo = origin_of(level);
    let hi = lo + vec2<i32>(i32(frame.window_cells));
    return Rect(max(lo, vec2<i32>(0i)), min(hi, node_of(level, data_last())));
}

// Samples a level keeps: one more beyond every border with another chart.
fn held(level: u32) -> Rect {
    let lo = origin_of(level);
    let hi = lo + vec2<i32>(i32(frame.window_cells));
    return Rect(max(lo, apron_lo()), min(hi, node_of(level, data_last()) + apron_hi()));
}

// Level whose samples own a vertex of a patch of `level`: shared edges belong to the finer one.
fn owner_of(level: u32, base: vec2<i32>) -> u32 {
    if level <= finest_level() {
        return level;
    }
    let fine = loaded(level - 1u);
    let lo = base_of(level - 1u, fine.lo);
    let hi = base_of(level - 1u, fine.hi);
    let inside = all(base >= lo) && all(base <= hi);
    let on_border = any(base == lo) || any(base == hi);
    return select(level, level - 1u, inside && on_border);
}

// True when the closed cells from `lo` to `hi` of `level` reach the finer level's window.
fn touches_finer(level: u32, lo: vec2<i32>, hi: vec2<i32>) -> bool {
    if level <= finest_level() {
        return false;
    }
    let fine = loaded(level - 1u);
    let fine_lo = node_of(level, base_of(level - 1u, fine.lo));
    let fine_hi = node_of(level, base_of(level - 1u, fine.hi));
    return all(hi >= fine_lo) && all(lo <= fine_hi);
}

// Address of a sample in the toroidal windows: (n + 1)^2 a level.
fn sample_address(level: u32, node: vec2<i32>) -> u32 {
    let side = frame.n + 1u;
    let wrapped = vec2<u32>(node & vec2<i32>(i32(frame.n)));
    return (lane_of(level) * side + wrapped.y) * side + wrapped.x;
}

// Blocks of bounds, toroidal, twice the window's width so that both ragged ends fit.
fn block_side() -> u32 {
    return 2u * ((frame.n + 1u) >> BOUNDS_SHIFT);
}

fn block_address(level: u32, block: vec2<i32>) -> u32 {
    let side = block_side();
    let wrapped = vec2<u32>(block & vec2<i32>(i32(side) - 1i));
    return (lane_of(level) * side + wrapped.y) * side + wrapped.x;
}
