// Grades -> weights: how many triangles the picture has more when the threshold falls below each of them. A vertex
// inside a patch is worth two triangles, one on its side one (Euler). One workgroup = 64 patch slots, its
// invocations share the rows and sides of those that are seen; total: lanes x slots_per_level. Sums of integers:
// the same in any order. weights[1023] holds the coarsest mesh; the mesh at threshold b has weights[1023] + the sum
// of weights above b.
// Runs only under a budget.

@group(0) @binding(5) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(19) var<storage, read> wishes: array<i32>;
@group(0) @binding(20) var<storage, read_write> weights: array<atomic<i32>>;

var<workgroup> listed: array<u32, 64>;
var<workgroup> listed_count: atomic<u32>;
var<workgroup> bins: array<atomic<i32>, 1024>;

fn weigh_row(block: u32, wish: i32, cells: vec2<u32>, y: u32) {
    let first = GRADE_WORDS * block + 3u + 5u * y;
    for (var i = 0u; i < 5u; i++) {
        let word = grades[first + i];
        for (var b = 0u; b < 4u; b++) {
            let x = 4u * i + b;
            let code = (word >> (8u * b)) & 255u;
            if code > 0u && x > 0u && x < cells.x && y < cells.y {
                atomicAdd(&bins[bin_of(code, wish)], 2i);
            }
        }
    }
}

// Code `t` of a side's words.
fn code_of(first: u32, t: u32) -> u32 {
    return (grades[first + (t >> 2u)] >> (8u * (t & 3u))) & 255u;
}

// What both sides of an edge wish for; the finer wish counts.
fn weigh_half(seat: Seat, block: u32, wish: i32, cells: vec2<u32>, side: u32, half: u32) {
    let there = facing(seat, side, half);
    let there_wish = wishes[there.block];
    let own_first = side_words(block, side, cells);
    let mask = before_end(seat, side);
    let end = 16u * half + 16u;
    for (var j = 16u * half; j < end; j += select(2u, 1u, there.found && there.log2 == 0u)) {
        var own = 0u;
        if (j & 1u) == 0u { own = code_of(own_first, j / 2u); }
        var other = 0u;
        if there.found && (j & ((1u << there.log2) - 1u)) == 0u {
            other = code_of(there.first, select(there.start + (j >> there.log2), j - there.start, there.log2 == 0u));
        }
        if ((mask >> j) & 1u) == 1u && max(own, other) > 0u {
            let bin = max(select(0u, bin_of(own, wish), own > 0u), select(0u, bin_of(other, there_wish), other > 0u));
            atomicAdd(&bins[bin], 1i);
        }
    }
}

@compute @workgroup_size(64)
fn weigh_factors(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    for (var b = thread; b < 1024u; b += 64u) {
        atomicStore(&bins[b], 0i);
    }
    if thread == 0u {
        atomicStore(&listed_count, 0u);
    }
    workgroupBarrier();
    if id.x < lane_count() * frame.slots_per_level && patches[id.x].visible == 1u {
        listed[atomicAdd(&listed_count, 1u)] = id.x;
        atomicAdd(&bins[ALWAYS_BIN], 2i);
    }
    workgroupBarrier();
    // Neighbouring invocations share a row's or a side's number, not a patch: they have alike to do.
    let patch_count = max(atomicLoad(&listed_count), 1u);
    let seen = select(patch_count, 0u, atomicLoad(&listed_count) == 0u);
    for (var i = thread; i < 15u * seen; i += 64u) {
        let seat = seat_of(listed[i % patch_count], patches[listed[i % patch_count]]);
        let block = table_address(seat.level, seat.block);
        weigh_row(block, wishes[block], vec2<u32>(seat.hi - seat.lo), i / patch_count + 1u);
    }
    for (var i = thread; i < 8u * seen; i += 64u) {
        let seat = seat_of(listed[i % patch_count], patches[listed[i % patch_count]]);
        let block = table_address(seat.level, seat.block);
        let k = i / patch_count;
        weigh_half(seat, block, wishes[block], vec2<u32>(seat.hi - seat.lo), k / 2u, k & 1u);
    }
    workgroupBarrier();
    for (var b = thread; b < 1024u; b += 64u) {
        let triangles = atomicLoad(&bins[b]);
        if triangles != 0i {
            atomicAdd(&weights[b], triangles);
        }
    }
}
