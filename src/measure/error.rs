//! How far what a method drew is from the full-resolution surface, whatever the method.
//!
//! A method gives the triangles it drew ([`DrawnMesh`](crate::rivals::DrawnMesh), read back from the buffers
//! they were drawn from) and the depth picture it made. The truth is the [`Ground`] and the depth picture of
//! all of its samples, drawn with every triangle (brute force). Both are seen by the same camera over a
//! plane, through one projection in f64.
//!
//! - **Drawn height** at a base sample: interpolated on the drawn triangle over it, edges and corners
//!   included. Triangles without area in the ground plan are left out. Where several triangles differ, the
//!   one farthest from the truth counts, so that nothing is hidden ([`DrawnHeights`]).
//! - **Visible sample**: inside the picture, beyond the near plane and not behind what the true depth picture
//!   shows ([`TrueView`]). At most 2^19 a view are measured: every k-th in row-major order.
//! - **Screen-space error**: pixels between the projections of the drawn and of the true point, at the same
//!   sample, over the visible ones that something was drawn at ([`PixelError`]).
//! - **Vertical error**: metres between drawn and true height, over the same samples ([`VerticalError`]). What
//!   is drawn out of view does not count: how much that is, and how far from the truth, follows from how
//!   tightly a method culls.
//! - **Pop**: pixels between the projections of what was drawn for two consecutive frames of a path, the camera
//!   of the first one held, over samples visible in it and inside the second one's picture ([`PopError`]). It
//!   grows with the step between the frames.
//! - **Crack pixel**: background in the method's picture where the truth shows terrain, there and at all
//!   eight neighbours, not connected with the picture's border through other background pixels, and whose ray
//!   passes from above the drawn surface (the true one where nothing was drawn) to below it. What a method
//!   misses along its silhouette is no crack, nor is sky between two ridges.
//! - **Coverage mismatch**: a pixel where exactly one of both pictures shows terrain.
//! - **Uncovered sample**: a visible one that nothing was drawn at.
//! - **Read-back mismatch**: a pixel whose depth is not that of the mesh read back. Its share proves that the
//!   mesh is what was drawn; it is no error of the method. A few are in order where an edge crosses base
//!   cells (steep stitching) or where a triangle without plan area shows; the caller judges the share.
//! - **Percentile**: linear interpolation at p * (N - 1) over the samples of all views together; p99 only
//!   from N = 1,000, else null.

mod below;
mod drawn_heights;
mod picture;
#[cfg(test)]
mod tests;
mod true_view;

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

pub use self::drawn_heights::DrawnHeights;
pub use self::true_view::TrueView;
use super::percentile;
use crate::camera::Camera;
use crate::rivals::Ground;
use crate::scene::Terrain;

/// Fewest values that a 99th percentile is told of.
const LEAST_FOR_P99: usize = 1_000;

/// Sums over views; [`ErrorSums::report`] tells them at any time.
#[derive(Clone, Debug, Default)]
pub struct ErrorSums {
    views: u64,
    pixels_off: Vec<f32>,
    uncovered_samples: u64,
    vertical_m: Vec<f32>,
    pops: u64,
    pixels_popped: Vec<f32>,
    picture: picture::Counts,
}

impl ErrorSums {
    /// Adds the screen-space and vertical errors of what was drawn in one view.
    pub fn add(&mut self, ground: &Ground, terrain: &Terrain, view: &TrueView, drawn: &DrawnHeights) {
        self.views += 1;
        let off = view.visible().par_iter().filter_map(|ix| {
            let ix = *ix as usize;
            let difference_m = drawn.at(ix)?;
            apart_px(terrain, ground, view, ix, [difference_m, 0.0])
        });
        self.pixels_off.par_extend(off);
        let missing = view.visible().par_iter().filter(|ix| drawn.at(**ix as usize).is_none());
        self.uncovered_samples += missing.count() as u64;
        let above_m = view.visible().iter().map(|ix| drawn.differences_m()[*ix as usize]);
        self.vertical_m.extend(above_m.filter(|d| !d.is_nan()).map(f32::abs));
    }

    /// Adds a pop: what was drawn for one camera and for the next one, both seen by the first. Samples outside
    /// the next one's picture are left out, as are those that nothing was drawn at before or after.
    pub fn add_pop(
        &mut self,
        ground: &Ground,
        terrain: &Terrain,
        view: &TrueView,
        before: &DrawnHeights,
        next: &Camera,
        after: &DrawnHeights,
    ) {
        self.pops += 1;
        let then = TrueView::blind(terrain, next, view.size_px);
        let popped = view.visible().par_iter().filter_map(|ix| {
            let ix = *ix as usize;
            let truth = place(terrain, ground, ix, ground.heights[ix].into());
            if !then.frames(truth) {
                return None;
            }
            apart_px(terrain, ground, view, ix, [before.at(ix)?, after.at(ix)?])
        });
        self.pixels_popped.par_extend(popped);
    }

    /// Compares a method's depth picture (as that of [`TrueView::of`]) with the true one, and with what was
    /// read back of the mesh that it shows.
    ///
    /// # Panics
    /// When `depth` is not of the view's size.
    pub fn add_picture(
        &mut self,
        ground: &Ground,
        terrain: &Terrain,
        view: &TrueView,
        drawn: &DrawnHeights,
        depth: &[f32],
    ) {
        self.picture.add(terrain, ground, view, drawn, depth);
    }

    /// All figures so far.
    #[must_use]
    pub fn report(&self) -> ErrorReport {
        let px = sorted(&self.pixels_off);
        let pop = sorted(&self.pixels_popped);
        let vertical_m = sorted(&self.vertical_m);
        let share = |part: usize, of: usize| (of > 0).then(|| part as f64 / of as f64);
        let over_1 = px.len() - px.partition_point(|p| *p <= 1.0);
        let squares: f64 = vertical_m.iter().map(|m| m * m).sum();
        ErrorReport {
            views: self.views,
            samples: px.len() as u64,
            px: PixelError {
                mean: (!px.is_empty()).then(|| px.iter().sum::<f64>() / px.len() as f64),
                p95: percentile(&px, 0.95),
                p99: p99(&px),
                max: px.last().copied(),
                share_over_1: share(over_1, px.len()),
            },
            vertical_m: VerticalError {
                rms: (!vertical_m.is_empty()).then(|| (squares / vertical_m.len() as f64).sqrt()),
                p99: p99(&vertical_m),
                max: vertical_m.last().copied(),
            },
            pop_px: PopError { p99: p99(&pop), max: pop.last().copied() },
            pops: self.pops,
            crack_pixels: self.picture.crack_pixels,
            coverage_mismatch_pixels: self.picture.coverage_mismatch_pixels,
            uncovered_samples: self.uncovered_samples,
            read_back_mismatch_pixels: self.picture.read_back_mismatch_pixels,
            pixels: self.picture.pixels,
        }
    }
}

/// Pixels between two points over one base sample, given by their heights above the truth in metres; `None`
/// when one of them lies before the near plane.
fn apart_px(
    terrain: &Terrain,
    ground: &Ground,
    view: &TrueView,
    ix: usize,
    above_m: [f64; 2],
) -> Option<f32> {
    let truth_m = f64::from(ground.heights[ix]);
    let [a, b] = above_m.map(|m| view.project(place(terrain, ground, ix, truth_m + m)));
    Some(a?.distance(b?) as f32)
}

/// World point at a height over base sample `ix`, metres.
fn place(terrain: &Terrain, ground: &Ground, ix: usize, height_m: f64) -> DVec3 {
    let width = ground.size[0] as usize;
    let along = |a: usize, at: usize| terrain.origin_m[a] + at as f64 * ground.spacing_m[a];
    DVec3::new(along(0, ix % width), along(1, ix / width), height_m)
}

/// Every how many of `count` values to keep so that at most `most` remain.
fn keep_every(count: usize, most: usize) -> usize {
    count.div_ceil(most).max(1)
}

fn sorted(values: &[f32]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.par_sort_unstable_by(f32::total_cmp);
    values.into_iter().map(f64::from).collect()
}

fn p99(sorted: &[f64]) -> Option<f64> {
    if sorted.len() >= LEAST_FOR_P99 { percentile(sorted, 0.99) } else { None }
}

/// Errors over all views added. `None` is null in the report, never 0.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ErrorReport {
    /// Views whose errors were added.
    pub views: u64,
    /// Visible samples measured, over all views.
    pub samples: u64,
    /// Screen-space error.
    pub px: PixelError,
    /// Vertical error.
    pub vertical_m: VerticalError,
    /// Screen-space error between the meshes before and after shifts.
    pub pop_px: PopError,
    /// Pairs of meshes that pops were measured on.
    pub pops: u64,
    /// Background pixels enclosed in terrain where the truth shows terrain, there and all around; best 0.
    pub crack_pixels: u64,
    /// Pixels where exactly one of method and truth shows terrain; best 0.
    pub coverage_mismatch_pixels: u64,
    /// Visible samples where nothing was drawn; best 0.
    pub uncovered_samples: u64,
    /// Pixels drawn elsewhere than the mesh read back has its surface: of the probe, not of the method; best
    /// 0.
    pub read_back_mismatch_pixels: u64,
    /// Pixels where the truth shows terrain, over all pictures compared.
    pub pixels: u64,
}

/// Pixels between drawn and true point over visible samples; best 0.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PixelError {
    /// Sum / samples.
    pub mean: Option<f64>,
    /// 95th percentile.
    pub p95: Option<f64>,
    /// 99th percentile; null below 1,000 samples.
    pub p99: Option<f64>,
    /// Largest.
    pub max: Option<f64>,
    /// Samples off by more than one pixel / samples; best 0, worst 1.
    pub share_over_1: Option<f64>,
}

/// Metres between drawn and true height over samples that something was drawn at; best 0.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct VerticalError {
    /// Root of (sum of squares / samples), over all samples.
    pub rms: Option<f64>,
    /// 99th percentile of the magnitude over every k-th covered sample in row-major order, at most 2^20 a
    /// view; null below 1,000 samples.
    pub p99: Option<f64>,
    /// Largest magnitude, over all samples.
    pub max: Option<f64>,
}

/// Pixels between what was drawn before and after a shift, over visible samples; best 0.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PopError {
    /// 99th percentile; null below 1,000 samples.
    pub p99: Option<f64>,
    /// Largest.
    pub max: Option<f64>,
}
