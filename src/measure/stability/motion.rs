//! The same picture wherever the world lies, and a steady one while the camera creeps.

use std::collections::HashMap;

use glam::DVec2;

use super::worlds::{OFFSETS_M, camera_over, flat_at, in_degrees, mountains, plane_at};
use super::{MOST_PX, SIZE_PX, Shot, StabilityError, differing_pixels, draw_into, renderer_for, shoot};
use crate::gpu::{Gpu, Offscreen};
use crate::measure::invariants::{CheckRow, Effort};
use crate::measure::oracle::{named_vertices, true_position};
use crate::pyramid::Prefilter;
use crate::scene::{Scene, Terrain};
use crate::surface::{Base, Ellipsoid};

/// How far each near vertex is drawn from where it should be, pixels, by chart and base node.
pub type Deviations = HashMap<(usize, [i32; 2]), DVec2>;

/// Deviations of the vertices on screen within 300 m of the camera.
#[must_use]
pub fn deviations(shot: &Shot, terrain: &Terrain) -> Deviations {
    let mut out = Deviations::new();
    for named in named_vertices(&shot.mesh, &shot.windows) {
        let vertex = shot.mesh.vertices[named.vertex];
        let Some(truth) = true_position(terrain, named.node, named.level) else { continue };
        if shot.lens.distance(truth) > 300.0 {
            continue;
        }
        if let Some(px) = shot.lens.exact(truth).filter(|px| shot.lens.shows(*px)) {
            out.insert((named.node.chart, named.node.base), shot.lens.drawn(vertex.position) - px);
        }
    }
    out
}

/// What changed from one frame to the next of the vertices that both show: motion that the camera's own
/// does not explain.
pub fn judge_jitter(row: &mut CheckRow, before: &Deviations, now: &Deviations) {
    for (key, deviation) in now {
        if let Some(was) = before.get(key) {
            row.add(deviation.distance(*was));
        }
    }
}

/// Distance between the same vertices of two frames that should be alike, pixels.
pub fn judge_displacement(row: &mut CheckRow, a: &Shot, b: &Shot) {
    if a.mesh.triangles != b.mesh.triangles || a.mesh.vertices.len() != b.mesh.vertices.len() {
        row.add(f64::NAN);
        return;
    }
    for (v, w) in a.mesh.vertices.iter().zip(&b.mesh.vertices) {
        let before = a.lens.clip(v.position).w <= 0.0;
        let px = a.lens.drawn(v.position);
        // What is not a number is on no side of the picture, and must count.
        if !px.is_finite() || (!before && a.lens.shows(px)) {
            row.add(if before { 0.0 } else { px.distance(b.lens.drawn(w.position)) });
        }
    }
}

/// Both kinds of rows.
pub(super) fn check_motion(gpu: &Gpu, effort: Effort) -> Result<Vec<CheckRow>, StabilityError> {
    let brief = effort == Effort::Brief;
    let mut rows = translation(gpu, "plane", plane_at)?;
    if !brief {
        rows.extend(translation(gpu, "curved plane", flat_at)?);
    }
    let mut grid = mountains(129)?;
    grid.spacing_m = [21.527_777_8, 30.875_123_4];
    let base = |r: [f64; 2]| Base::Ellipsoid { a_m: r[0], b_m: r[1] };
    let on = |r| Terrain::on(&grid, base(r), Prefilter::Subsample);
    let wgs84 = [Ellipsoid::WGS84.a, Ellipsoid::WGS84.b];
    let regional = Terrain::on(&in_degrees(&grid), base(wgs84), Prefilter::Subsample)?;
    let mut worlds = vec![("plane 1e9 m off", plane_at(&grid, 1e9)), ("WGS84, regional", regional)];
    if !brief {
        worlds.push(("plane", plane_at(&grid, 0.0)));
        worlds.push(("curved plane 1e9 m off", flat_at(&grid, 1e9)));
        worlds.push(("sphere of 6.4e6 m", on([6.4e6; 2])?));
    }
    for (name, terrain) in worlds {
        rows.push(jitter(gpu, name, &terrain, if brief { 16 } else { 128 })?);
    }
    Ok(rows)
}

fn translation(
    gpu: &Gpu,
    name: &str,
    at: impl Fn(&crate::heights::HeightGrid, f64) -> Terrain,
) -> Result<Vec<CheckRow>, StabilityError> {
    let grid = mountains(129)?;
    let mut vertices =
        CheckRow::new(format!("{name} moved by 1e5, 6.4e6, 1e9 m: vertices on screen"), "px", MOST_PX);
    let mut pictures =
        CheckRow::new(format!("{name} moved by 1e5, 6.4e6, 1e9 m: pixels that differ"), "pixels", 0.0);
    let target = Offscreen::new(&gpu.device, SIZE_PX.map(|v| v / 2))?;
    let mut first: Option<(Shot, Vec<u8>)> = None;
    for offset in OFFSETS_M {
        let terrain = at(&grid, offset);
        let mut renderer = renderer_for(gpu, &terrain, &Scene { n: 63, ..Scene::default() })?;
        let Some(mut camera) = camera_over(&terrain, 0.45, 20.0, 0.25, [30.0, -15.0]) else { continue };
        // Onto a grid that an f64 still holds a million kilometres away.
        camera.eye_m = (camera.eye_m * 64.0).round() / 64.0;
        let shot = shoot(gpu, &mut renderer, &camera)?;
        draw_into(gpu, &mut renderer, &target, &camera, true)?;
        let picture = target.read_rgba(&gpu.device, &gpu.queue)?;
        if let Some((known, image)) = &first {
            judge_displacement(&mut vertices, known, &shot);
            pictures.add(differing_pixels(image, &picture) as f64);
        } else {
            first = Some((shot, picture));
        }
    }
    Ok(vec![vertices, pictures])
}

/// A camera that creeps a millimetre a frame, a metre above the ground: over a node, where the windows
/// shift, and over the middle between two.
fn jitter(gpu: &Gpu, name: &str, terrain: &Terrain, frames: u32) -> Result<CheckRow, StabilityError> {
    let mut row = CheckRow::new(format!("jitter at 1 mm a frame, 1 m up: {name}"), "px", MOST_PX);
    let mut renderer = renderer_for(gpu, terrain, &Scene { n: 63, ..Scene::default() })?;
    for beside in [0.0, 0.5] {
        let Some(start) = camera_over(terrain, 0.5, 1.0, beside, [70.0, -25.0]) else { continue };
        let along = start.axes.x_axis * 0.001;
        let mut before: Option<Deviations> = None;
        for k in 0..frames {
            let eye_m = start.eye_m + along * (f64::from(k) - f64::from(frames) * 0.5);
            let shot = shoot(gpu, &mut renderer, &crate::Camera { eye_m, ..start })?;
            let now = deviations(&shot, terrain);
            if let Some(before) = &before {
                judge_jitter(&mut row, before, &now);
            }
            before = Some(now);
        }
    }
    Ok(row)
}
