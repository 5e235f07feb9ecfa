// How the sides of a patch are divided where all factors are uniform: one span a side, doubled or more.

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

// Segments of a cell along a side.
fn segments(work: ptr<function, Work>, side: u32, cell: u32) -> u32 {
    let s = (*work).spans[side];
    return select(1u, 1u << s.log2, cell >= s.first && cell < s.to);
}

// Extra vertices of the sides before this one, and of this one before a cell.
fn extra_before(work: ptr<function, Work>, side: u32, cell: u32) -> u32 {
    let s = (*work).spans[side];
    return s.start + (clamp(cell, s.first, s.to) - s.first) * ((1u << s.log2) - 1u);
}

fn extra_count(work: ptr<function, Work>) -> u32 {
    return (*work).spans[3].start + span_count((*work).spans[3]);
}

fn is_divided(record: PatchRecord) -> bool {
    return (record.outer_sn | record.outer_we) != 0u;
}

// Cells of the patch's own grid.
fn grid_cells(record: PatchRecord) -> vec2<u32> {
    return vec2<u32>(record.shape & 0xffu, (record.shape >> 8u) & 0xffu);
}

fn span_extra(packed: u32) -> u32 {
    return (((packed >> 5u) & 31u) - (packed & 31u)) * ((1u << ((packed >> 10u) & 15u)) - 1u);
}

// Vertices and triangles of a patch.
fn needs_of(record: PatchRecord) -> vec2<u32> {
    let cells = grid_cells(record);
    let sn = record.outer_sn;
    let we = record.outer_we;
    let extra = span_extra(sn) + span_extra(sn >> 16u) + span_extra(we) + span_extra(we >> 16u);
    return vec2<u32>((cells.x + 1u) * (cells.y + 1u) + extra, 2u * cells.x * cells.y + extra);
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

fn extra_of(work: ptr<function, Work>, e: u32) -> Extra {
    var side = 0u;
    for (var s = 1u; s < 4u; s++) {
        if e >= (*work).spans[s].start && span_count((*work).spans[s]) > 0u {
            side = s;
        }
    }
    let span = (*work).spans[side];
    let inner = (1u << span.log2) - 1u;
    let along = e - span.start;
    return Extra(side, span.first + along / inner, along % inner + 1u);
}

fn segments_log2(work: ptr<function, Work>, extra: Extra) -> u32 {
    return (*work).spans[extra.side].log2;
}
