// Visible patches -> vertices and triangles: the tessellation stage WebGPU lacks.
// One workgroup = one patch; its 64 invocations share the vertices, then the cells. Factors have no
// upper bound but the buffers. Total: 64 x visible patches. Nothing to clear.
// Where factors go by error, expand_leaves.wgsl runs instead. How sides are divided: uniform/edges.wgsl. Twin: src/reference/expand_patches.rs.

@group(0) @binding(5) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(6) var<storage, read> visible_slots: array<u32>;

// Quotient of small numbers (below 2^12) by multiplication: integer division costs as much as a vertex.
fn quotient(v: u32, reciprocal: f32) -> u32 {
    return u32((f32(v) + 0.5) * reciprocal);
}

// Base sample of an extra vertex: one that a divided side adds to the patch's grid.
fn extra_base(work: ptr<function, Work>, e: u32) -> vec2<i32> {
    let level = (*work).level;
    let extra = extra_of(work, e);
    let record = (*work).record;
    var corner = vec2<u32>(extra.cell, select(0u, (*work).h, extra.side == 1u));
    if extra.side >= 2u {
        corner = vec2<u32>(select(0u, (*work).w, extra.side == 3u), extra.cell);
    }
    var base = base_of(level, record.cell + vec2<i32>(corner));
    let far = i32((extra.t << level) >> segments_log2(work, extra));
    if extra.side < 2u { base.x += far; } else { base.y += far; }
    return base;
}

fn grid_vertex(work: ptr<function, Work>, x: u32, y: u32) -> u32 {
    return y * ((*work).w + 1u) + x;
}

// First point after the west or south end of a cell's edge; `high` is its other end.
fn first_inside(work: ptr<function, Work>, side: u32, cell: u32, high: u32) -> u32 {
    let grid = ((*work).w + 1u) * ((*work).h + 1u);
    return select(high, grid + extra_before(work, side, cell), segments(work, side, cell) > 1u);
}

// Last point before the east end of a cell's north edge; `low` is its other end.
fn last_inside_north(work: ptr<function, Work>, cell: u32, low: u32) -> u32 {
    let grid = ((*work).w + 1u) * ((*work).h + 1u);
    let count = segments(work, 1u, cell);
    return select(low, grid + extra_before(work, 1u, cell) + count - 2u, count > 1u);
}

// A cell's edges are chains of points. The south chain is fanned from the north-west corner and the north chain
// from the south-east one; the first of those triangles is fanned over the west chain, the last over the east
// one. The cell's diagonal stays, so every triangle lies in one half of the cell: what is known of the halves'
// deviation holds however their sides are divided. Every cell has two triangles of its own and every extra vertex
// one; none is degenerate, none is a stitch.
fn own_triangles(work: ptr<function, Work>, cell: vec2<u32>) {
    let sw = grid_vertex(work, cell.x, cell.y);
    let se = sw + 1u;
    let nw = grid_vertex(work, cell.x, cell.y + 1u);
    var south = se;
    var west = nw;
    var east = nw + 1u;
    var north = nw;
    if cell.y == 0u { south = first_inside(work, 0u, cell.x, se); }
    if cell.x == 0u { west = first_inside(work, 2u, cell.y, nw); }
    if cell.x + 1u == (*work).w { east = first_inside(work, 3u, cell.y, nw + 1u); }
    if cell.y + 1u == (*work).h { north = last_inside_north(work, cell.x, nw); }
    let at = (*work).record.first_index + 6u * (cell.y * (*work).w + cell.x);
    put_triangle((*work).record.first_vertex, at, sw, south, west);
    put_triangle((*work).record.first_vertex, at + 3u, se, east, north);
}

// The triangle of an extra vertex.
fn extra_triangle(work: ptr<function, Work>, e: u32) {
    let w = (*work).w;
    let h = (*work).h;
    let extra = extra_of(work, e);
    let cell = extra.cell;
    let v = (w + 1u) * (h + 1u) + e;
    let last = extra.t + 1u == segments(work, extra.side, cell);
    var a = 0u;
    var b = v;
    var c = 0u;
    switch extra.side {
        case 0u: {
            a = v;
            b = select(v + 1u, cell + 1u, last);
            c = grid_vertex(work, cell, 1u);
        }
        case 1u: {
            a = grid_vertex(work, cell + 1u, h - 1u);
            c = select(v - 1u, grid_vertex(work, cell, h), extra.t == 1u);
        }
        case 2u: {
            a = v;
            b = grid_vertex(work, 1u, cell);
            if cell == 0u { b = first_inside(work, 0u, 0u, b); }
            c = select(v + 1u, grid_vertex(work, 0u, cell + 1u), last);
        }
        default: {
            a = v;
            b = select(v + 1u, grid_vertex(work, w, cell + 1u), last);
            c = grid_vertex(work, w - 1u, cell + 1u);
            if cell + 1u == h { c = last_inside_north(work, w - 1u, c); }
        }
    }
    put_triangle((*work).record.first_vertex, (*work).record.first_index + 3u * (2u * w * h + e), a, b, c);
}

// Extra vertices of the divided sides. A function of its own, as is the next: most patches have no divided
// side and never unpack any span.
fn expand_extras(record: PatchRecord, thread: u32, tag: u32) {
    var work = unpack(record);
    let first = record.first_vertex + (work.w + 1u) * (work.h + 1u);
    let count = extra_count(&work);
    for (var e = thread; e < count; e += 64u) {
        let base = extra_base(&work, e);
        put_owned(first + e, owner_of(work.level, base), base, tag, true);
    }
}

// Triangles of the cells along the border of a patch with divided sides, and of its extra vertices.
fn expand_border(record: PatchRecord, thread: u32) {
    var work = unpack(record);
    let around = 2u * (work.w + work.h);
    for (var k = thread; k < around; k += 64u) {
        // South and north rows, then what is left of the west and east columns.
        var cell = vec2<u32>(k % work.w, select(0u, work.h - 1u, k >= work.w));
        var there = k < work.w || work.h > 1u;
        if k >= 2u * work.w {
            let column = k - 2u * work.w;
            cell = vec2<u32>(select(0u, work.w - 1u, column >= work.h), column % work.h);
            there = cell.y > 0u && cell.y + 1u < work.h && (column < work.h || work.w > 1u);
        }
        if there {
            own_triangles(&work, cell);
        }
    }
    let count = extra_count(&work);
    for (var e = thread; e < count; e += 64u) {
        extra_triangle(&work, e);
    }
}

@compute @workgroup_size(64)
fn expand_patches(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let record = patches[visible_slots[group.x]];
    let size = vec2<i32>(vec2<u32>(record.shape & 0xffu, (record.shape >> 8u) & 0xffu));
    let w = grid_cells(record).x;
    let h = grid_cells(record).y;
    let level = (record.shape >> 16u) & 0xffu;
    let tag = tag_of(record);
    enter_chart(record.shape >> 28u);
    remember(level);
    let divided = is_divided(record);
    // Only patches that touch the finer window have vertices which that one owns.
    let touches = touches_finer(level, record.cell, record.cell + size);
    // Only those on a border with another chart may have vertices of that one.
    let first_base = base_of(level, record.cell);
    let last_base = base_of(level, record.cell + size);
    let on_border = is_glued() && (any(first_base == vec2<i32>(0i)) || any(last_base == data_last()));
    let grid = (w + 1u) * (h + 1u);
    let per_row = 1.0 / f32(w + 1u);
    for (var v = thread; v < grid; v += 64u) {
        let y = quotient(v, per_row);
        let base = base_of(level, record.cell + vec2<i32>(vec2<u32>(v - y * (w + 1u), y)));
        var owner = level;
        if touches {
            owner = owner_of(level, base);
        }
        put_owned(record.first_vertex + v, owner, base, tag, on_border);
    }
    if divided {
        expand_extras(record, thread, tag);
    }
    if HAS_VOIDS {
        storageBarrier();
    }
    let cells = w * h;
    let per_cell_row = 1.0 / f32(w);
    for (var c = thread; c < cells; c += 64u) {
        let y = quotient(c, per_cell_row);
        let x = c - y * w;
        if divided && (x == 0u || y == 0u || x + 1u == w || y + 1u == h) {
            continue;
        }
        let sw = y * (w + 1u) + x;
        put_triangle(record.first_vertex, record.first_index + c * 6u, sw, sw + 1u, sw + w + 1u);
        put_triangle(record.first_vertex, record.first_index + c * 6u + 3u, sw + 1u, sw + w + 2u, sw + w + 1u);
    }
    if divided {
        expand_border(record, thread);
    }
}
