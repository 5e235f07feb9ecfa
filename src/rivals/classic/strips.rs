//! Index strips of the classic clipmap, rebuilt for every frame: each level's ring in four regions, each
//! cropped to the view (Brettell 2005, section 3.5.2, Algorithm 5).

use crate::clipmap::{Rect, Windows};
use crate::rivals::Ground;
use crate::rivals::stage::Stand;

/// Ends a strip.
pub(super) const RESTART: u32 = u32::MAX;

/// This frame's strips.
#[derive(Debug, Default)]
pub(super) struct Strips {
    pub indices: Vec<u32>,
    /// In them, those without area among them.
    pub triangles: u64,
}

impl Strips {
    pub fn rebuild(&mut self, windows: &Windows, stand: &Stand, ground: &Ground, cull: bool) {
        self.indices.clear();
        self.triangles = 0;
        for level in windows.finest..windows.shape.levels() {
            let mut seen = false;
            for region in regions(windows, level) {
                let cropped = if cull { crop(windows, level, region, stand, ground) } else { Some(region) };
                if let Some(region) = cropped.filter(|r| r.has_area()) {
                    self.push_region(windows, level, region);
                    seen = true;
                }
            }
            if seen && level + 1 < windows.shape.levels() {
                self.push_perimeter(windows, level);
            }
        }
    }

    fn push_region(&mut self, windows: &Windows, level: u32, region: Rect) {
        for y in region.lo[1]..region.hi[1] {
            for x in region.lo[0]..=region.hi[0] {
                // South first, so that cells are cut from south-east to north-west.
                self.indices.extend([address(windows, level, [x, y]), address(windows, level, [x, y + 1])]);
            }
            self.indices.push(RESTART);
            self.triangles += 2 * u64::from(region.hi[0].abs_diff(region.lo[0]));
        }
    }

    /// Triangles without area over the vertices that the coarser level lacks (Losasso and Hoppe 2004,
    /// section 5), so that rounding opens no gap along the straight edge.
    fn push_perimeter(&mut self, windows: &Windows, level: u32) {
        let area = windows.loaded(level);
        let end = windows.lattice.last_at(level);
        for axis in 0..2 {
            let across = 1 - axis;
            for border in [area.lo[across], area.hi[across]] {
                if border == 0 || border == end[across] {
                    continue; // the data ends here
                }
                let mut k = area.lo[axis] + (area.lo[axis] & 1);
                while k + 2 <= area.hi[axis] {
                    let at = |along: i32| {
                        let mut node = [border; 2];
                        node[axis] = along;
                        address(windows, level, node)
                    };
                    self.indices.extend([at(k), at(k + 2), at(k + 1), RESTART]);
                    self.triangles += 1;
                    k += 2;
                }
            }
        }
    }
}

/// Place of a node in the vertex buffer.
fn address(windows: &Windows, level: u32, node: [i32; 2]) -> u32 {
    let side = windows.shape.n() + 1;
    let wrapped = node.map(|v| v.cast_unsigned() & (side - 1));
    (level * side + wrapped[1]) * side + wrapped[0]
}

/// What a level draws, in its own lattice: all of its window, or the four sides of its ring.
fn regions(windows: &Windows, level: u32) -> Vec<Rect> {
    let all = windows.loaded(level);
    if level == windows.finest {
        return vec![all];
    }
    let lattice = windows.lattice;
    let fine = windows.loaded(level - 1);
    let inner = |node: [i32; 2]| lattice.node(level, lattice.base(level - 1, node));
    let hole = Rect { lo: inner(fine.lo), hi: inner(fine.hi) }.intersect(all);
    if !fine.has_area() || !hole.has_area() {
        return vec![all];
    }
    vec![
        Rect { lo: all.lo, hi: [all.hi[0], hole.lo[1]] },
        Rect { lo: [all.lo[0], hole.hi[1]], hi: all.hi },
        Rect { lo: [all.lo[0], hole.lo[1]], hi: [hole.lo[0], hole.hi[1]] },
        Rect { lo: [hole.hi[0], hole.lo[1]], hi: [all.hi[0], hole.hi[1]] },
    ]
    .into_iter()
    .filter(|r| r.has_area())
    .collect()
}

/// The least rectangle of a region with all that is in view; none when nothing is.
fn crop(windows: &Windows, level: u32, region: Rect, stand: &Stand, ground: &Ground) -> Option<Rect> {
    let lattice = windows.lattice;
    let base = Rect { lo: lattice.base(level, region.lo), hi: lattice.base(level, region.hi) };
    // Morphed heights lie between those of samples around.
    let around = 2 << level;
    let [low, high] = ground.range_over(base.lo.map(|v| v - around), base.hi.map(|v| v + around));
    let up = |h: f32| f64::from(h) - f64::from(stand.plane.anchor_height_m);
    let metres = |a: usize, v: i32| f64::from(v - stand.plane.anchor[a]) * stand.spacing_m[a];
    let lo = [metres(0, base.lo[0]), metres(1, base.lo[1]), up(low)];
    let hi = [metres(0, base.hi[0]), metres(1, base.hi[1]), up(high)];
    let mut kept = region;
    for plane in stand.frustum.planes {
        let plane = plane.map(f64::from);
        let far = [0, 1, 2].map(|a| plane[a] * if plane[a] >= 0.0 { hi[a] } else { lo[a] });
        let sum = far[0] + far[1] + far[2] + plane[3];
        if sum < 0.0 {
            return None;
        }
        for a in 0..2 {
            // Where the plane cuts the box along this axis, with the other two at their furthest.
            let at = -(sum - far[a]) / plane[a];
            if !at.is_finite() {
                continue;
            }
            let node = at / stand.spacing_m[a] + f64::from(stand.plane.anchor[a]);
            let node = node / f64::from(1_u32 << level);
            let (first, last) = (f64::from(region.lo[a]), f64::from(region.hi[a]));
            #[expect(clippy::cast_possible_truncation, reason = "clamped to the region")]
            if plane[a] > 0.0 {
                kept.lo[a] = kept.lo[a].max((node.floor() - 1.0).clamp(first, last) as i32);
            } else {
                kept.hi[a] = kept.hi[a].min((node.ceil() + 1.0).clamp(first, last) as i32);
            }
        }
    }
    kept.has_area().then_some(kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clipmap::{ClipmapShape, Lattice};

    #[test]
    fn regions_tile_the_ring() {
        let lattice = Lattice { last: [1_000, 731] };
        let shape = ClipmapShape::new(63, 5, lattice).unwrap();
        for centre in [[500.0, 300.0], [0.0, 0.0], [3.0, 731.0], [1_000.0, 17.0]] {
            let windows = Windows::place(shape, lattice, centre, 0);
            let area = |r: &Rect| {
                let (lo, hi) = (lattice.base(0, r.lo), r.hi);
                i64::from(hi[0] - lo[0]) * i64::from(hi[1] - lo[1])
            };
            for level in 1..5 {
                let all = windows.loaded(level);
                let fine = windows.loaded(level - 1);
                let inner = |n: [i32; 2]| lattice.node(level, lattice.base(level - 1, n));
                let hole = Rect { lo: inner(fine.lo), hi: inner(fine.hi) };
                let sum: i64 = regions(&windows, level).iter().map(area).sum();
                assert_eq!(sum + area(&hole), area(&all), "{centre:?} level {level}");
            }
        }
    }
}
