// Blocks that came into the windows -> grades of their nodes: how far the surface moves when a node, and all that
// needs it, is left out. One workgroup = one block; total: 32 x fresh blocks. A grade depends on the block's own
// samples alone, so it is the same whenever the block comes. Nothing to clear.
// A node's diamond is the two triangles that it halves: without it they stay whole, and its grade is how far the
// level's samples lie off them, which cannot be less than for the nodes that need it and whose diamonds lie in it.
// Twin: src/reference/grade_nodes.rs.

@group(0) @binding(22) var<storage, read_write> grades: array<u32>;
@group(0) @binding(23) var<storage, read> fresh: array<vec4<i32>>; // lane, block; how many there are

const THREADS = 32u; // less than most passes: many barriers, few nodes of the higher ranks

// Least bin whose metres are no less; exact, so that it never falls where metres grow.
fn up_to_bin(metres: f32) -> i32 {
    var roots = array<f32, 20>(
        1.0, 1.0352649, 1.0717734, 1.1095695, 1.1486983, 1.1892071, 1.2311444, 1.2745606, 1.3195079, 1.3660402,
        1.4142135, 1.4640857, 1.5157166, 1.5691682, 1.6245048, 1.6817929, 1.7411011, 1.8025010, 1.8660660, 1.9318726,
    );
    let bits = bitcast<u32>(max(metres, 1.2e-38));
    let part = bitcast<f32>((bits & 0x7fffffu) | 0x3f800000u);
    var above = 0i;
    for (var r = 0u; r < 20u; r++) {
        above += i32(part > roots[r]);
    }
    return 20i * (i32(bits >> 23u) - 127i) + above;
}

@compute @workgroup_size(32)
fn grade_nodes(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let number = group.x + 32768u * group.y;
    let entry = fresh[number];
    let level = enter_lane(u32(entry.x));
    let lo = BLOCK_CELLS * entry.yz;
    let cells = cells_of(level, entry.yz);
    let whole = vec2<u32>(clamp((data_last() >> vec2<u32>(level)) - lo, vec2<i32>(0i), vec2<i32>(cells)));
    // Of the last row of groups some have nothing to do; they do what they find and do not write it down.
    let address = table_address(level, entry.yz);
    let block = Graded(level, lo, cells, whole, address, deviation(address, 1u) == VOID);
    for (var i = thread; i < NODES; i += THREADS) {
        squares[i] = 0.0;
    }
    if thread == 0u {
        atomicStore(&most, 0u);
        atomicStore(&extent, 0u);
    }
    for (var i = thread; i <= NO_SIDE; i += THREADS) {
        side_low[i] = 0.0;
        side_high[i] = 0.0;
    }
    var far = 0.0;
    for (var axis = 0u; axis < AXES; axis++) {
        for (var i = thread; i < NODES; i += THREADS) {
            let node = vec2<u32>(i % SIDE_NODES, i / SIDE_NODES);
            // Beyond the data nothing is asked for but what does not count.
            let h = measured(level, lo, lo + vec2<i32>(min(node, cells)), axis);
            value[i] = select(h, 0.0, h == VOID);
            far = max(far, abs(value[i]));
            found[i] = select(0u, select(1u, 2u, h == VOID), is_inside(block, node));
            worst[i] = 0.0;
        }
        workgroupBarrier();
        atomicMax(&extent, bitcast<u32>(far));
        for (var k = 0u; k < 4u; k++) {
            // Midpoints of edges along x, then along y: the same with its coordinates exchanged.
            let across = 8u >> k;
            let half = across * (across + 1u);
            for (var i = thread; i < 2u * half; i += THREADS) {
                let along_x = i < half;
                let j = select(i - half, i, along_x);
                let place = vec2<u32>(2u * (j % across) + 1u, 2u * (j / across)) << vec2<u32>(k);
                let node = select(place.yx, place, along_x);
                if is_inside(block, node) {
                    grade_midpoint(block, node, k, along_x);
                }
            }
            workgroupBarrier();
            for (var i = thread; i < across * across; i += THREADS) {
                let node = vec2<u32>(2u * (i % across) + 1u, 2u * (i / across) + 1u) << vec2<u32>(k);
                if is_inside(block, node) {
                    grade_centre(block, node, k);
                }
            }
            workgroupBarrier();
        }
        for (var i = thread; i < NODES; i += THREADS) {
            let w = worst[i];
            squares[i] = select(select(squares[i] + w * w, w, AXES == 1u), VOID, w >= ENDLESS || squares[i] >= ENDLESS);
        }
        workgroupBarrier();
    }
    // What is left out besides: the finest mesh's own deviation, and chords.
    let finest = deviation(block.address, 0u);
    let rounding = 4e-7 * f32(AXES) * bitcast<f32>(atomicLoad(&extent));
    for (var i = thread; i < NODES; i += THREADS) {
        let node = vec2<u32>(i % SIDE_NODES, i / SIDE_NODES);
        let x = scale_of(node.x);
        let y = scale_of(node.y);
        let corner = is_corner(block, node);
        let rank = 2u * min(x, y) + select(1u, 2u, x == y);
        // 0 stands for nothing, VOID for never left out.
        var metres = 0.0;
        if is_inside(block, node) {
            metres = squares[i];
            if corner || min(x, y) > 3u || finest == VOID || !(metres < ENDLESS) {
                metres = VOID;
            } else if metres + finest > 0.0 {
                // Cut to twelve bits, or roots, which need not be exact, might fall where squares grow.
                let square = bitcast<f32>((bitcast<u32>(metres) + 0xfffu) & 0xfffff000u);
                let own = select(sqrt(square), metres, AXES == 1u);
                metres = own + select(0.0, rounding, own > 0.0) + finest + bend_m(level);
                metres = min(metres, deviation(block.address, rank) + bend_m(level + (rank + 1u) / 2u));
                metres = min(metres, ENDLESS);
                atomicMax(&most, bitcast<u32>(metres));
            }
        }
        worst[i] = metres;
    }
    workgroupBarrier();
    let top = up_to_bin(bitcast<f32>(atomicLoad(&most)));
    if number >= u32(fresh[0].w) {
        return;
    }
    let first = GRADE_WORDS * block.address;
    if thread == 0u {
        grades[first] = bitcast<u32>(top);
    }
    // Rows, then the west and the east side: whoever asks for a side finds it in five words.
    for (var w = thread; w < 95u; w += THREADS) {
        let row = w / 5u;
        var word = 0u;
        for (var b = 0u; b < 4u; b++) {
            let t = 4u * (w % 5u) + b;
            var node = vec2<u32>(t, row);
            if row >= SIDE_NODES { node = vec2<u32>(select(0u, cells.x, row > SIDE_NODES), t); }
            if t < SIDE_NODES {
                let metres = worst[at(node)];
                var code = 255u;
                if metres < VOID {
                    code = select(u32(clamp(254i + up_to_bin(metres) - top, 1i, 254i)), 0u, metres == 0.0);
                }
                word |= code << (8u * b);
            }
        }
        grades[first + 3u + w] = word;
    }
}
