// Vertex stages of clipmaps: the rivals', and ours with the expansion moved into the vertex stage. Samples,
// morph and normals are those of plane/positions.wgsl, fragments those of draw_terrain.wgsl.

@group(0) @binding(5) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(6) var<storage, read> visible_slots: array<u32>;

fn normal_of(level: u32, base: vec2<i32>) -> u32 {
    if NORMALS {
        return packed_normal(level, base);
    }
    return 0u;
}

// Losasso and Hoppe 2004: ready-made vertices, each with the height of the next coarser level's surface.
@vertex
fn vs_clip(
    @location(0) base: vec2<i32>,
    @location(1) heights: vec2<f32>, // own, coarser
    @location(2) packed: u32,
) -> Seen {
    let alpha = morph_weight((packed >> 24u) & 31u, base);
    let low = min(heights.x, heights.y);
    let height = clamp(heights.x * (1.0 - alpha) + heights.y * alpha, low, max(heights.x, heights.y));
    let place = vec3<f32>(ground_at(base), height - frame.anchor_height_m);
    return see(place, packed, vec3<f32>(1.0));
}

// Asirvatham and Hoppe 2005: a static footprint set down anywhere, heights fetched here.
@vertex
fn vs_block(@location(0) cell: vec2<u32>, @location(1) lo: vec2<i32>, @location(2) tag: u32) -> Seen {
    let level = (tag >> 24u) & 31u;
    let area = loaded(level);
    let node = clamp(lo + vec2<i32>(cell), area.lo, area.hi);
    let base = base_of(level, node);
    let place = vec3<f32>(ground_at(base), vertex_height(level, base) - frame.anchor_height_m);
    return see(place, tag | normal_of(level, base), vec3<f32>(1.0));
}

const SIDE = 17u; // vertices a row of a patch: PATCH_CELLS + 1
const GRID = 289u;
const NONE = 0xffu;

fn is_divided(span: u32, cell: u32) -> bool {
    return ((span >> 10u) & 15u) == 1u && cell >= (span & 31u) && cell < ((span >> 5u) & 31u);
}

// Of the pattern's 16 cells along an axis a patch of fewer has the first ones and the last one, so that both
// its sides lie on the pattern's; the others have no width. Where it has a single cell, that is the last one,
// or the first when the low side is divided (never both are: an L's arm has the finer window on one side).
fn squeezed(corner: u32, cells: u32, low: bool) -> u32 {
    if cells == 1u && low {
        return min(corner, 1u);
    }
    return select(min(corner, cells - 1u), cells, corner == SIDE - 1u);
}

// The cell of the patch that a cell of the pattern is; none where it has no width.
fn cell_of(along: u32, cells: u32, low: bool) -> u32 {
    if cells == 1u && low {
        return select(NONE, 0u, along == 0u);
    }
    return select(select(NONE, along, along + 1u < cells), cells - 1u, along == 15u);
}

// A patch of ours, one instance: one pattern for all, in which every side is divided. The middle of an
// undivided edge stands on one of the edge's ends: its triangle has no area. Middles: 16 a side in the order
// south, north, west, east. Twin: src/rivals/tessellated.rs.
@vertex
fn vs_expand(@builtin(vertex_index) ix: u32, @builtin(instance_index) instance: u32) -> Seen {
    let record = patches[visible_slots[instance]];
    let cells = vec2<u32>(record.shape & 0xffu, (record.shape >> 8u) & 0xffu);
    let level = (record.shape >> 16u) & 0xffu;
    let low = vec2<bool>((record.outer_we & 0xffffu) != 0u, (record.outer_sn & 0xffffu) != 0u);
    var corner = vec2<u32>(ix % SIDE, ix / SIDE);
    var step = vec2<i32>(0i);
    if ix >= GRID {
        let side = (ix - GRID) / 16u;
        let along = (ix - GRID) % 16u;
        let upright = side >= 2u;
        let word = select(record.outer_sn, record.outer_we, upright);
        let span = (word >> ((side & 1u) * 16u)) & 0xffffu;
        let cell = select(cell_of(along, cells.x, low.x), cell_of(along, cells.y, low.y), upright);
        let divided = cell != NONE && is_divided(span, cell);
        let half = select(0i, (1i << level) >> 1u, divided);
        let across = select(0u, 16u, (side & 1u) == 1u);
        // In the western corners the second end: the triangles over a divided west side hang on it.
        let end = along + select(0u, 1u, !divided && !upright && along == 0u);
        corner = select(vec2<u32>(end, across), vec2<u32>(across, end), upright);
        step = select(vec2<i32>(half, 0i), vec2<i32>(0i, half), upright);
    }
    let node = vec2<u32>(squeezed(corner.x, cells.x, low.x), squeezed(corner.y, cells.y, low.y));
    let base = base_of(level, record.cell + vec2<i32>(node)) + step;
    let owner = owner_of(level, base);
    let tag = (level << 24u) | (((record.shape >> 24u) & 3u) << 29u);
    let place = vec3<f32>(ground_at(base), vertex_height(owner, base) - frame.anchor_height_m);
    return see(place, tag | normal_of(owner, base), vec3<f32>(1.0));
}
