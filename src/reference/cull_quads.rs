//! Twin of shaders/cull_quads.wgsl: bounds of a patch and the frustum test.

use super::Placement;
use crate::clipmap::Rect;
use crate::pyramid::{SampleSource, VOID};
use crate::quads::Patch;

/// Axis-aligned box in metres from the anchor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// West, south, bottom.
    pub lo: [f32; 3],
    /// East, north, top.
    pub hi: [f32; 3],
}

/// The planes a camera sees between: left, right, bottom, top, near. `xyz` is the inward normal,
/// `w` the offset; metres from the anchor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    /// The five planes (the far one lies at infinity).
    pub planes: [[f32; 4]; 5],
}

/// Bounds of a patch from the samples themselves; `None` when all of them are void.
///
/// The GPU takes them from blocks of 16 x 16 cells, so its boxes may be larger, never smaller.
#[must_use]
pub fn patch_bounds(placement: &Placement, source: &dyn SampleSource, patch: &Patch) -> Option<Bounds> {
    let level = patch.level;
    let windows = &placement.windows;
    let lattice = windows.lattice;
    let mut range: Option<[f32; 2]> = None;
    let mut take = |level: u32, rect: Rect| {
        let rect = rect.intersect(windows.loaded(level));
        if rect.is_empty() {
            return;
        }
        let mut samples = Vec::new();
        source.read(level, rect, &mut samples);
        for h in samples.into_iter().filter(|h| *h != VOID) {
            let r = range.unwrap_or([h, h]);
            range = Some([r[0].min(h), r[1].max(h)]);
        }
    };
    take(level, patch.rect);
    let base = Rect { lo: lattice.base(level, patch.rect.lo), hi: lattice.base(level, patch.rect.hi) };
    if level > windows.finest {
        let fine = Rect { lo: lattice.node(level - 1, base.lo), hi: lattice.node(level - 1, base.hi) };
        take(level - 1, fine);
    }
    if placement.morph && level + 1 < windows.shape.levels() {
        let coarse =
            Rect { lo: base.lo.map(|v| (v >> (level + 1)) - 1), hi: base.hi.map(|v| (v >> (level + 1)) + 2) };
        take(level + 1, coarse);
    }
    let [low, high] = range?;
    let ground = |b: [i32; 2]| [0, 1].map(|a| (b[a] - placement.anchor[a]) as f32 * placement.spacing_m[a]);
    let (lo, hi) = (ground(base.lo), ground(base.hi));
    let up = |h: f32| h - placement.anchor_height_m;
    Some(Bounds { lo: [lo[0], lo[1], up(low)], hi: [hi[0], hi[1], up(high)] })
}

/// False only when the box lies wholly outside one of the planes (Assarsson and Moller 2000: the
/// corner furthest along the plane's normal decides).
#[must_use]
pub fn visible(frustum: &Frustum, bounds: &Bounds) -> bool {
    frustum.planes.iter().all(|plane| {
        let mut sum = plane[3];
        let mut size = plane[3].abs();
        for (normal, (lo, hi)) in plane.iter().zip(bounds.lo.iter().zip(&bounds.hi)) {
            let term = normal * if *normal >= 0.0 { hi } else { lo };
            sum += term;
            size += term.abs();
        }
        // Rounding of the four terms must never hide what is visible.
        sum >= -1e-5 * size
    })
}
