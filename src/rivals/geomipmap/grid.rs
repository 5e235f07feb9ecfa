//! Coarse cells over the samples: their errors, their heights, and who lies beside whom.

use crate::rivals::Ground;

/// Largest vertical distance, metres, of the samples under a cell from its two triangles, cut from south-east
/// to north-west. `lo` lies in the data; corners beyond it stand on the last sample.
pub(crate) fn cell_error(ground: &Ground, lo: [i32; 2], step: i32) -> f32 {
    let last = ground.last();
    let hi = [0, 1].map(|a| (lo[a] + step).min(last[a]));
    let [w, h] = [0, 1].map(|a| hi[a] - lo[a]);
    if w <= 0 || h <= 0 || (w == 1 && h == 1) {
        return 0.0;
    }
    let corner = |x, y| f64::from(ground.height([x, y]));
    let (sw, se) = (corner(lo[0], lo[1]), corner(hi[0], lo[1]));
    let (nw, ne) = (corner(lo[0], hi[1]), corner(hi[0], hi[1]));
    let rises = [(se - sw) / f64::from(w), (ne - nw) / f64::from(w)];
    let mut worst = 0.0_f64;
    for y in 0..=h {
        let first = ground.index([lo[0], lo[1] + y]);
        let row = &ground.heights[first..=first + w as usize];
        // The cut itself counts to the south-western triangle.
        let cut = (w * (h - y) / h) as usize + 1;
        let v = f64::from(y) / f64::from(h);
        let starts = [sw + (nw - sw) * v, nw + (se - ne) * (1.0 - v)];
        for (k, height) in row.iter().enumerate() {
            let side = usize::from(k >= cut);
            let surface = starts[side] + rises[side] * k as f64;
            worst = worst.max((surface - f64::from(*height)).abs());
        }
    }
    worst as f32
}

/// Lowest and highest of the samples `lo..=hi`, which lie in the data, metres.
pub(crate) fn height_range(ground: &Ground, lo: [i32; 2], hi: [i32; 2]) -> [f32; 2] {
    let mut range = [f32::INFINITY, f32::NEG_INFINITY];
    for y in lo[1]..=hi[1] {
        let row = &ground.heights[ground.index([lo[0], y])..=ground.index([hi[0], y])];
        range = row.iter().fold(range, |[low, high], h| [low.min(*h), high.max(*h)]);
    }
    range
}

/// Joins two ranges.
pub(crate) fn joined(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// The place beside another one to the south, north, west or east (sides 0 to 3) among `count`, if any.
pub(crate) fn beside(at: [u32; 2], side: usize, count: [u32; 2]) -> Option<[u32; 2]> {
    let axis = usize::from(side < 2);
    let mut next = at;
    next[axis] = if side % 2 == 1 { at[axis] + 1 } else { at[axis].checked_sub(1)? };
    (next[axis] < count[axis]).then_some(next)
}
