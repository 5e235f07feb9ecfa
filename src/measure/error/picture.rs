//! A method's depth picture against the true one, and against the mesh read back.

use glam::DVec3;
use rayon::prelude::*;

use super::{DrawnHeights, TrueView};
use crate::rivals::Ground;
use crate::scene::Terrain;

/// How far from the pixel's centre a depth may have been taken: rasterisers snap vertices to 1/16 to 1/256 of
/// a pixel. What f32 depth rounds (1e-7 of the distance) is a thousand times less.
const SLIP_PX: f64 = 1.0 / 16.0;
/// Most cells around a point looked at for where the surface may be; only where pixels span 64 cells are
/// there more.
const MOST_REACH: f64 = 4.0;
/// Least distance from the data's border, in base cells, that a point is judged at.
const BORDER_CELLS: f64 = 1e-3;
/// How far over the corners of a cell its surface may reach, as a share of their range: an edge may cross it.
const OVER_RANGE: f64 = 0.05;
/// What heights in f32 may lose, metres.
const HEIGHT_SLACK_M: f64 = 1e-3;

/// Pixels of all pictures compared.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    /// Where the truth shows terrain.
    pub pixels: u64,
    /// Enclosed background inside the true terrain.
    pub crack_pixels: u64,
    /// Terrain in one picture only.
    pub coverage_mismatch_pixels: u64,
    /// Drawn elsewhere than the mesh lies.
    pub read_back_mismatch_pixels: u64,
}

impl Counts {
    pub fn add(
        &mut self,
        terrain: &Terrain,
        ground: &Ground,
        view: &TrueView,
        drawn: &DrawnHeights,
        depth: &[f32],
    ) {
        let [width, height] = view.size_px.map(|v| v as usize);
        assert_eq!(depth.len(), width * height, "a depth of each pixel");
        let holes = enclosed(depth, [width, height]);
        let mesh = ReadBack { terrain, ground, drawn };
        for (ix, hole) in holes.into_iter().enumerate() {
            let truth = view.is_terrain(ix);
            self.pixels += u64::from(truth);
            self.coverage_mismatch_pixels += u64::from(truth != (depth[ix] > 0.0));
            if hole && terrain_around(view, ix) {
                let pixel = [(ix % width) as u32, (ix / width) as u32];
                self.crack_pixels += u64::from(mesh.looks_below(&view.camera, pixel, view.size_px));
            }
        }
        let pixels = depth.par_iter().enumerate();
        let wrong = pixels.filter(|(ix, d)| **d > 0.0 && !mesh.may_show(view, *ix, **d));
        self.read_back_mismatch_pixels += wrong.count() as u64;
    }
}

/// True when the truth shows terrain at a pixel and its eight neighbours; never on the picture's border.
fn terrain_around(view: &TrueView, ix: usize) -> bool {
    let [width, height] = view.size_px.map(|v| v as usize);
    let (x, y) = (ix % width, ix / width);
    if x == 0 || y == 0 || x + 1 >= width || y + 1 >= height {
        return false;
    }
    (y - 1..=y + 1).all(|y| (x - 1..=x + 1).all(|x| view.is_terrain(y * width + x)))
}

/// Background pixels that are not connected with the picture's border through the sides of other ones.
fn enclosed(depth: &[f32], [width, height]: [usize; 2]) -> Vec<bool> {
    // Background not yet reached from the border.
    let mut inside: Vec<bool> = depth.iter().map(|d| *d <= 0.0).collect();
    let mut queue: Vec<usize> = (0..depth.len())
        .filter(|ix| {
            let (x, y) = (ix % width, ix / width);
            x == 0 || y == 0 || x + 1 == width || y + 1 == height
        })
        .collect();
    while let Some(ix) = queue.pop() {
        if !std::mem::take(&mut inside[ix]) {
            continue;
        }
        let (x, y) = (ix % width, ix / width);
        if x > 0 {
            queue.push(ix - 1);
        }
        if x + 1 < width {
            queue.push(ix + 1);
        }
        if y > 0 {
            queue.push(ix - width);
        }
        if y + 1 < height {
            queue.push(ix + width);
        }
    }
    inside
}

/// The mesh read back, to be found in a picture.
pub(super) struct ReadBack<'a> {
    pub terrain: &'a Terrain,
    pub ground: &'a Ground,
    pub drawn: &'a DrawnHeights,
}

impl ReadBack<'_> {
    /// False when the mesh does not pass where a pixel of the given depth shows a surface. Inside a base cell
    /// the surface lies between the lowest and the highest corner; of cells, those count that the point may
    /// lie in. True where it cannot be judged: beside the data, on its border, or where nothing was drawn at
    /// a corner.
    fn may_show(&self, view: &TrueView, pixel_ix: usize, depth: f32) -> bool {
        let (point_m, pixel_m) = view.unproject(pixel_ix, depth);
        let slip_m = SLIP_PX * pixel_m;
        let reach = self.ground.spacing_m.map(|spacing_m| (slip_m / spacing_m).min(MOST_REACH));
        let Some(range_m) = self.range_around(point_m, reach) else {
            return true;
        };
        let slack_m = OVER_RANGE * (range_m[1] - range_m[0]) + HEIGHT_SLACK_M + slip_m;
        (range_m[0] - slack_m..=range_m[1] + slack_m).contains(&point_m.z)
    }

    /// Lowest and highest corner, metres, of the base cells within `reach` (base cells) of a point; `None`
    /// beside the data, on its border, or where nothing was drawn at a corner.
    pub fn range_around(&self, point_m: DVec3, reach: [f64; 2]) -> Option<[f64; 2]> {
        self.range_of(point_m, reach, |ix| Some(f64::from(self.ground.heights[ix]) + self.drawn.at(ix)?))
    }

    /// As [`ReadBack::range_around`], of the true surface.
    pub fn true_range(&self, point_m: DVec3) -> Option<[f64; 2]> {
        self.range_of(point_m, [0.0; 2], |ix| Some(self.ground.heights[ix].into()))
    }

    fn range_of(
        &self,
        point_m: DVec3,
        reach: [f64; 2],
        height_m: impl Fn(usize) -> Option<f64>,
    ) -> Option<[f64; 2]> {
        let at = self.terrain.samples_from_world(point_m);
        let last = self.ground.last();
        let inside = |a: usize| (BORDER_CELLS..=f64::from(last[a]) - BORDER_CELLS).contains(&at[a]);
        if !(inside(0) && inside(1)) {
            return None;
        }
        let lo = [0, 1].map(|a| ((at[a] - reach[a]).floor() as i32).max(0));
        let hi = [0, 1].map(|a| ((at[a] + reach[a]).floor() as i32 + 1).min(last[a]));
        let mut range_m = [f64::INFINITY, f64::NEG_INFINITY];
        for y in lo[1]..=hi[1] {
            for x in lo[0]..=hi[0] {
                let height_m = height_m(self.ground.index([x, y]))?;
                range_m = [range_m[0].min(height_m), range_m[1].max(height_m)];
            }
        }
        Some(range_m)
    }
}
