//! The invariants of the mesh (design: section 2), tried over many cameras on the CPU twin and on what
//! the GPU made.

mod closed;
mod scenes;

use std::sync::Arc;

use serde::Serialize;

use self::closed::check_closed_surfaces;
use self::scenes::{check_silhouette, check_voids};
use super::{Faults, Mesh, check_mesh};
use crate::camera::Camera;
use crate::clipmap::{ClipmapShape, Rect, Windows};
use crate::gpu::{Gpu, GpuMesh, Offscreen};
use crate::heights::HeightGrid;
use crate::pyramid::{Prefilter, SampleSource, VOID};
use crate::quads::{Patch, patches};
use crate::reference::{Placement, patch_bounds, visible};
use crate::renderer::{RenderError, Renderer, Target};
use crate::scene::{Scene, Terrain};

/// One line of `check`.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct CheckRow {
    /// What was tried.
    pub name: String,
    /// How many cases.
    pub tried: u64,
    /// How many of them failed.
    pub failed: u64,
    /// Worst figure seen.
    pub worst: f64,
    /// Most that is allowed.
    pub bound: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// `worst <= bound` and nothing failed.
    pub pass: bool,
}

impl CheckRow {
    /// A row without cases yet.
    pub fn new(name: impl Into<String>, unit: &'static str, bound: f64) -> Self {
        Self { name: name.into(), tried: 0, failed: 0, worst: 0.0, bound, unit, pass: true }
    }

    /// Adds a case with this figure.
    pub fn add(&mut self, figure: f64) {
        self.tried += 1;
        self.worst = self.worst.max(if figure.is_nan() { f64::INFINITY } else { figure });
        if figure.is_nan() || figure > self.bound {
            self.failed += 1;
            self.pass = false;
        }
    }
}

/// How much is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Seconds: for `demo`.
    Brief,
    /// What `check` runs.
    Full,
}

/// Ground points to try, in base samples: all parities of three adjacent levels, the borders and
/// corners, and pseudo-random ones.
#[must_use]
pub fn camera_centres(last: [i32; 2], parities: u32, random: u32) -> Vec<[f64; 2]> {
    let size = last.map(f64::from);
    let mut out = Vec::new();
    // Steps of two base samples move level 0; eight of them run through all parities of levels 0 to 2.
    for k in 0..parities {
        let (x, y) = (f64::from(k % 8) * 2.0, f64::from(k / 8 % 8) * 2.0);
        out.push([(size[0] * 0.5 + x).min(size[0]), (size[1] * 0.5 + y).min(size[1])]);
    }
    for y in [0.0, 0.5, 1.0] {
        for x in [0.0, 0.5, 1.0] {
            out.push([size[0] * x, size[1] * y]);
        }
    }
    out.push([-1e7, size[1] * 0.3]);
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..random {
        out.push([next() * size[0], next() * size[1]]);
    }
    out
}

/// Twin: cover and conforming over shapes and cameras. No GPU is used.
#[must_use]
pub fn check_twin(terrain: &Terrain, effort: Effort) -> Vec<CheckRow> {
    let (parities, random) = if effort == Effort::Full { (64, 16) } else { (4, 1) };
    let mut rows = Vec::new();
    let sizes: &[u32] = if effort == Effort::Full { &[15, 31, 63] } else { &[15] };
    for &n in sizes {
        let mut row = CheckRow::new(format!("1-2 cover and conforming, CPU twin, n = {n}"), "faults", 0.0);
        let lattice = terrain.source.lattice();
        let Ok(shape) = ClipmapShape::covering(n, lattice) else { continue };
        for (k, centre) in camera_centres(lattice.last, parities, random).into_iter().enumerate() {
            // Finest levels drop out with height; the rule must hold for each of them as the finest.
            let finest = if k % 4 == 3 { 1 } else { 0 };
            let windows = Windows::place(shape, lattice, centre, finest);
            let placement = plain_placement(windows);
            let all: Vec<Patch> = patches(&placement.windows).into_iter().map(|(_, p)| p).collect();
            let mesh = Mesh::from_twin(&placement, &NoVoids(terrain.source.clone()), &all, [0.0; 3]);
            row.add(fault_count(&check_mesh(&mesh, twin_domain(&placement), 0.0)));
        }
        rows.push(row);
    }
    rows
}

/// Placement with unit spacing and no anchor: positions are base samples, exact in f32.
fn plain_placement(windows: Windows) -> Placement {
    Placement {
        windows,
        anchor: [0, 0],
        anchor_height_m: 0.0,
        spacing_m: [1.0, 1.0],
        eye_samples: [0.0, 0.0],
        morph: false,
        fades: Default::default(),
    }
}

fn twin_domain(placement: &Placement) -> [[f64; 2]; 2] {
    let d = placement.windows.domain();
    [d.lo.map(f64::from), d.hi.map(f64::from)]
}

fn fault_count(f: &Faults) -> f64 {
    let area = if f.area_error < 1e-6 { 0.0 } else { 1.0 };
    (f.open_edges + f.misoriented + f.not_finite) as f64 + area
}

/// A source whose voids count as sea level, so that the whole layout can be checked.
struct NoVoids(Arc<dyn SampleSource>);

impl SampleSource for NoVoids {
    fn lattice(&self) -> crate::clipmap::Lattice {
        self.0.lattice()
    }
    fn has_voids(&self) -> bool {
        false
    }
    fn read(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        let from = out.len();
        self.0.read(level, rect, out);
        for h in &mut out[from..] {
            if *h == VOID {
                *h = 0.0;
            }
        }
    }
    fn height_range(&self) -> Option<[f32; 2]> {
        self.0.height_range()
    }
}

/// All GPU invariants on one terrain; `grid` is its data, from which voidless variants are made.
///
/// # Errors
/// When the GPU fails or the terrain cannot be drawn.
pub fn check_gpu(gpu: &Gpu, grid: &HeightGrid, effort: Effort) -> Result<Vec<CheckRow>, RenderError> {
    let whole = HeightGrid { valid: None, ..grid.clone() };
    // The low-pass filter makes levels disagree: a vertex that takes the wrong level's height shows.
    let terrain = Terrain::new(&whole, Prefilter::LowPass);
    let sizes: &[u32] = if effort == Effort::Full { &[15, 63, 255, 511] } else { &[63] };
    let (parities, random) = if effort == Effort::Full { (64, 6) } else { (4, 1) };
    let mut rows = Vec::new();
    for &n in sizes {
        let mut whole_mesh =
            CheckRow::new(format!("1-2 cover and conforming, GPU read-back, n = {n}"), "faults", 0.0);
        let mut finer =
            CheckRow::new(format!("3 shared edges take the finer level's samples, n = {n}"), "vertices", 0.0);
        let mut history =
            CheckRow::new(format!("4 history-free: same mesh after another path, n = {n}"), "bytes", 0.0);
        let mut sane =
            CheckRow::new(format!("5 finite, indices in range, bounds hold, n = {n}"), "faults", 0.0);
        let mut culled = CheckRow::new(format!("5 culling hides no visible patch, n = {n}"), "patches", 0.0);
        let mut twin = CheckRow::new(format!("GPU mesh equals the CPU twin's, n = {n}"), "vertices", 0.0);
        for morph in [false, true] {
            let scene = Scene { n, morph, cull: false, ..Scene::default() };
            let make =
                |scene: &Scene| Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, scene);
            let mut all = make(&scene)?;
            let mut seen = make(&Scene { cull: true, ..scene.clone() })?;
            let target = Offscreen::new(&gpu.device, [64, 64])?;
            let parities = match n {
                256.. => parities.min(2),
                64.. => parities.min(16),
                _ => parities,
            };
            for (k, centre) in
                camera_centres(terrain.source.lattice().last, parities, random).iter().enumerate()
            {
                let camera = camera_at(&terrain, *centre, k);
                draw(gpu, &mut all, &target, &camera)?;
                let mesh = all.read_mesh()?;
                let Some(placement) = all.placement().cloned() else { continue };
                whole_mesh.add(fault_count(&gpu_faults(&mesh, &placement, &terrain)));
                sane.add(sanity_faults(&mesh, &placement, terrain.source.as_ref()) as f64);
                if !morph {
                    finer.add(wrong_owner(&mesh, &placement, terrain.source.as_ref()) as f64);
                }
                if k % 4 == 0 {
                    twin.add(twin_differences(&mesh, &placement, terrain.source.as_ref()) as f64);
                }
                draw(gpu, &mut seen, &target, &camera)?;
                let frustum = seen.frustum().copied();
                let drawn = seen.read_mesh()?.drawn();
                culled.add(
                    frustum.map_or(0, |f| hidden_patches(&drawn, &placement, terrain.source.as_ref(), &f))
                        as f64,
                );
                if k % 8 == 0 {
                    let mut fresh = make(&scene)?;
                    draw(gpu, &mut fresh, &target, &camera)?;
                    history.add(differing_bytes(&mesh, &fresh.read_mesh()?) as f64);
                }
            }
        }
        rows.extend([whole_mesh, finer, history, sane, culled, twin]);
    }
    rows.push(check_silhouette(gpu, &terrain, effort)?);
    rows.extend(check_closed_surfaces(gpu, effort)?);
    if grid.void_count() > 0 {
        rows.push(check_voids(gpu, grid, effort)?);
    }
    Ok(rows)
}

/// A camera over a ground point, with heights and directions that vary with `k`.
fn camera_at(terrain: &Terrain, centre: [f64; 2], k: usize) -> Camera {
    let x = terrain.origin_m[0] + centre[0] * terrain.spacing_m[0];
    let y = terrain.origin_m[1] + centre[1] * terrain.spacing_m[1];
    // Over the highest sample around: between steep samples the surface may rise above the nearest one.
    let middle = centre.map(|c| c.clamp(-16.0, 1e9) as i32);
    let around = Rect { lo: middle.map(|v| v - 4), hi: middle.map(|v| v + 5) };
    let mut near = Vec::new();
    terrain.source.read(0, around.intersect(terrain.source.lattice().domain()), &mut near);
    let highest = near.into_iter().filter(|h| *h != VOID).reduce(f32::max);
    let ground = highest.or_else(|| terrain.ground_height_m(x, y)).map_or(0.0, f64::from);
    let spacing = terrain.spacing_m[0].max(terrain.spacing_m[1]);
    let above = spacing * [2.0, 20.0, 300.0][k % 3];
    Camera {
        eye_m: glam::DVec3::new(x, y, ground + above),
        yaw_deg: (k * 47 % 360) as f64,
        pitch_deg: [-5.0, -30.0, -80.0][k % 3],
        fov_deg: 60.0,
        ..Camera::default()
    }
}

/// Draws one frame.
///
/// # Errors
/// When the camera cannot be drawn with.
pub fn draw(
    gpu: &Gpu,
    renderer: &mut Renderer,
    target: &Offscreen,
    camera: &Camera,
) -> Result<(), RenderError> {
    renderer.prepare(camera, target.size)?;
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    renderer
        .record(&mut encoder, Target { color: &target.color, depth: &target.depth, clear: true, area: None });
    gpu.queue.submit([encoder.finish()]);
    Ok(())
}

/// Faults of a complete (not culled) GPU mesh over its domain.
#[must_use]
pub fn gpu_faults(mesh: &GpuMesh, placement: &Placement, terrain: &Terrain) -> Faults {
    let domain = placement.windows.domain();
    let corner = |p: [i32; 2]| {
        [0, 1].map(|a| {
            // As the GPU rounds it: f32 metres from the anchor, then the anchor in f64.
            mesh.anchor_m[a] + f64::from((p[a] - placement.anchor[a]) as f32 * placement.spacing_m[a])
        })
    };
    let spacing = terrain.spacing_m[0].min(terrain.spacing_m[1]);
    check_mesh(&Mesh::from_gpu(mesh), [corner(domain.lo), corner(domain.hi)], spacing * 1e-3)
}

/// Non-finite coordinates, indices out of range, and vertices outside their patch's bounds.
fn sanity_faults(mesh: &GpuMesh, placement: &Placement, source: &dyn SampleSource) -> usize {
    let count = mesh.vertices.len() as u32;
    let bad_indices = mesh.triangles.iter().flatten().filter(|ix| **ix >= count).count();
    let not_finite = mesh.vertices.iter().flat_map(|v| v.position).filter(|v| !v.is_finite()).count();
    let outside = mesh
        .patches
        .iter()
        .zip(mesh.drawn())
        .map(|(record, patch)| {
            let Some(bounds) = patch_bounds(placement, source, &patch) else { return 0 };
            let from = record.first_vertex as usize;
            let own = &mesh.vertices[from..from + patch.vertex_count() as usize];
            let inside = |p: [f32; 3]| (0..3).all(|a| bounds.lo[a] <= p[a] && p[a] <= bounds.hi[a]);
            own.iter().filter(|v| !inside(v.position)).count()
        })
        .sum::<usize>();
    bad_indices + not_finite + outside
}

/// Vertices whose height is not the sample of the level that owns them, found from the position alone:
/// the finest active level whose window's border holds the point, else the patch's own.
fn wrong_owner(mesh: &GpuMesh, placement: &Placement, source: &dyn SampleSource) -> usize {
    let windows = &placement.windows;
    mesh.vertices
        .iter()
        .filter(|v| {
            let base =
                [0, 1].map(|a| placement.anchor[a] + (v.position[a] / placement.spacing_m[a]).round() as i32);
            let mut level = v.level();
            if level > windows.finest && windows.covered(level - 1).on_perimeter(base) {
                level -= 1;
            }
            let h = source.sample(level, windows.lattice.node(level, base));
            v.position[2] != h - placement.anchor_height_m
        })
        .count()
}

/// Patches that were not drawn although their bounds, taken from the samples, reach into the frustum.
fn hidden_patches(
    drawn: &[Patch],
    placement: &Placement,
    source: &dyn SampleSource,
    frustum: &crate::reference::Frustum,
) -> usize {
    let drawn: std::collections::HashSet<_> = drawn.iter().map(|p| (p.level, p.rect.lo, p.rect.hi)).collect();
    patches(&placement.windows)
        .iter()
        .filter(|(_, p)| !drawn.contains(&(p.level, p.rect.lo, p.rect.hi)))
        .filter(|(_, p)| patch_bounds(placement, source, p).is_some_and(|b| strictly_visible(frustum, &b)))
        .count()
}

/// Visible without the culling test's tolerance for rounding, which the GPU may round otherwise.
fn strictly_visible(frustum: &crate::reference::Frustum, bounds: &crate::reference::Bounds) -> bool {
    let mut strict = *frustum;
    for plane in &mut strict.planes {
        plane[3] -= plane[3].abs().max(1.0) * 3e-5;
    }
    visible(&strict, bounds)
}

/// Patches, vertices and triangles that differ from the twin's: integers and grounds exactly, heights
/// within a millimetre (morphed ones may be contracted differently).
fn twin_differences(mesh: &GpuMesh, placement: &Placement, source: &dyn SampleSource) -> usize {
    let wanted = patches(&placement.windows);
    let mut differences = wanted.len().abs_diff(mesh.patches.len());
    for (((_, patch), record), drawn) in wanted.iter().zip(&mesh.patches).zip(mesh.drawn()) {
        if drawn != *patch {
            differences += 1;
            continue;
        }
        let twin = crate::reference::expand(placement, source, patch);
        let (v0, t0) = (record.first_vertex as usize, record.first_index as usize / 3);
        for (k, v) in twin.vertices.iter().enumerate() {
            let got = &mesh.vertices[v0 + k];
            let same = got.position[..2] == v.position[..2]
                && (got.position[2] - v.position[2]).abs() <= 1e-3
                && got.packed >> 24 == v.packed >> 24;
            differences += usize::from(!same);
        }
        let mut a: Vec<_> =
            twin.triangles.iter().map(|t| rotated(t.map(|ix| ix + record.first_vertex))).collect();
        let mut b: Vec<_> = mesh.triangles[t0..t0 + a.len()].iter().map(|t| rotated(*t)).collect();
        a.sort_unstable();
        b.sort_unstable();
        differences += a.iter().zip(&b).filter(|(x, y)| x != y).count();
    }
    differences
}

fn rotated(t: [u32; 3]) -> [u32; 3] {
    let least = (0..3).min_by_key(|&i| t[i]).unwrap_or(0);
    [t[least], t[(least + 1) % 3], t[(least + 2) % 3]]
}

fn differing_bytes(a: &GpuMesh, b: &GpuMesh) -> usize {
    let bytes = |m: &GpuMesh| {
        let mut all = bytemuck::cast_slice::<_, u8>(&m.vertices).to_vec();
        all.extend_from_slice(bytemuck::cast_slice(&m.triangles));
        all
    };
    let (a, b) = (bytes(a), bytes(b));
    a.len().abs_diff(b.len()) + a.iter().zip(&b).filter(|(x, y)| x != y).count()
}

/// Triangles by the bits of their corners, in an order of their own.
#[must_use]
pub fn sorted_triangles(mesh: &Mesh) -> Vec<[[u64; 3]; 3]> {
    let mut all: Vec<_> = mesh
        .triangles
        .iter()
        .map(|t| {
            let mut corners = t.map(|ix| mesh.vertices[ix as usize].map(f64::to_bits));
            let least = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
            corners.rotate_left(least);
            corners
        })
        .collect();
    all.sort_unstable();
    all
}
