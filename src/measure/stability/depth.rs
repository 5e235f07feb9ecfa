//! Two surfaces close together and far away: the nearer one must win.

use glam::DVec3;

use super::worlds::{flat_at, plane_at};
use super::{StabilityError, draw_into, renderer_for};
use crate::camera::Camera;
use crate::gpu::{Gpu, Offscreen};
use crate::heights::HeightGrid;
use crate::measure::invariants::{CheckRow, Effort};
use crate::measure::oracle::Lens;
use crate::scene::{ColorMode, Scene, Terrain};

/// Metres between the surfaces and from the camera.
const PAIRS: [(f64, f64); 2] = [(1.0, 1e4), (10.0, 5e5)];

/// Adds the pixels in which `both` does not show what `upper` alone shows, where that is not background.
pub fn judge_order(row: &mut CheckRow, upper: &[u8], both: &[u8], background: [u8; 3]) {
    let wrong = upper.chunks(4).zip(both.chunks(4)).filter(|(a, b)| a[..3] != background && a != b);
    row.add(wrong.count() as f64);
}

/// An even sheet at a height, wide enough for its distance.
fn sheet(height_m: f64, away_m: f64) -> Result<HeightGrid, StabilityError> {
    let mut grid = HeightGrid::new(65, 65, vec![height_m as f32; 65 * 65])?;
    grid.spacing_m = [away_m / 16.0; 2];
    Ok(grid)
}

/// Both pairs: the f32 depths themselves, and two terrains drawn one after the other, in either order.
pub(super) fn check_depth(gpu: &Gpu, effort: Effort) -> Result<Vec<CheckRow>, StabilityError> {
    let brief = effort == Effort::Brief;
    let places: &[(bool, f64)] = if brief { &[(true, 1e9)] } else { &[(false, 0.0), (true, 1e9)] };
    let pitches: &[f64] = if brief { &[-30.0] } else { &[-90.0, -30.0, -8.0] };
    let mut rows = Vec::new();
    for (apart, away) in PAIRS {
        let what = format!("{apart} m apart {:.0} km off", away / 1e3);
        let mut values = CheckRow::new(format!("depth in f32, {what}"), "wrong", 0.0);
        let mut drawn = CheckRow::new(format!("depth drawn in either order, {what}"), "pixels", 0.0);
        for &(curved, offset) in places {
            let at = if curved { flat_at } else { plane_at };
            let pair = [sheet(apart, away)?, sheet(0.0, away)?].map(|grid| at(&grid, offset));
            let middle = DVec3::new(offset + 2.0 * away, offset + 2.0 * away, apart);
            for &pitch_deg in pitches {
                let tilt = f64::to_radians(pitch_deg);
                let eye_m = middle - DVec3::new(0.0, tilt.cos(), tilt.sin()) * away;
                let camera = Camera { eye_m, pitch_deg, ..Camera::default() };
                check_pair(gpu, &pair, &camera, [&mut values, &mut drawn], (apart, away))?;
            }
        }
        rows.extend([values, drawn]);
    }
    Ok(rows)
}

fn check_pair(
    gpu: &Gpu,
    pair: &[Terrain; 2],
    camera: &Camera,
    [values, drawn]: [&mut CheckRow; 2],
    (apart, away): (f64, f64),
) -> Result<(), StabilityError> {
    let size = [320, 180];
    let background = [255, 0, 255];
    let scene = |color| Scene { n: 63, color, fog: false, background: [1.0, 0.0, 1.0], ..Scene::default() };
    let mut upper = renderer_for(gpu, &pair[0], &scene(ColorMode::Levels))?;
    let mut lower = renderer_for(gpu, &pair[1], &scene(ColorMode::Slope))?;
    let target = Offscreen::new(&gpu.device, size)?;
    draw_into(gpu, &mut upper, &target, camera, true)?;
    let alone = target.read_rgba(&gpu.device, &gpu.queue)?;
    draw_into(gpu, &mut lower, &target, camera, false)?;
    judge_order(drawn, &alone, &target.read_rgba(&gpu.device, &gpu.queue)?, background);
    draw_into(gpu, &mut lower, &target, camera, true)?;
    draw_into(gpu, &mut upper, &target, camera, false)?;
    judge_order(drawn, &alone, &target.read_rgba(&gpu.device, &gpu.queue)?, background);
    let anchor_m = upper.read_mesh()?.anchor_m;
    let lens = Lens::new(&upper, camera, anchor_m, size);
    for k in 0..size[0] * size[1] / 16 {
        let ray = camera.ray([k % (size[0] / 4) * 4, k / (size[0] / 4) * 4], size);
        let depth = |forward: f64| {
            let p = camera.eye_m + ray * forward - DVec3::from_array(anchor_m);
            let clip = lens.clip(p.as_vec3().to_array());
            clip.z / clip.w
        };
        values.add(f64::from(u8::from(!matches!(
            depth(away).partial_cmp(&depth(away + apart)),
            Some(std::cmp::Ordering::Greater)
        ))));
    }
    Ok(())
}
