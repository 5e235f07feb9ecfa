//! Stiff and extreme data, and cameras where no camera should be.

use glam::{DMat4, DVec3};

use super::worlds::{camera_over, flat_at, in_degrees, mountains, plane_at};
use super::{Shot, StabilityError, differing_pixels, draw_into, renderer_for};
use crate::camera::Camera;
use crate::gpu::{Gpu, Offscreen};
use crate::heights::{HeightGrid, Planet, PositionGrid, PositionKind, Procedural, ProceduralKind};
use crate::measure::invariants::{CheckRow, Effort};
use crate::measure::oracle::{Lens, owner, patch_nodes, true_position};
use crate::pyramid::Prefilter;
use crate::quads::{Patch, chart_patches};
use crate::reference::patch_bounds;
use crate::renderer::Renderer;
use crate::scene::{Scene, Terrain};
use crate::surface::{Base, Ellipsoid};

/// Picture the extremes are drawn into.
const SIZE_PX: [u32; 2] = [160, 90];

/// Numbers of a frame that are not finite, indices out of range, vertices outside their patch's bounds
/// (on planes, where the bounds can be told), and patches in view that were not drawn.
#[must_use]
pub fn faults_of(shot: &Shot, renderer: &Renderer, camera: &Camera) -> usize {
    let mesh = &shot.mesh;
    let count = mesh.vertices.len();
    let bad_indices = mesh.triangles.iter().flatten().filter(|ix| **ix as usize >= count).count();
    let drawn = mesh.vertices.iter().filter(|v| v.packed != u32::MAX);
    let unfinished = drawn.flat_map(|v| v.position).filter(|v| !v.is_finite()).count();
    let mut outside = 0;
    if let Some(placement) = renderer.placement() {
        for (record, patch) in mesh.patches.iter().zip(mesh.drawn()) {
            let from = record.first_vertex as usize;
            let own = mesh.vertices.get(from..from + patch.vertex_count() as usize).unwrap_or_default();
            let bounds = patch_bounds(placement, renderer.source().as_ref(), &patch);
            let inside =
                |p: [f32; 3]| bounds.is_some_and(|b| (0..3).all(|a| b.lo[a] <= p[a] && p[a] <= b.hi[a]));
            outside += own.iter().filter(|v| v.packed != u32::MAX && !inside(v.position)).count();
        }
    }
    bad_indices + unfinished + outside + hidden_patches(shot, renderer, camera)
}

/// Patches that were not drawn although the box around their true positions reaches into the picture.
fn hidden_patches(shot: &Shot, renderer: &Renderer, camera: &Camera) -> usize {
    let key = |p: &Patch| (p.chart, p.level, p.rect.lo, p.rect.hi);
    let drawn: std::collections::HashSet<_> = shot.mesh.drawn().iter().map(key).collect();
    let anchor = DVec3::from_array(shot.mesh.anchor_m);
    let clip = renderer.clip(camera, anchor, SIZE_PX);
    chart_patches(&shot.windows)
        .iter()
        .filter(|(_, p)| !drawn.contains(&key(p)))
        .filter(|(_, p)| {
            let points: Vec<DVec3> = patch_nodes(&shot.windows, p)
                .into_iter()
                .map(|node| owner(&shot.windows, node, p.level))
                .filter_map(|(node, level)| true_position(renderer.terrain(), node, level))
                .filter(|q| !behind_horizon(renderer.terrain(), camera.eye_m, *q))
                .map(|q| q - anchor)
                .collect();
            reaches_into(&clip, &points)
        })
        .count()
}

/// True when the box around the points is on the inner side of all planes by more than rounding.
fn reaches_into(clip: &DMat4, points: &[DVec3]) -> bool {
    let (Some(lo), Some(hi)) =
        (points.iter().copied().reduce(DVec3::min), points.iter().copied().reduce(DVec3::max))
    else {
        return false;
    };
    let w = clip.row(3);
    [w + clip.row(0), w - clip.row(0), w + clip.row(1), w - clip.row(1), w - clip.row(2)].iter().all(|p| {
        let normal = p.truncate();
        let term = normal * DVec3::select(normal.cmpge(DVec3::ZERO), hi, lo);
        let size = term.abs().element_sum() + p.w.abs();
        term.element_sum() + p.w > 2e-5 * size
    })
}

/// True when the ellipsoid under a whole globe's lowest ground hides a point from the eye.
fn behind_horizon(terrain: &Terrain, eye: DVec3, point: DVec3) -> bool {
    let Some(curved) = terrain.curved.as_ref().filter(|c| c.globe.is_some()) else { return false };
    let Base::Ellipsoid { a_m, b_m } = curved.base else { return false };
    let low = curved.height_range().map_or(0.0, |r| f64::from(r[0])).min(0.0);
    let scale = DVec3::new(a_m + low, a_m + low, b_m + low).recip();
    let (eye, ray) = (eye * scale, (point - eye) * scale);
    let excess = eye.length_squared() - 1.0;
    let (along, length2) = (eye.dot(ray), ray.length_squared());
    // The nearer root of the quadratic lies between eye and point.
    let root = along * along - excess * length2;
    excess > 0.0 && along < 0.0 && root > 0.0 && -along - root.sqrt() < length2
}

/// One row a case: everything that can go wrong with it, and whether two renderers agree to the bit.
fn check_case(
    gpu: &Gpu,
    name: &str,
    terrain: &Terrain,
    cameras: &[Camera],
) -> Result<CheckRow, StabilityError> {
    let mut row = CheckRow::new(format!("extreme: {name}"), "faults", 0.0);
    let scene = Scene { n: 31, ..Scene::default() };
    let target = Offscreen::new(&gpu.device, SIZE_PX)?;
    let mut pair = [renderer_for(gpu, terrain, &scene)?, renderer_for(gpu, terrain, &scene)?];
    for (k, camera) in cameras.iter().enumerate() {
        // The second one sees the cameras backwards: nothing of their order may remain.
        if k == 0 {
            for other in cameras.iter().rev() {
                draw_into(gpu, &mut pair[1], &target, other, true)?;
            }
        }
        let mut pictures = Vec::new();
        let mut meshes = Vec::new();
        for renderer in &mut pair {
            draw_into(gpu, renderer, &target, camera, true)?;
            pictures.push(target.read_rgba(&gpu.device, &gpu.queue)?);
            meshes.push(renderer.read_mesh()?);
        }
        let bytes = |k: usize| bytemuck::cast_slice::<_, u8>(&meshes[k].vertices);
        let differing = differing_pixels(&pictures[0], &pictures[1])
            + usize::from(bytes(0) != bytes(1) || meshes[0].triangles != meshes[1].triangles);
        let Some(windows) = pair[0].windows().cloned() else { continue };
        let lens = Lens::new(&pair[0], camera, meshes[0].anchor_m, SIZE_PX);
        let mesh = meshes.swap_remove(0);
        let dropped = mesh.counters.patches_dropped as usize;
        let mut unfinished = 0;
        if terrain.curved.is_none() {
            unfinished += pair[0].read_samples()?.iter().filter(|h| !h.is_finite()).count();
            unfinished += pair[0].read_block_bounds()?.iter().flatten().filter(|h| !h.is_finite()).count();
        }
        let planes = pair[0].frustum().map(|f| f.planes).unwrap_or_default();
        unfinished += planes.iter().flatten().filter(|v| !v.is_finite()).count();
        let shot = Shot { mesh, windows, lens };
        row.add((faults_of(&shot, &pair[0], camera) + differing + dropped + unfinished) as f64);
    }
    Ok(row)
}

fn grid_of(spacing_m: f64, height: impl Fn(usize, usize) -> f32) -> Result<HeightGrid, StabilityError> {
    let side = 97;
    let heights = (0..side * side).map(|i| height(i % side, i / side)).collect();
    let mut grid = HeightGrid::new(side, side, heights)?;
    grid.spacing_m = [spacing_m; 2];
    Ok(grid)
}

/// Names and terrains; the first few are the brief ones.
fn terrains() -> Result<Vec<(&'static str, Terrain)>, StabilityError> {
    use ProceduralKind as Kind;
    let made = |kind, amp| Procedural { width: 97, height: 97, amp, ..Procedural::new(kind) }.to_grid();
    let plane = |grid: &HeightGrid| plane_at(grid, 0.0);
    let wgs84 = Base::Ellipsoid { a_m: Ellipsoid::WGS84.a, b_m: Ellipsoid::WGS84.b };
    let globe = |grid: &HeightGrid| Terrain::on(&in_degrees(grid), wgs84, Prefilter::Subsample);
    let board = made(Kind::Checkerboard, 1e6)?;
    let spikes = made(Kind::Spikes, 1e4)?;
    let rough = mountains(97)?;
    let wave = |x: usize, y: usize| ((x * 7 + y * 13) % 31) as f32 / 31.0;
    let lone = grid_of(30.0, |x, y| if (x, y) == (48, 48) { 7.0 } else { f32::NAN })?;
    let wild = grid_of(30.0, |x, y| match (x + 5 * y) % 23 {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => f32::NEG_INFINITY,
        3 => f32::MAX,
        _ => wave(x, y) * 100.0,
    })?;
    let denormal = grid_of(30.0, |x, y| wave(x, y) * 1e-40)?;
    let planet = Planet { size: 65, ..Planet::default() }.to_grid()?;
    let fold = PositionGrid::procedural(PositionKind::Fold, 97)?;
    let overhang = PositionGrid::procedural(PositionKind::Overhang, 97)?;
    Ok(vec![
        ("checkerboard of 1e6 m either way", plane(&board)),
        ("folded and empty cells", Terrain::sampled(fold)),
        ("NaN, infinities and the largest f32", plane(&wild)),
        ("vertical cliff of 1e5 m", plane(&made(Kind::Cliff, 1e5)?)),
        ("vertical cliff of 1e5 m on WGS84", globe(&made(Kind::Cliff, 1e5)?)?),
        ("spikes of one sample", plane(&spikes)),
        ("spikes of one sample, 1e9 m off, curved", flat_at(&spikes, 1e9)),
        ("checkerboard of 1e6 m on WGS84", globe(&board)?),
        ("heights within 1e-6 m", plane(&grid_of(30.0, |x, y| wave(x, y) * 1e-6)?)),
        ("heights over 1e7 m", plane(&grid_of(30.0, |x, y| wave(x, y) * 1e7)?)),
        ("samples 1e-3 m apart", plane(&grid_of(1e-3, |x, y| wave(x, y) * 1e-3)?)),
        ("samples 1e-3 m apart, curved", flat_at(&grid_of(1e-3, |x, y| wave(x, y) * 1e-3)?, 1e5)),
        ("samples 1e6 m apart", plane(&grid_of(1e6, |x, y| wave(x, y) * 1e4)?)),
        ("exaggeration 0", plane(&rough).exaggerated(0.0)),
        ("exaggeration -1", plane(&rough).exaggerated(-1.0)),
        ("exaggeration 1e4", plane(&rough).exaggerated(1e4)),
        ("exaggeration 0 on WGS84", globe(&rough)?.exaggerated(0.0)),
        ("exaggeration -1 on WGS84", globe(&rough)?.exaggerated(-1.0)),
        ("exaggeration 1e4 on WGS84", globe(&rough)?.exaggerated(1e4)),
        ("all heights equal", plane(&grid_of(30.0, |_, _| -431.5)?)),
        ("nothing but voids", plane(&grid_of(30.0, |_, _| f32::NAN)?)),
        ("nothing but voids on WGS84", globe(&grid_of(30.0, |_, _| f32::NAN)?)?),
        ("one valid sample", plane(&lone)),
        (
            "NaN and infinities on WGS84",
            globe(&grid_of(30.0, |x, y| if (x + y) % 9 == 0 { f32::NAN } else { wave(x, y) })?)?,
        ),
        ("denormal heights", plane(&denormal)),
        ("overhanging positions", Terrain::sampled(overhang)),
        ("whole planet", Terrain::globe(vec![planet], Ellipsoid::WGS84)?),
    ])
}

/// Where no camera should be, and two where one might.
fn extreme_cameras(terrain: &Terrain) -> Vec<Camera> {
    let spacing = terrain.spacing_m[0].max(terrain.spacing_m[1]);
    let over = |up: f64, pitch: f64| camera_over(terrain, 0.5, up * spacing, 0.3, [33.0, pitch]);
    let mut out: Vec<Camera> =
        [over(1.0, -20.0), over(1.0, -90.0), over(2.0, 90.0), over(-0.5, 10.0), over(200.0, -89.9)]
            .into_iter()
            .flatten()
            .collect();
    let Some(first) = out.first().copied() else { return vec![terrain.overview(60.0)] };
    out.push(Camera { fov_deg: 0.001, ..first });
    out.push(Camera { fov_deg: 179.0, ..first });
    out.push(Camera { eye_m: first.eye_m + DVec3::splat(1e12), ..first });
    out.push(Camera { eye_m: DVec3::ZERO, ..first });
    out.push(terrain.overview(60.0));
    out
}

/// All cases, and poses that must be refused.
pub(super) fn check_extremes(gpu: &Gpu, effort: Effort) -> Result<Vec<CheckRow>, StabilityError> {
    let brief = effort == Effort::Brief;
    let mut rows = Vec::new();
    for (name, terrain) in terrains()?.into_iter().take(if brief { 3 } else { usize::MAX }) {
        let cameras = extreme_cameras(&terrain);
        rows.push(check_case(gpu, name, &terrain, &cameras)?);
    }
    rows.push(refused_poses(gpu)?);
    Ok(rows)
}

fn refused_poses(gpu: &Gpu) -> Result<CheckRow, StabilityError> {
    let mut row = CheckRow::new("poses that cannot be drawn are refused", "accepted", 0.0);
    let terrain = plane_at(&mountains(33)?, 0.0);
    let mut renderer = renderer_for(gpu, &terrain, &Scene { n: 15, ..Scene::default() })?;
    let good = terrain.overview(60.0);
    let mut bad = vec![Camera { yaw_deg: f64::INFINITY, ..good }, Camera { pitch_deg: f64::NAN, ..good }];
    bad.extend([f64::NAN, f64::INFINITY, 1e300].map(|v| Camera { eye_m: good.eye_m.with_z(v), ..good }));
    bad.extend([f64::NAN, 0.0, -1.0, 180.0].map(|fov_deg| Camera { fov_deg, ..good }));
    bad.push(Camera { axes: good.axes * f64::NAN, ..good });
    for camera in bad {
        row.add(f64::from(u8::from(renderer.prepare(&camera, SIZE_PX).is_ok())));
    }
    Ok(row)
}
