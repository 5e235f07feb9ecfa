//! Invariants of whole scenes: data with voids, and pictures along a path.

use super::{CheckRow, Effort, camera_at, camera_centres, draw, sorted_triangles};
use crate::gpu::{Gpu, Offscreen};
use crate::heights::HeightGrid;
use crate::measure::{Mesh, enclosed_pixels, sees_below};
use crate::pyramid::Prefilter;
use crate::quads::{Patch, patches};
use crate::renderer::{RenderError, Renderer};
use crate::scene::{Scene, Terrain};

/// Data with voids: the GPU draws exactly the twin's triangles that touch no void sample.
pub(super) fn check_voids(gpu: &Gpu, grid: &HeightGrid, effort: Effort) -> Result<CheckRow, RenderError> {
    let mut row = CheckRow::new("voids: all triangles but those that touch a void", "triangles", 0.0);
    let terrain = Terrain::new(grid, Prefilter::Subsample);
    let scene = Scene { n: 63, cull: false, ..Scene::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene)?;
    let target = Offscreen::new(&gpu.device, [64, 64])?;
    let random = if effort == Effort::Full { 16 } else { 3 };
    for (k, centre) in camera_centres(terrain.source.lattice().last, 2, random).iter().enumerate() {
        draw(gpu, &mut renderer, &target, &camera_at(&terrain, *centre, k))?;
        let gpu_mesh = renderer.read_mesh()?;
        let Some(placement) = renderer.placement() else { continue };
        let all: Vec<Patch> = patches(&placement.windows).into_iter().map(|(_, p)| p).collect();
        let twin = Mesh::from_twin(placement, terrain.source.as_ref(), &all, gpu_mesh.anchor_m);
        let wanted = sorted_triangles(&twin);
        let got = sorted_triangles(&Mesh::from_gpu(&gpu_mesh));
        let differing = wanted.iter().zip(&got).filter(|(a, b)| a != b).count();
        row.add((differing + wanted.len().abs_diff(got.len())) as f64);
    }
    Ok(row)
}

/// Invariant 6: over a path across the terrain, no pixel of clear colour inside the silhouette.
pub(super) fn check_silhouette(
    gpu: &Gpu,
    terrain: &Terrain,
    effort: Effort,
) -> Result<CheckRow, RenderError> {
    let mut row = CheckRow::new("6 no clear colour inside the silhouette", "pixels", 0.0);
    let scene = Scene { n: 63, fog: false, background: [1.0, 0.0, 1.0], ..Scene::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, &scene)?;
    let target = Offscreen::new(&gpu.device, [640, 360])?;
    let last = terrain.source.lattice().last.map(f64::from);
    let frames = if effort == Effort::Full { 48 } else { 6 };
    for k in 0..frames {
        let t = f64::from(k) / f64::from(frames);
        let camera = camera_at(terrain, [last[0] * (0.1 + 0.8 * t), last[1] * (0.2 + 0.6 * t)], k as usize);
        draw(gpu, &mut renderer, &target, &camera)?;
        let picture = target.read_rgba(&gpu.device, &gpu.queue)?;
        let suspects = enclosed_pixels(&picture, target.size, [255, 0, 255]);
        let Some(placement) = renderer.placement().filter(|_| !suspects.is_empty()) else {
            row.add(0.0);
            continue;
        };
        let all: Vec<Patch> = patches(&placement.windows).into_iter().map(|(_, p)| p).collect();
        let anchor_m = renderer.read_mesh()?.anchor_m;
        let mesh = Mesh::from_twin(placement, terrain.source.as_ref(), &all, anchor_m);
        let below = |p: &&[u32; 2]| sees_below(&mesh, camera.eye_m, camera.ray(**p, target.size));
        row.add(suspects.iter().filter(below).count() as f64);
    }
    Ok(row)
}
