//! Which samples of the full-resolution surface a camera sees, and where they fall in its picture.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use super::{keep_every, place};
use crate::camera::Camera;
use crate::renderer::clip;
use crate::rivals::Ground;
use crate::scene::Terrain;

/// Most visible samples of a view that are kept.
const MOST_VISIBLE: usize = 1 << 19;
/// How much farther than the surface a sample may lie and still be seen, as a share of the distance: far
/// above what f32 depth loses, far below what one ridge lies behind another.
const FARTHER: f64 = 1e-3;

/// What one camera truly sees of the full-resolution surface.
#[derive(Clone, Debug)]
pub struct TrueView {
    /// The camera.
    pub camera: Camera,
    /// Width and height of the picture, pixels.
    pub size_px: [u32; 2],
    visible: Vec<u32>,
    depth: Vec<f32>,
    /// Rows: right, up, forward.
    view: DMat3,
    /// Pixels a unit of tangent.
    focal_px: f64,
    half_px: DVec2,
    near_m: f64,
}

impl TrueView {
    /// `depth`: the depth picture of the full-resolution surface (brute force) for this camera, reverse-Z and
    /// infinitely far: near plane's distance / distance along the view, 0 for sky; rows from the top.
    ///
    /// A sample is visible when it falls into the picture beyond the near plane, and its distance along the
    /// view is at most (farthest of the 3 x 3 pixels around it) * 1.001 + half a sample spacing. The farthest
    /// of nine, because the pixel's own centre may lie beside the ridge that the sample stands on or the
    /// groove that it lies in: rather a sample within a pixel of a silhouette too many than an error hidden.
    /// Half a spacing, because roughness of a size with the cells, which pixels may pass between, must not
    /// hide samples. Every k-th visible sample in row-major order is kept, with the least k that leaves at
    /// most 2^19.
    ///
    /// # Panics
    /// When `depth` is not of the size given.
    #[must_use]
    pub fn of(terrain: &Terrain, ground: &Ground, camera: &Camera, size_px: [u32; 2], depth: &[f32]) -> Self {
        assert_eq!(depth.len(), size_px[0] as usize * size_px[1] as usize, "a depth of each pixel");
        let mut view = Self { depth: depth.to_vec(), ..Self::blind(terrain, camera, size_px) };
        let least = least_around(depth, size_px);
        let slack_m = 0.5 * ground.spacing_m[0].max(ground.spacing_m[1]);
        let seen: Vec<u32> = ground
            .heights
            .par_iter()
            .enumerate()
            .filter_map(|(ix, height)| {
                let at = place(terrain, ground, ix, f64::from(*height));
                view.sees(at, &least, slack_m).then_some(ix as u32)
            })
            .collect();
        let step = keep_every(seen.len(), MOST_VISIBLE);
        view.visible = seen.into_iter().step_by(step).collect();
        view
    }

    /// The projection alone: nothing is known to be visible.
    pub(super) fn blind(terrain: &Terrain, camera: &Camera, size_px: [u32; 2]) -> Self {
        let [right, up] = camera.right_and_up();
        let half_px = DVec2::from_array(size_px.map(|v| f64::from(v) * 0.5));
        Self {
            camera: *camera,
            size_px,
            visible: Vec::new(),
            depth: Vec::new(),
            view: DMat3::from_cols(right, up, camera.forward()).transpose(),
            focal_px: half_px.y / (camera.fov_deg.to_radians() * 0.5).tan(),
            half_px,
            // Before division depth is the near plane's distance, whatever the point.
            near_m: clip(terrain, camera, camera.eye_m, size_px).row(2).w,
        }
    }

    /// True when a world point (metres) falls into the picture, beyond the near plane.
    pub(super) fn frames(&self, world_m: DVec3) -> bool {
        let size = self.half_px * 2.0;
        self.project(world_m).is_some_and(|px| px.cmpge(DVec2::ZERO).all() && px.cmplt(size).all())
    }

    /// Visible samples kept: indices into [`Ground::heights`], ascending.
    #[must_use]
    pub fn visible(&self) -> &[u32] {
        &self.visible
    }

    /// True where the full-resolution surface shows at a pixel, counted in rows from the top left.
    #[must_use]
    pub fn is_terrain(&self, pixel_ix: usize) -> bool {
        self.depth.get(pixel_ix).is_some_and(|d| *d > 0.0)
    }

    /// Where a world point (metres) falls in the picture, pixels from the top left; `None` before the near
    /// plane.
    #[must_use]
    pub fn project(&self, world_m: DVec3) -> Option<DVec2> {
        let p = self.view * (world_m - self.camera.eye_m);
        (p.z >= self.near_m).then(|| self.in_picture(p))
    }

    /// The world point (metres) that a pixel of the given depth shows, and how many metres a pixel spans
    /// there.
    pub(super) fn unproject(&self, pixel_ix: usize, depth: f32) -> (DVec3, f64) {
        let width = self.size_px[0] as usize;
        let pixel = [pixel_ix % width, pixel_ix / width].map(|v| v as u32);
        let distance_m = self.near_m / f64::from(depth);
        let ray = self.camera.ray(pixel, self.size_px);
        (self.camera.eye_m + ray * distance_m, distance_m / self.focal_px)
    }

    /// Pixels of a point beyond the near plane, given along right, up and forward.
    fn in_picture(&self, p: DVec3) -> DVec2 {
        self.half_px + DVec2::new(p.x, -p.y) * (self.focal_px / p.z)
    }

    /// `least`: the least depth around each pixel.
    fn sees(&self, world_m: DVec3, least: &[f32], slack_m: f64) -> bool {
        let p = self.view * (world_m - self.camera.eye_m);
        if p.z < self.near_m {
            return false;
        }
        let px = self.in_picture(p);
        let size = self.half_px * 2.0;
        if !(px.cmpge(DVec2::ZERO).all() && px.cmplt(size).all()) {
            return false;
        }
        // Inside the picture, so whole pixels are what the cut leaves.
        let depth = f64::from(least[px.y as usize * self.size_px[0] as usize + px.x as usize]);
        // Sky is infinitely far.
        depth <= 0.0 || p.z <= self.near_m / depth * (1.0 + FARTHER) + slack_m
    }
}

/// The least depth, which is the farthest surface, of the 3 x 3 pixels around each one.
fn least_around(depth: &[f32], size_px: [u32; 2]) -> Vec<f32> {
    let [width, height] = size_px.map(|v| v as usize);
    let around = |at: usize, size: usize| at.saturating_sub(1)..(at + 2).min(size);
    let least = |ix: usize| {
        let pixels = around(ix / width, height)
            .flat_map(|y| around(ix % width, width).map(move |x| depth[y * width + x]));
        pixels.fold(f32::INFINITY, f32::min)
    };
    (0..depth.len()).into_par_iter().map(least).collect()
}
