// Thresholds -> factors: the finest threshold whose mesh keeps to the budget, each patch's step at it, and its
// sides' chains, which take the finer wish of both sides. One invocation = one patch slot; total: lanes x
// slots_per_level. Vertices and triangles are left where compact_patches puts the patch's places.
// Twin: src/quads/by_error.rs.

@group(0) @binding(5) var<storage, read_write> patches: array<PatchRecord>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;
@group(0) @binding(19) var<storage, read> wishes: array<u32>;
@group(0) @binding(20) var<storage, read> weights: array<i32>;

var<workgroup> threshold: u32;

fn threshold_within_budget() -> u32 {
    if choice.budget == 0u {
        return 0u;
    }
    var total = weights[255];
    var bin = COARSEST;
    while bin > 0u {
        total += weights[bin];
        if total > i32(choice.budget) {
            break;
        }
        bin--;
    }
    return bin;
}

@compute @workgroup_size(64)
fn set_factors(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if thread == 0u {
        threshold = threshold_within_budget();
    }
    workgroupBarrier();
    let slot = id.x;
    if slot == 0u {
        counters.threshold_px = choice.reference_px * exp2((f32(threshold) - choice.reference_bin) / BINS_PER_OCTAVE);
    }
    if slot >= lane_count() * frame.slots_per_level || patches[slot].visible != 1u {
        return;
    }
    let seat = seat_of(slot, patches[slot]);
    let level = seat.level;
    let block = seat.block;
    let k = step_at(wishes[table_address(level, block)], threshold);
    let own = level + k;
    var logs = (k << 24u) | 0x80000000u; // the highest bit says that factors go by error
    var lost = 0u;
    var extra = 0i;
    for (var side = 0u; side < 4u; side++) {
        let nodes = side_nodes(seat, side);
        let from_node = nodes.x;
        let to_node = nodes.y;
        let last = nodes.z;
        var end = own;
        for (var half = 0u; half < 2u; half++) {
            if from_node + 8i * i32(half) >= to_node {
                continue;
            }
            let next = beyond(level, block, side, half);
            var exponent = own;
            if next.found {
                exponent = min(own, next.level + step_at(wishes[address_of(next)], threshold));
            }
            logs |= (own - exponent) << (side * 6u + half * 3u);
            if k == 4u {
                // The one step lies in the second half as half_steps() counts.
                logs |= (own - exponent) << (side * 6u + 3u);
            }
            end = exponent;
            let a = from_node + 8i * i32(half);
            let b = min(a + 8i, to_node);
            // A step of 16 spans both halves: both have the same chain, counted once.
            if k < 4u {
                extra += i32(segments_between(level, a, b, last, exponent)) - i32(segments_between(level, a, b, last, own));
            } else if half == 0u {
                extra += i32(segments_between(level, a, to_node, last, exponent)) - 1i;
            }
        }
        // The last step may be cut by the data's border, and so may its chain.
        let steps = (to_node - from_node + (1i << k) - 1i) >> k;
        let start = from_node + ((steps - 1i) << k);
        lost |= ((1u << (own - end)) - segments_between(level, start, to_node, last, end)) << (side * 4u);
    }
    let steps = steps_of(seat, k);
    patches[slot].outer_sn = logs;
    patches[slot].outer_we = lost;
    patches[slot].first_vertex = u32((steps.x + 1i) * (steps.y + 1i) + extra);
    patches[slot].first_index = u32(2i * steps.x * steps.y + extra);
}
