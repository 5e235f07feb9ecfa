//! Positions and normals of vertices (shaders/shared/positions.wgsl), in f32 as the GPU has them.

use crate::clipmap::Windows;
use crate::pyramid::{SampleSource, VOID};

/// One expanded vertex. The GPU's layout: three floats and one packed word, 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Vertex {
    /// Metres east, north and up of the anchor.
    pub position: [f32; 3],
    /// Normal (octahedral, 2 x 12 bits), level (5 bits), block kind (3 bits), from low to high.
    pub packed: u32,
}

impl Vertex {
    /// Level of the patch that wrote the vertex.
    #[must_use]
    pub fn level(self) -> u32 {
        (self.packed >> 24) & 31
    }

    /// Block kind of the patch that wrote the vertex.
    #[must_use]
    pub fn kind(self) -> u32 {
        self.packed >> 29
    }
}

/// Where the mesh stands: what turns lattice indices and heights into positions.
#[derive(Clone, Debug)]
pub struct Placement {
    /// Windows of all levels.
    pub windows: Windows,
    /// Base sample the positions are relative to; near the camera, a function of the windows alone.
    pub anchor: [i32; 2],
    /// Height of the anchor in metres.
    pub anchor_height_m: f32,
    /// Metres between base samples, east and north.
    pub spacing_m: [f32; 2],
    /// Camera relative to the anchor in base samples, for the geomorph.
    pub eye_samples: [f32; 2],
    /// True when vertices near a level's perimeter move towards the coarser level.
    pub morph: bool,
    /// How much of the coarser surface each whole level shows, 0 to 1: a level that has just arrived grows
    /// out of it.
    pub fades: [f32; crate::clipmap::MAX_LEVELS as usize],
}

impl Placement {
    /// Position of a vertex and whether it is valid (not void), for a patch of `level`.
    #[must_use]
    pub fn position(&self, source: &dyn SampleSource, level: u32, base: [i32; 2]) -> ([f32; 3], bool) {
        let owner = self.windows.owner(level, base);
        let height = self.height(source, owner, base);
        let [x, y] = self.ground(base);
        let up = if height == VOID { 0.0 } else { height - self.anchor_height_m };
        ([x, y, up], height != VOID)
    }

    /// Metres east and north of the anchor; one rounding, no fused operation possible.
    pub(crate) fn ground(&self, base: [i32; 2]) -> [f32; 2] {
        [0, 1].map(|a| (base[a] - self.anchor[a]) as f32 * self.spacing_m[a])
    }

    /// Height of the node of `level` at `base`, morphed where that is on.
    pub(crate) fn height(&self, source: &dyn SampleSource, level: u32, base: [i32; 2]) -> f32 {
        let lattice = self.windows.lattice;
        let index = lattice.node(level, base);
        let own = source.sample(level, index);
        if !self.morph || level + 1 >= self.windows.shape.levels() || own == VOID {
            return own;
        }
        let alpha = self.morph_weight(level, base);
        if alpha == 0.0 {
            return own;
        }
        let coarse = self.coarse_height(source, level + 1, index, lattice.last_at(level));
        if coarse == VOID {
            return own;
        }
        // Clamped, or rounding could lift it out of the bounds of both.
        (own * (1.0 - alpha) + coarse * alpha).clamp(own.min(coarse), own.max(coarse))
    }

    /// The surface of `level` at node `index` of the finer lattice, on its own triangles: cells are
    /// cut from south-east to north-west, so the middle of a cell is the mean of those corners.
    fn coarse_height(&self, source: &dyn SampleSource, level: u32, index: [i32; 2], last: [i32; 2]) -> f32 {
        let [a, b] = coarse_ends(index, last).map(|end| source.sample(level, end));
        if a == VOID || b == VOID { VOID } else { (a + b) * 0.5 }
    }

    /// 0 in the middle of the window, 1 at its perimeter (Losasso and Hoppe 2004, section 5).
    pub(crate) fn morph_weight(&self, level: u32, base: [i32; 2]) -> f32 {
        let cells = self.windows.shape.cells() as f32;
        let width = cells * 0.1;
        // The camera may stand three units off the window's centre: the weight is 1 before the border.
        let start = cells * 0.5 - 3.0 * self.windows.shape.unit() as f32 - width;
        let scale = 1.0 / (1_u32 << level) as f32;
        let away = [0, 1].map(|a| (((base[a] - self.anchor[a]) as f32 - self.eye_samples[a]) * scale).abs());
        ((away[0].max(away[1]) - start) / width).clamp(0.0, 1.0).max(self.fades[level as usize])
    }

    /// Normal at the node a patch of `level` shows at `base`, from central differences of samples; morphed as
    /// the heights are.
    #[must_use]
    pub fn normal(&self, source: &dyn SampleSource, level: u32, base: [i32; 2]) -> [f32; 3] {
        let owner = self.windows.owner(level, base);
        let lattice = self.windows.lattice;
        let index = lattice.node(owner, base);
        let mut slope = self.slope(source, owner, index);
        if self.morph && owner + 1 < self.windows.shape.levels() {
            let (alpha, last) = (self.morph_weight(owner, base), lattice.last_at(owner));
            if alpha > 0.0 && self.coarse_height(source, owner + 1, index, last) != VOID {
                let [p, q] = coarse_ends(index, last).map(|end| self.slope(source, owner + 1, end));
                slope = [0, 1].map(|a| slope[a] * (1.0 - alpha) + (p[a] + q[a]) * 0.5 * alpha);
            }
        }
        let length = (slope[0] * slope[0] + slope[1] * slope[1] + 1.0).sqrt();
        [-slope[0] / length, -slope[1] / length, 1.0 / length]
    }

    /// Slope at a node, one-sided at the window's border.
    fn slope(&self, source: &dyn SampleSource, level: u32, index: [i32; 2]) -> [f32; 2] {
        let lattice = self.windows.lattice;
        let loaded = self.windows.loaded(level);
        let centre = source.sample(level, index);
        [0, 1].map(|a| {
            let (mut low, mut high) = (index, index);
            low[a] = (index[a] - 1).max(loaded.lo[a]);
            high[a] = (index[a] + 1).min(loaded.hi[a]);
            let at = |p: [i32; 2]| {
                let h = source.sample(level, p);
                if h == VOID { centre } else { h }
            };
            let run = (lattice.base(level, high)[a] - lattice.base(level, low)[a]) as f32;
            (at(high) - at(low)) / (run * self.spacing_m[a])
        })
    }
}

/// Nodes of the coarser level at the ends of the edge that node `index` of the finer lattice halves.
pub(crate) fn coarse_ends(index: [i32; 2], last: [i32; 2]) -> [[i32; 2]; 2] {
    let odd = [0, 1].map(|a| index[a] % 2 == 1 && index[a] != last[a]);
    let low = [0, 1].map(|a| if odd[a] { index[a] / 2 } else { (index[a] + 1) / 2 });
    let step = odd.map(i32::from);
    [[low[0] + step[0], low[1]], [low[0], low[1] + step[1]]]
}

/// Unit normal from the packed word of a [`Vertex`]; within 0.04 degrees of what was packed.
#[must_use]
pub fn unpack_normal(packed: u32) -> [f32; 3] {
    let part = |shift: u32| ((packed >> shift) & 0xfff) as f32 / 4095.0 * 2.0 - 1.0;
    let (u, v) = (part(0), part(12));
    let z = 1.0 - u.abs() - v.abs();
    let length = (u * u + v * v + z * z).sqrt();
    [u / length, v / length, z / length]
}
