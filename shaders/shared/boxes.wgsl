// Boxes over rectangles of nodes, from the bounds of blocks; plane/ and curved/ say what a block's are.

fn empty_box() -> Box {
    return Box(vec3<f32>(VOID), vec3<f32>(-VOID));
}

// Box around all blocks that touch a rectangle of a level's nodes.
fn box_over(level: u32, rect_lo: vec2<i32>, rect_hi: vec2<i32>) -> Box {
    let area = loaded(level);
    let lo = max(rect_lo, area.lo);
    let hi = min(rect_hi, area.hi);
    var box = empty_box();
    if any(hi < lo) {
        return box;
    }
    // Blocks are closed: one whose far border is our near one need not be read, unless we are that border.
    let first = lo >> vec2<u32>(BOUNDS_SHIFT);
    let last = max(first, (hi - vec2<i32>(1i)) >> vec2<u32>(BOUNDS_SHIFT));
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            box = joined(box, block_box(level, vec2<i32>(x, y), area));
        }
    }
    return box;
}

// What geomorph may add to a patch: the coarser level's nodes around it.
fn coarse_box(level: u32, base_lo: vec2<i32>, base_hi: vec2<i32>) -> Box {
    if level + 1u >= frame.level_count {
        return empty_box();
    }
    let lo = (base_lo >> vec2<u32>(level + 1u)) - vec2<i32>(1i);
    let hi = (base_hi >> vec2<u32>(level + 1u)) + vec2<i32>(2i);
    return box_over(level + 1u, lo, hi);
}
