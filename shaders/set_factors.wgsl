// Grades -> the threshold (the finest one whose mesh keeps to the budget), each seen patch's own nodes at it, what
// patches beyond add to its sides, and the leaves: triangles that are not halved. One workgroup = 64 patch slots,
// its invocations share the rows and sides of those that are seen; total: lanes x slots_per_level. Vertices and
// triangles are left where compact_patches puts the patch's places.
// Twin: src/quads/by_error.rs.

@group(0) @binding(5) var<storage, read_write> patches: array<PatchRecord>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;
@group(0) @binding(19) var<storage, read> wishes: array<i32>;
@group(0) @binding(20) var<storage, read> weights: array<i32>;
@group(0) @binding(24) var<storage, read_write> leaves: array<u32>;

const ITEMS = 27u; // 17 rows, the west and the east column, what lies beyond 8 halves of sides

var<workgroup> threshold: u32;
var<workgroup> sums: array<i32, 64>;
var<workgroup> listed: array<u32, 64>;
var<workgroup> listed_count: atomic<u32>;
var<workgroup> own: array<u32, 1728>;    // by item of the listed patches
var<workgroup> counts: array<u32, 1088>; // own nodes of a row | leaves << 16

// Adds up the bins from the top on; 64 invocations share the first step.
fn find_threshold(thread: u32) {
    var sum = 0i;
    for (var b = 16u * thread; b < 16u * thread + 16u; b++) {
        sum += select(0i, weights[b], b <= COARSEST);
    }
    sums[thread] = sum;
    workgroupBarrier();
    if thread == 0u {
        var total = weights[1023];
        var part = 63u;
        while part > 0u && total + sums[part] <= i32(choice.budget) {
            total += sums[part];
            part--;
        }
        var bin = min(16u * part + 15u, COARSEST);
        while bin > 0u && total + weights[bin] <= i32(choice.budget) {
            total += weights[bin];
            bin--;
        }
        threshold = select(bin, 0u, choice.budget == 0u);
    }
}

// Own nodes of a side, bit by bit from its west or south end.
fn own_side(first: u32, side: u32, cells: vec2<u32>) -> u32 {
    return own[first + select(select(0u, cells.y, side == 1u), SIDE_NODES + side - 2u, side >= 2u)];
}

fn up_to(bit: i32) -> u32 {
    return select(0u, (2u << u32(max(bit, 0i))) - 1u, bit >= 0i);
}

// Leaves whose right angle is at a node of row y. Of midpoints by quadrant, bit 0 of its number east, bit 1 north; of
// centres south, north, west, east; of the block's corners by the first.
fn leaf_row(rows: u32, cells: vec2<u32>, y: u32) -> vec4<u32> {
    let row = own[rows + y];
    let ky = scale_of(y);
    var out = vec4<u32>(0u);
    for (var k = 0u; k <= min(ky, 3u); k++) {
        // Midpoints of edges along x while k < ky; then of edges along y as well, and centres.
        let s = 1u << k;
        let nodes = row & select(above_scale(k), at_scale(k), k < ky);
        let h = s >> 1u;
        for (var q = 0u; q < 4u; q++) {
            let east = (q & 1u) == 1u;
            let north = q >= 2u;
            if nodes == 0u || select((y < s), (y + s > cells.y), north) {
                continue;
            }
            var leaf = nodes & select(~up_to(i32(s) - 1i), up_to(i32(cells.x) - i32(s)), east);
            if k > 0u {
                let beside = own[rows + select(y - h, y + h, north)];
                leaf &= ~select(beside << h, beside >> h, east);
            }
            out[q] |= leaf;
        }
    }
    if ky < 4u {
        let s = 1u << ky;
        let centres = row & at_scale(ky);
        let in_east = up_to(i32(cells.x) - i32(s));
        let in_north = select(0u, 0xffffffffu, y + s <= cells.y);
        out |= vec4<u32>(centres) & vec4<u32>(in_east, in_east & in_north, in_north, in_east & in_north)
            & ~vec4<u32>(own[rows + y - s], own[rows + min(y + s, 16u)], row << s, row >> s);
    } else if all(cells == vec2<u32>(16u)) && (own[rows + 8u] & 0x100u) == 0u {
        out.x |= select(1u, 0x10000u, y == 16u);
    }
    return out;
}

fn size_of(slot: u32) -> vec2<u32> {
    return vec2<u32>(patches[slot].shape & 0xffu, (patches[slot].shape >> 8u) & 0xffu);
}

// Makes the slot's chart the current one.
fn block_of_slot(slot: u32) -> u32 {
    let level = enter_lane(slot / frame.slots_per_level);
    return table_address(level, patches[slot].cell >> vec2<u32>(4u));
}

fn leaf_word(slot: u32) -> u32 {
    return lane_count() * frame.slots_per_level * NODE_WORDS + slot * LEAF_WORDS;
}

// Half cells of a side where only what lies beyond has a node.
fn extras_of(first: u32, side: u32, cells: vec2<u32>) -> u32 {
    let halves = first + 19u + 2u * side;
    return (own[halves] | own[halves + 1u]) & ~spread(own_side(first, side, cells));
}

// Where rows and sides begin, and what the patch needs.
fn add_up(k: u32) {
    let slot = listed[k];
    let cells = size_of(slot);
    let word = leaf_word(slot);
    var sums = 0u;
    for (var y = 0u; y <= cells.y; y++) {
        leaves[word + 68u + y] = sums;
        sums += counts[k * SIDE_NODES + y];
    }
    var extras = 0u;
    for (var side = 0u; side < 4u; side++) {
        let added = extras_of(k * ITEMS, side, cells);
        leaves[slot * NODE_WORDS + 25u + side] = added;
        leaves[word + 85u + side] = own_side(k * ITEMS, side, cells) | (extras << 24u);
        extras += countOneBits(added);
    }
    patches[slot].first_vertex = (sums & 0xffffu) + extras;
    patches[slot].first_index = (sums >> 16u) + extras;
}

@compute @workgroup_size(64)
fn set_factors(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    find_threshold(thread);
    if thread == 0u {
        atomicStore(&listed_count, 0u);
    }
    workgroupBarrier();
    if id.x == 0u {
        counters.threshold_px = choice.reference_px * exp2((f32(threshold) - choice.reference_bin) / BINS_PER_OCTAVE);
    }
    if id.x < lane_count() * frame.slots_per_level {
        leaves[id.x * NODE_WORDS + 3u] = 0u;
        if patches[id.x].visible == 1u {
            listed[atomicAdd(&listed_count, 1u)] = id.x;
        }
    }
    workgroupBarrier();
    // Neighbouring invocations share a row's number, not a patch: they have alike to do.
    let patch_count = max(atomicLoad(&listed_count), 1u);
    let seen = select(patch_count, 0u, atomicLoad(&listed_count) == 0u);
    for (var i = thread; i < 19u * seen; i += 64u) {
        let k = i % patch_count;
        let item = i / patch_count;
        let block = block_of_slot(listed[k]);
        own[k * ITEMS + item] = above(GRADE_WORDS * block + 3u + 5u * item, cut_of(wishes[block], threshold));
    }
    for (var i = thread; i < 8u * seen; i += 64u) {
        let k = i % patch_count;
        let side = i / patch_count / 2u;
        let half = (i / patch_count) & 1u;
        let seat = seat_of(listed[k], patches[listed[k]]);
        let there = facing(seat, side, half);
        let nodes = nodes_beyond(there, cut_of(wishes[there.block], threshold));
        // Only where finer patches face it have the halves of a side different ones.
        let counts_once = there.found && (half == 0u || there.log2 == 0u);
        own[k * ITEMS + 19u + 2u * side + half] = select(0u, nodes & before_end(seat, side), counts_once);
    }
    workgroupBarrier();
    for (var i = thread; i < SIDE_NODES * seen; i += 64u) {
        let k = i % patch_count;
        let y = i / patch_count;
        let slot = listed[k];
        let row = own[k * ITEMS + y];
        var leaf = vec4<u32>(0u);
        // A loop, because software devices take every branch but leave a loop that no invocation goes on with.
        for (var more = row; more != 0u; more = 0u) {
            leaf = leaf_row(k * ITEMS, size_of(slot), y);
        }
        let word = leaf_word(slot) + 4u * y;
        leaves[word] = leaf.x;
        leaves[word + 1u] = leaf.y;
        leaves[word + 2u] = leaf.z;
        leaves[word + 3u] = leaf.w;
        leaves[slot * NODE_WORDS + 8u + y] = row;
        let all = countOneBits(leaf);
        counts[k * SIDE_NODES + y] = countOneBits(row) | ((all.x + all.y + all.z + all.w) << 16u);
    }
    workgroupBarrier();
    if thread < seen {
        add_up(thread);
    }
}
