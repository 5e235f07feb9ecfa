//! Invariants across borders of charts: surfaces that close must have no open edge, wherever the camera is.

use super::{CheckRow, Effort, draw};
use crate::camera::Camera;
use crate::gpu::{Gpu, Offscreen};
use crate::heights::{ReadOptions, open_terrain};
use crate::measure::{Mesh, check_closed};
use crate::pyramid::Prefilter;
use crate::renderer::{RenderError, Renderer};
use crate::scene::{Scene, Terrain};
use crate::surface::{Base, Ellipsoid};

/// A whole planet and a torus, read back from the GPU at and around every special place of their charts.
pub(super) fn check_closed_surfaces(gpu: &Gpu, effort: Effort) -> Result<Vec<CheckRow>, RenderError> {
    let mut rows = Vec::new();
    let full = effort == Effort::Full;
    let planet = open_terrain("procedural:planet?size=129", &ReadOptions::default()).ok();
    if let Some(terrain) = planet.and_then(|g| Terrain::globe(vec![g], Ellipsoid::WGS84).ok()) {
        let mut cameras = Vec::new();
        // Where three faces meet, on their borders, at the poles and on the date line, and beside them.
        for lat in [90.0, 89.9, 45.0, 35.264_389_682_754_654, 34.9, 0.0, -44.6, -35.3, -90.0] {
            for lon in [180.0, 135.0, 45.0, 44.3, 0.0, -45.2, -135.0] {
                cameras.push(terrain.camera([lon, lat, 2e4, 0.0, -30.0], 60.0));
            }
        }
        rows.push(closed_row(gpu, "planet", &terrain, &cameras, full, 2)?);
    }
    let dunes = open_terrain("procedural:dunes?width=301&height=200", &ReadOptions::default()).ok();
    let base = Base::Torus { major_m: 4_000.0, minor_m: 1_200.0 };
    if let Some(terrain) = dunes.and_then(|g| Terrain::on(&g, base, Prefilter::Subsample).ok()) {
        let mut cameras = Vec::new();
        for x in [0.0, 2.0, 2_999.0, 3_000.0, 3_011.0, 6_000.0, 8_970.0, 9_000.0] {
            for y in [0.0, 1_990.0, 2_000.0, 3_100.0, 4_100.0] {
                cameras.push(terrain.camera([x, y, 300.0, 0.0, -20.0], 60.0));
            }
        }
        rows.push(closed_row(gpu, "torus", &terrain, &cameras, full, 0)?);
    }
    Ok(rows)
}

fn closed_row(
    gpu: &Gpu,
    name: &str,
    terrain: &Terrain,
    cameras: &[Camera],
    full: bool,
    euler: i64,
) -> Result<CheckRow, RenderError> {
    let mut row = CheckRow::new(format!("1-2 one closed surface over glued charts: {name}"), "faults", 0.0);
    let target = Offscreen::new(&gpu.device, [64, 64])?;
    for (n, morph) in [(31, false), (63, true)] {
        let scene = Scene { n, morph, cull: false, drop_fine_levels: false, ..Scene::default() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, &scene)?;
        for camera in cameras.iter().step_by(if full { 1 } else { 7 }) {
            draw(gpu, &mut renderer, &target, camera)?;
            let faults = check_closed(&Mesh::from_gpu(&renderer.read_mesh()?));
            let other = u64::from(faults.euler != euler);
            row.add((faults.open_edges + faults.not_finite + other) as f64);
        }
    }
    Ok(row)
}
