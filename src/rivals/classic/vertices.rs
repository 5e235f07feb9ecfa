//! Vertices of the classic clipmap: x, y, the height, and the height of the next coarser level's surface.

use crate::clipmap::Rect;
use crate::pyramid::SampleSource;
use crate::reference::{Placement, coarse_ends};
use crate::rivals::ground::pack_normal;

/// As `vs_clip` takes it.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct ClipVertex {
    /// Base sample.
    pub base: [i32; 2],
    /// Own height and that of the coarser surface, metres.
    pub heights: [f32; 2],
    /// Packed normal | level << 24.
    pub packed: u32,
}

impl ClipVertex {
    /// Twin of `vs_clip`.
    pub fn position(&self, placement: &Placement) -> [f32; 3] {
        let [own, coarse] = self.heights;
        let alpha = placement.morph_weight((self.packed >> 24) & 31, self.base);
        let height = (own * (1.0 - alpha) + coarse * alpha).clamp(own.min(coarse), own.max(coarse));
        let [x, y] = placement.ground(self.base);
        [x, y, height - placement.anchor_height_m]
    }
}

/// Makes vertices from samples.
pub(super) struct Maker<'a> {
    pub source: &'a dyn SampleSource,
    pub placement: &'a Placement,
}

/// Samples of a rectangle of one level.
struct Block {
    rect: Rect,
    samples: Vec<f32>,
}

impl Block {
    fn at(&self, node: [i32; 2]) -> f32 {
        let width = self.rect.hi[0].abs_diff(self.rect.lo[0]) as usize + 1;
        let [x, y] = [0, 1].map(|a| node[a].abs_diff(self.rect.lo[a]) as usize);
        self.samples[y * width + x]
    }
}

impl Maker<'_> {
    fn read(&self, level: u32, lo: [i32; 2], hi: [i32; 2]) -> Block {
        let all = Rect { lo: [0, 0], hi: self.placement.windows.lattice.last_at(level) };
        let rect = Rect { lo, hi }.intersect(all);
        let mut samples = Vec::new();
        self.source.read_now(level, rect, &mut samples);
        Block { rect, samples }
    }

    /// Appends the vertices of a rectangle of a level's nodes, row by row.
    pub fn make(&self, level: u32, rect: Rect, out: &mut Vec<ClipVertex>) {
        let windows = &self.placement.windows;
        let lattice = windows.lattice;
        let last = lattice.last_at(level);
        let own = self.read(level, rect.lo.map(|v| v - 1), rect.hi.map(|v| v + 1));
        let coarsest = level + 1 == windows.shape.levels();
        let coarse = (!coarsest)
            .then(|| self.read(level + 1, rect.lo.map(|v| v / 2), rect.hi.map(|v| (v + 1) / 2 + 1)));
        let spacing = self.placement.spacing_m;
        for y in rect.lo[1]..=rect.hi[1] {
            for x in rect.lo[0]..=rect.hi[0] {
                let node = [x, y];
                let height = own.at(node);
                let under = coarse.as_ref().map_or(height, |c| {
                    let [a, b] = coarse_ends(node, last);
                    (c.at(a) + c.at(b)) * 0.5
                });
                let slope = [0, 1].map(|a| {
                    let (mut low, mut high) = (node, node);
                    low[a] = (node[a] - 1).max(0);
                    high[a] = (node[a] + 1).min(last[a]);
                    let run = lattice.base(level, high)[a] - lattice.base(level, low)[a];
                    (own.at(high) - own.at(low)) / (run as f32 * spacing[a])
                });
                out.push(ClipVertex {
                    base: lattice.base(level, node),
                    heights: [height, under],
                    packed: pack_normal(slope) | level << 24,
                });
            }
        }
    }
}
