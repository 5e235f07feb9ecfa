// How the sides of a patch are divided where factors go by error. The patch is drawn with steps of 2^step cells;
// each half of a side (8 cells of the level) has a factor of its own. Packed by set_factors: outer_sn holds six
// bits a side (log2 of the segments a step has: first half, second half) and the step from bit 24 on; outer_we
// four bits a side, the segments that its last step loses to the data's border.

// The patch in hand, the same for the whole workgroup.
struct Work {
    record: PatchRecord,
    w: u32, // steps east
    h: u32, // steps north
    level: u32,
    starts: vec4<u32>, // extra vertices of the sides before each: south, north, west, east
}

fn step_log2(record: PatchRecord) -> u32 {
    return (record.outer_sn >> 24u) & 7u;
}

fn grid_cells(record: PatchRecord) -> vec2<u32> {
    let step = step_log2(record);
    let cells = vec2<u32>(record.shape & 0xffu, (record.shape >> 8u) & 0xffu);
    return (cells + vec2<u32>((1u << step) - 1u)) >> vec2<u32>(step);
}

fn is_divided(record: PatchRecord) -> bool {
    return (record.outer_sn & 0xffffffu) != 0u;
}

// Steps of the first half of a side.
fn half_steps(record: PatchRecord) -> u32 {
    return 8u >> step_log2(record);
}

// log2 of the segments of a step.
fn side_log2(record: PatchRecord, side: u32, cell: u32) -> u32 {
    let second = select(0u, 3u, cell >= half_steps(record));
    return (record.outer_sn >> (side * 6u + second)) & 7u;
}

fn lost(record: PatchRecord, side: u32) -> u32 {
    return (record.outer_we >> (side * 4u)) & 15u;
}

// Extra vertices of a side before a step, as if none were lost.
fn extra_along(record: PatchRecord, side: u32, cell: u32) -> u32 {
    let halves = half_steps(record);
    let first = min(cell, halves);
    let logs = record.outer_sn >> (side * 6u);
    return first * ((1u << (logs & 7u)) - 1u) + (cell - first) * ((1u << ((logs >> 3u) & 7u)) - 1u);
}

// Extra vertices of a whole side.
fn side_extra(record: PatchRecord, side: u32) -> u32 {
    let cells = grid_cells(record);
    return extra_along(record, side, select(cells.x, cells.y, side >= 2u)) - lost(record, side);
}

fn unpack(record: PatchRecord) -> Work {
    let cells = grid_cells(record);
    let south = side_extra(record, 0u);
    let north = south + side_extra(record, 1u);
    let starts = vec4<u32>(0u, south, north, north + side_extra(record, 2u));
    return Work(record, cells.x, cells.y, (record.shape >> 16u) & 0xffu, starts);
}

fn segments(work: ptr<function, Work>, side: u32, cell: u32) -> u32 {
    let record = (*work).record;
    let last = select((*work).w, (*work).h, side >= 2u) - 1u;
    return (1u << side_log2(record, side, cell)) - select(0u, lost(record, side), cell == last);
}

fn extra_before(work: ptr<function, Work>, side: u32, cell: u32) -> u32 {
    return (*work).starts[side] + extra_along((*work).record, side, cell);
}

fn extra_count(work: ptr<function, Work>) -> u32 {
    return (*work).starts.w + side_extra((*work).record, 3u);
}

// set_factors counted them and left them where their places will stand.
fn needs_of(record: PatchRecord) -> vec2<u32> {
    return vec2<u32>(record.first_vertex, record.first_index);
}

fn extra_of(work: ptr<function, Work>, e: u32) -> Extra {
    let record = (*work).record;
    var side = 0u;
    for (var s = 1u; s < 4u; s++) {
        if e >= (*work).starts[s] && side_extra(record, s) > 0u {
            side = s;
        }
    }
    let halves = half_steps(record);
    let logs = vec2<u32>(record.outer_sn >> (side * 6u), record.outer_sn >> (side * 6u + 3u)) & vec2<u32>(7u);
    let along = e - (*work).starts[side];
    let before = halves * ((1u << logs.x) - 1u);
    let second = along >= before;
    let log2 = select(logs.x, logs.y, second);
    let within = along - select(0u, before, second);
    // Of powers of two less one: a step's extra vertices. Small numbers: the quotient is exact.
    let inner = (1u << log2) - 1u;
    let cell = u32((f32(within) + 0.5) / f32(inner));
    return Extra(side, select(0u, halves, second) + cell, within - cell * inner + 1u);
}

fn segments_log2(work: ptr<function, Work>, extra: Extra) -> u32 {
    return side_log2((*work).record, extra.side, extra.cell);
}
