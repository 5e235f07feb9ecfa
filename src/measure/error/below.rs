//! Does a pixel that shows background look under the surface? Then it looks through a crack: a gap between
//! triangles does not hide it, because the ray is then under what was drawn behind the gap; or through a hole,
//! where nothing was drawn and the truth should be.

use glam::DVec3;

use super::picture::ReadBack;
use crate::camera::Camera;

/// Samples that a ray advances over the ground from one look to the next.
const STRIDE: f64 = 0.5;
/// Fewest looks along a ray: one that falls steeply passes few samples.
const LEAST_STEPS: f64 = 64.0;
/// Most looks along a ray: through 2^17 samples.
const MOST_STEPS: usize = 1 << 18;

impl ReadBack<'_> {
    /// True when the ray through a pixel's middle is first above the surface and then below it: the drawn one,
    /// or the true one where nothing was drawn. A ray that comes in under the data's border, or starts under
    /// the ground, has not been above.
    pub fn looks_below(&self, camera: &Camera, pixel: [u32; 2], size_px: [u32; 2]) -> bool {
        let ray = camera.ray(pixel, size_px);
        let spacing = self.ground.spacing_m;
        let across = (ray.x.abs() / spacing[0]).max(ray.y.abs() / spacing[1]);
        let last = self.ground.last();
        // Ray parameters at which it enters and leaves the data's extent.
        let start = self.terrain.samples_from_world(camera.eye_m);
        let (mut from, mut to) = (0.0_f64, f64::INFINITY);
        for a in 0..2 {
            let (begin, end) = (-start[a], f64::from(last[a]) - start[a]);
            let speed = [ray.x, ray.y][a] / spacing[a];
            if speed == 0.0 {
                if begin > 0.0 || end < 0.0 {
                    return false;
                }
                continue;
            }
            let (s, t) = (begin / speed, end / speed);
            from = from.max(s.min(t));
            to = to.min(s.max(t));
        }
        // Below the lowest height there is nothing more to pass.
        let [lowest_m, highest_m] = self.ground.range_m.map(f64::from);
        if ray.z < 0.0 {
            let over_m = (highest_m - lowest_m).max(camera.eye_m.z - lowest_m);
            let bottom_m = lowest_m - 0.1 * over_m - 1.0; // a few looks under it
            to = to.min((bottom_m - camera.eye_m.z) / ray.z);
        }
        if from >= to || !to.is_finite() {
            return false;
        }
        let step = (STRIDE / across).min((to - from) / LEAST_STEPS);
        let mut above = false;
        for k in 0..MOST_STEPS {
            let s = from + step * (k as f64 + 0.5);
            if s >= to {
                return false;
            }
            let point_m: DVec3 = camera.eye_m + ray * s;
            let Some([low_m, high_m]) =
                self.range_around(point_m, [0.0; 2]).or_else(|| self.true_range(point_m))
            else {
                continue; // on the data's border
            };
            let slack_m = 0.05 * (high_m - low_m) + 1e-3;
            if above && point_m.z < low_m - slack_m {
                return true;
            }
            above = above || point_m.z > high_m + slack_m;
        }
        false
    }
}
