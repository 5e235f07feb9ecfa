// What the deviations of blocks come to on screen.

// Most pixels that a metre of deviation anywhere in a box may take of the picture. A point p shows at
// (row . p) / w; its derivative along a direction is (row . direction - ndc (w_row . direction)) / w: moved_px()
// bounds it for the directions there are. Points out of the picture do not count: ndc is cut to it, and what is
// seen is no nearer, along the view, than its distance allows.
fn px_per_m(box: Box) -> f32 {
    let m = transpose(frame.clip_from_near);
    let eye = frame.eye_from_anchor_m;
    let lo = box.lo - eye;
    let hi = box.hi - eye;
    let away = length(max(max(lo, -hi), vec3<f32>(0.0)));
    let corner = sqrt(1.0 + 1.0 / dot(m[0].xyz, m[0].xyz) + 1.0 / dot(m[1].xyz, m[1].xyz));
    var nearest = VOID;
    var least = vec2<f32>(VOID);
    var most = vec2<f32>(-VOID);
    for (var c = 0u; c < 8u; c++) {
        let pick = (vec3<u32>(c) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u);
        let p = select(lo, hi, pick == vec3<u32>(1u));
        let w = dot(m[3].xyz, p);
        nearest = min(nearest, w);
        let ndc = vec2<f32>(dot(m[0].xyz, p), dot(m[1].xyz, p)) / max(w, 1e-30);
        least = min(least, ndc);
        most = max(most, ndc);
    }
    // A box that reaches behind the eye may show anywhere.
    let whole = nearest <= 0.0;
    least = select(clamp(least, vec2<f32>(-1.0), vec2<f32>(1.0)), vec2<f32>(-1.0), whole);
    most = select(clamp(most, vec2<f32>(-1.0), vec2<f32>(1.0)), vec2<f32>(1.0), whole);
    let w = max(nearest, away / corner);
    let px = max(moved_px(m, least), moved_px(m, most));
    // Rounding must never make it less.
    return length(px * choice.half_px) * 1.0001 / max(w, 1e-30);
}
