// Thresholds -> weights: how many triangles the picture has more when the threshold falls below each of them.
// One invocation = one patch slot; total: lanes x slots_per_level. Sums of integers: the same in any order.
// weights[255] holds the coarsest mesh; the mesh at threshold b has weights[255] + the sum of weights above b.
// Runs only under a budget.

@group(0) @binding(5) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(19) var<storage, read> wishes: array<u32>;
@group(0) @binding(20) var<storage, read_write> weights: array<atomic<i32>>;

fn add(bin: u32, triangles: i32) {
    if triangles != 0i {
        atomicAdd(&weights[bin], triangles);
    }
}

// Next lower threshold at which a block takes a smaller step; -1 where there is none.
fn next_of(wish: u32, k: u32) -> i32 {
    return select(-1i, i32(threshold_of(wish, max(k, 1u))), k > 0u);
}

@compute @workgroup_size(64)
fn weigh_factors(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= lane_count() * frame.slots_per_level || patches[slot].visible != 1u {
        return;
    }
    let seat = seat_of(slot, patches[slot]);
    let level = seat.level;
    let block = seat.block;
    let wish = wishes[table_address(level, block)];
    let coarsest = step_at(wish, COARSEST);
    var before = 0i;
    for (var k = i32(coarsest); k >= 0i; k--) {
        let steps = steps_of(seat, u32(k));
        let own = 2i * steps.x * steps.y;
        add(select(threshold_of(wish, u32(k) + 1u), 255u, u32(k) == coarsest), own - before);
        before = own;
    }
    for (var side = 0u; side < 4u; side++) {
        let nodes = side_nodes(seat, side);
        let from_node = nodes.x;
        let to_node = nodes.y;
        let last = nodes.z;
        for (var half = 0u; half < 2u; half++) {
            let next = beyond(level, block, side, half);
            let halved = next.level < level;
            if !next.found || (half == 1u && !halved) {
                continue;
            }
            let a = from_node + 8i * i32(half);
            let b = select(to_node, min(from_node + 8i * (i32(half) + 1i), to_node), halved);
            let other = wishes[address_of(next)];
            var k = coarsest;
            var j = step_at(other, COARSEST);
            var bin = 255u;
            var had = 0i;
            loop {
                let own = level + k;
                let shared_exponent = min(own, next.level + j);
                let more = i32(segments_between(level, a, b, last, shared_exponent))
                    - i32(segments_between(level, a, b, last, own));
                add(bin, more - had);
                had = more;
                let own_next = next_of(wish, k);
                let other_next = next_of(other, j);
                let at = max(own_next, other_next);
                if at < 0i {
                    break;
                }
                if own_next == at { k--; }
                if other_next == at { j--; }
                bin = u32(at);
            }
        }
    }
}
