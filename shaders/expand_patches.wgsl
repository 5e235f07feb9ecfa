// Visible patches -> vertices and triangles: the tessellation stage WebGPU lacks.
// One workgroup = one patch; its 64 invocations share the vertices, then the cells. Factors have no
// upper bound but the buffers. Total: 64 x visible patches. Nothing to clear.
// Twin: src/reference/expand_patches.rs.

override HAS_VOIDS: bool = false; // triangles that touch a void sample are collapsed

@group(0) @binding(5) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(6) var<storage, read> visible_slots: array<u32>;
@group(0) @binding(9) var<storage, read_write> indices: array<u32>;

struct Span {
    first: u32, // first divided cell
    to: u32,    // one past the last
    log2: u32,  // log2 of its segments
    start: u32, // extra vertices of the sides before this one
}

// The patch in hand, the same for the whole workgroup.
struct Work {
    record: PatchRecord,
    w: u32,
    h: u32,
    level: u32,
    spans: array<Span, 4>, // south, north, west, east
}

fn span_count(s: Span) -> u32 {
    return (s.to - s.first) * ((1u << s.log2) - 1u);
}

fn segments(s: Span, cell: u32) -> u32 {
    return select(1u, 1u << s.log2, cell >= s.first && cell < s.to);
}

// Extra vertices of a side before a cell.
fn extra_before(s: Span, cell: u32) -> u32 {
    return (clamp(cell, s.first, s.to) - s.first) * ((1u << s.log2) - 1u);
}

fn unpack(record: PatchRecord) -> Work {
    var work: Work;
    work.record = record;
    work.w = record.shape & 0xffu;
    work.h = (record.shape >> 8u) & 0xffu;
    work.level = (record.shape >> 16u) & 0xffu;
    var start = 0u;
    for (var side = 0u; side < 4u; side++) {
        let word = select(record.outer_sn, record.outer_we, side >= 2u);
        let bits = (word >> ((side & 1u) * 16u)) & 0xffffu;
        work.spans[side] = Span(bits & 31u, (bits >> 5u) & 31u, (bits >> 10u) & 15u, start);
        start += span_count(work.spans[side]);
    }
    return work;
}

// Quotient of small numbers (below 2^12) by multiplication: integer division costs as much as a vertex.
fn quotient(v: u32, reciprocal: f32) -> u32 {
    return u32((f32(v) + 0.5) * reciprocal);
}

// Base sample of an extra vertex: one that a divided side adds to the patch's grid.
fn extra_base(work: ptr<function, Work>, extra: u32) -> vec2<i32> {
    let level = (*work).level;
    var side = 0u;
    for (var s = 1u; s < 4u; s++) {
        if extra >= (*work).spans[s].start && span_count((*work).spans[s]) > 0u {
            side = s;
        }
    }
    let span = (*work).spans[side];
    let inner = (1u << span.log2) - 1u;
    let along = extra - span.start;
    let cell = span.first + along / inner;
    var corner = vec2<u32>(cell, select(0u, (*work).h, side == 1u));
    if side >= 2u {
        corner = vec2<u32>(select(0u, (*work).w, side == 3u), cell);
    }
    var base = base_of(level, (*work).record.cell + vec2<i32>(corner));
    let step = i32(((along % inner + 1u) << level) >> span.log2);
    if side < 2u { base.x += step; } else { base.y += step; }
    return base;
}

// Vertex k of the chain along one edge of a cell, from west or south.
fn chain(work: ptr<function, Work>, side: u32, cell: u32, ends: vec2<u32>, k: u32, count: u32) -> u32 {
    if k == 0u {
        return ends.x;
    }
    if k == count {
        return ends.y;
    }
    let grid = ((*work).w + 1u) * ((*work).h + 1u);
    let span = (*work).spans[side];
    return grid + span.start + extra_before(span, cell) + k - 1u;
}

fn is_void(v: u32) -> bool {
    // Written by this workgroup before the barrier; the marker is put into the packed word.
    return vertices[v].packed == 0xffffffffu;
}

fn put_triangle(base: u32, at: u32, a: u32, b: u32, c: u32) {
    var t = vec3<u32>(a, b, c) + vec3<u32>(base);
    if is_mirrored() {
        t = t.xzy;
    }
    if HAS_VOIDS && (is_void(t.x) || is_void(t.y) || is_void(t.z)) {
        t = vec3<u32>(t.x); // collapsed: covers nothing, and the counts stay what they were
    }
    indices[at] = t.x;
    indices[at + 1u] = t.y;
    indices[at + 2u] = t.z;
}

// Place of triangle k of a cell: two in the cell's own place, the others in those of its divided sides.
fn place_of(work: ptr<function, Work>, cell: vec2<u32>, counts: vec4<u32>, k: u32) -> u32 {
    let w = (*work).w;
    if k < 2u {
        return (cell.y * w + cell.x) * 2u + k;
    }
    var extra = k - 2u;
    var place = 2u * w * (*work).h;
    for (var side = 0u; side < 4u; side++) {
        let more = counts[side] - 1u;
        if extra < more {
            let span = (*work).spans[side];
            return place + span.start + extra_before(span, select(cell.x, cell.y, side >= 2u)) + extra;
        }
        extra -= more;
    }
    return place; // not reached: a cell has 2 + extra triangles
}

// The south and north chains are zipped from west to east; the first triangle is fanned over the west
// edge's points, the last over the east edge's. No triangle is degenerate, none is a stitch.
fn expand_cell(work: ptr<function, Work>, cell: vec2<u32>) {
    let w = (*work).w;
    let h = (*work).h;
    let row = w + 1u;
    let sw = cell.y * row + cell.x;
    let se = sw + 1u;
    let nw = sw + row;
    let ne = nw + 1u;
    var counts = vec4<u32>(1u);
    if cell.y == 0u { counts.x = segments((*work).spans[0], cell.x); }
    if cell.y + 1u == h { counts.y = segments((*work).spans[1], cell.x); }
    if cell.x == 0u { counts.z = segments((*work).spans[2], cell.y); }
    if cell.x + 1u == w { counts.w = segments((*work).spans[3], cell.y); }
    var i = 0u;
    var j = 0u;
    var k = 0u;
    let steps = counts.x + counts.y;
    let base = (*work).record.first_vertex;
    let start = (*work).record.first_index;
    for (var step = 0u; step < steps; step++) {
        let south = j == counts.y || (i < counts.x && (i + 1u) * counts.y <= (j + 1u) * counts.x);
        let s = chain(work, 0u, cell.x, vec2<u32>(sw, se), i, counts.x);
        let n = chain(work, 1u, cell.x, vec2<u32>(nw, ne), j, counts.y);
        var third = 0u;
        if south {
            third = chain(work, 0u, cell.x, vec2<u32>(sw, se), i + 1u, counts.x);
        } else {
            third = chain(work, 1u, cell.x, vec2<u32>(nw, ne), j + 1u, counts.y);
        }
        if step == 0u {
            for (var e = 0u; e < counts.z; e++) {
                let low = chain(work, 2u, cell.y, vec2<u32>(sw, nw), e, counts.z);
                let high = chain(work, 2u, cell.y, vec2<u32>(sw, nw), e + 1u, counts.z);
                put_triangle(base, start + 3u * place_of(work, cell, counts, k), low, third, high);
                k++;
            }
        } else if step + 1u == steps {
            let apex = select(n, s, south);
            for (var e = 0u; e < counts.w; e++) {
                let low = chain(work, 3u, cell.y, vec2<u32>(se, ne), e, counts.w);
                let high = chain(work, 3u, cell.y, vec2<u32>(se, ne), e + 1u, counts.w);
                put_triangle(base, start + 3u * place_of(work, cell, counts, k), low, high, apex);
                k++;
            }
        } else {
            put_triangle(base, start + 3u * place_of(work, cell, counts, k), s, third, n);
            k++;
        }
        if south { i++; } else { j++; }
    }
}

// A vertex of the current chart; on a border it may belong to another.
fn put_owned(at: u32, own_level: u32, base: vec2<i32>, tag: u32, on_border: bool) {
    if !on_border {
        put_vertex(at, own_level, base, tag);
        return;
    }
    let home = current_chart();
    let owner = owner_across(own_level, base);
    put_vertex(at, owner.level, owner.base, tag);
    enter_chart(home);
}

// Extra vertices of the divided sides. A function of its own, as is the next: most patches have no divided
// side and never unpack any span.
fn expand_extras(record: PatchRecord, thread: u32, tag: u32) {
    var work = unpack(record);
    let first = record.first_vertex + (work.w + 1u) * (work.h + 1u);
    let count = work.spans[3].start + span_count(work.spans[3]);
    for (var e = thread; e < count; e += 64u) {
        let base = extra_base(&work, e);
        put_owned(first + e, owner_of(work.level, base), base, tag, true);
    }
}

// Cells along the border of a patch with divided sides.
fn expand_border(record: PatchRecord, thread: u32) {
    var work = unpack(record);
    let cells = work.w * work.h;
    for (var c = thread; c < cells; c += 64u) {
        let cell = vec2<u32>(c % work.w, c / work.w);
        if any(cell == vec2<u32>(0u)) || any(cell + vec2<u32>(1u) == vec2<u32>(work.w, work.h)) {
            expand_cell(&work, cell);
        }
    }
}

@compute @workgroup_size(64)
fn expand_patches(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let record = patches[visible_slots[group.x]];
    let w = record.shape & 0xffu;
    let h = (record.shape >> 8u) & 0xffu;
    let level = (record.shape >> 16u) & 0xffu;
    let tag = (level << 24u) | (((record.shape >> 24u) & 3u) << 29u);
    enter_chart(record.shape >> 28u);
    remember(level);
    let divided = (record.outer_sn | record.outer_we) != 0u;
    // Only patches that touch the finer window have vertices which that one owns.
    let touches = touches_finer(level, record.cell, record.cell + vec2<i32>(vec2<u32>(w, h)));
    // Only those on a border with another chart may have vertices of that one.
    let first_base = base_of(level, record.cell);
    let last_base = base_of(level, record.cell + vec2<i32>(vec2<u32>(w, h)));
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
