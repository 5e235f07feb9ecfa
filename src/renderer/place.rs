//! Where the windows stand for a camera, and which levels are worth drawing.

use glam::DVec3;

use super::Renderer;
use crate::camera::Camera;
use crate::clipmap::{ChartWindows, ClipmapShape, Windows};
use crate::scene::{Scene, Terrain};

/// Least width of the finest level's window, in heights of the picture where the ground is nearest. At 60
/// degrees that is 2.5 times the distance; with n = 255 and 720 pixels a cell then has six.
pub const LEAST_WINDOW: f64 = 2.165;

impl Renderer {
    /// Windows of all charts for a camera.
    pub(super) fn place(&self, camera: &Camera) -> ChartWindows {
        let graph = self.terrain.graph();
        let (home, centre, away) = match &self.terrain.curved {
            None => {
                let centre = self.terrain.samples_from_world(camera.eye_m);
                (0, centre, away_from_plane(&self.terrain, camera))
            }
            Some(curved) => {
                let (foot, ground) = curved.ground(camera.eye_m);
                let last = graph.charts[foot.chart].lattice.last;
                let inside = [0, 1].map(|a| foot.at[a].clamp(0.0, f64::from(last[a])));
                let ground = f64::from(ground.unwrap_or(0.0)).min(foot.height_m);
                let (p, up) = curved.surface.base(foot.chart, inside);
                (foot.chart, foot.at, camera.eye_m.distance(p + up * ground))
            }
        };
        let mut finest = 0;
        if self.scene.drop_fine_levels {
            finest = finest_for(&self.terrain, self.shape, camera, away);
        }
        if let Some(globe) = self.terrain.curved.as_ref().and_then(|c| c.globe.as_ref()) {
            finest = self.finest_with_data(globe, camera, finest);
        }
        ChartWindows::place(&graph, self.shape, home, centre, finest)
    }

    /// Levels finer than any data their windows would reach are not drawn, nor loaded.
    fn finest_with_data(&self, globe: &crate::pyramid::Globe, camera: &Camera, finest: u32) -> u32 {
        let Some(curved) = &self.terrain.curved else { return finest };
        let foot = curved.surface.foot(camera.eye_m);
        let (_, normal) = curved.surface.base(foot.chart, foot.at);
        let cell = std::f64::consts::FRAC_PI_2 / f64::from(globe.size());
        let mut level = finest;
        while level + 1 < self.shape.levels() {
            // A level earns its place where some source is finer than the next coarser one.
            let coarser = (cell * f64::from(2_u32 << level)).to_degrees();
            let radius = cell * f64::from(1_u32 << level) * f64::from(self.shape.n()) * 0.75;
            if globe.finer_than(coarser * 0.999, normal, radius.min(std::f64::consts::PI)) {
                break;
            }
            level += 1;
        }
        level
    }
}

/// Windows for a camera over a plane, as ours places them; for other clipmaps of the same shape.
pub(crate) fn windows_over_plane(
    terrain: &Terrain,
    scene: &Scene,
    shape: ClipmapShape,
    camera: &Camera,
) -> Windows {
    let away = away_from_plane(terrain, camera);
    let finest = if scene.drop_fine_levels { finest_for(terrain, shape, camera, away) } else { 0 };
    Windows::place(shape, terrain.source.lattice(), terrain.samples_from_world(camera.eye_m), finest)
}

/// Distance of the camera from the nearest ground, metres.
fn away_from_plane(terrain: &Terrain, camera: &Camera) -> f64 {
    let [low, high] = terrain.extent_m();
    let eye = camera.eye_m;
    let (x, y) = (eye.x.clamp(low[0], high[0]), eye.y.clamp(low[1], high[1]));
    let ground = terrain.ground_bound_m(x, y).map_or(0.0, f64::from);
    eye.distance(DVec3::new(x, y, ground.min(eye.z)))
}

/// Finest level worth drawing: where the ground is nearest, its window must be wider than
/// [`LEAST_WINDOW`] heights of the picture, which for a given n bounds the screen size of a cell from
/// below (Fruehstueck 2008, section 3.5.4; Asirvatham and Hoppe 2005).
fn finest_for(terrain: &Terrain, shape: ClipmapShape, camera: &Camera, away_m: f64) -> u32 {
    let spacing = terrain.spacing_m[0].max(terrain.spacing_m[1]);
    let picture_m = 2.0 * away_m * (camera.fov_deg.to_radians() * 0.5).tan();
    let window_m = |l: u32| f64::from(shape.cells()) * spacing * f64::from(1_u32 << l);
    let mut level = 0;
    while level + 1 < shape.levels() && window_m(level) < LEAST_WINDOW * picture_m {
        level += 1;
    }
    level
}
