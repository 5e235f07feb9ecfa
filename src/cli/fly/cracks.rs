//! Looking for cracks in frames of a flight: the picture and the mesh as the GPU made them.

use std::collections::{HashMap, HashSet};

use tessclip::gpu::{Gpu, GpuMesh, Offscreen};
use tessclip::measure::invariants::gpu_faults;
use tessclip::measure::{Mesh, enclosed_pixels, sees_below};
use tessclip::quads::patches;
use tessclip::reference::Placement;
use tessclip::report::CrackReport;
use tessclip::{Camera, Renderer, Terrain};

/// A colour no surface has.
pub(super) const BACKGROUND: [f32; 3] = [1.0, 0.0, 1.0];
/// The same in a picture.
const BACKGROUND_RGB: [u8; 3] = [255, 0, 255];

/// Whether a frame is one of `checks` evenly spaced ones of `frames`.
pub(super) fn is_checked(frame: u32, frames: u32, checks: u32) -> bool {
    let before = |frame: u64| frame * u64::from(checks) / u64::from(frames);
    before(u64::from(frame) + 1) > before(u64::from(frame))
}

/// An empty report over a terrain: what cannot be told there is null.
pub(super) fn empty(terrain: &Terrain) -> CrackReport {
    // Rays and rectangles know planes; over voids the mesh is open by right.
    let telling = (terrain.curved.is_none() && !terrain.source.has_voids()).then_some(0);
    CrackReport { frames: 0, faults: telling, enclosed_pixels: 0, crack_pixels: telling }
}

/// Looks at the frame just drawn.
pub(super) fn look(
    gpu: &Gpu,
    renderer: &Renderer,
    target: &Offscreen,
    camera: &Camera,
    culled: bool,
    report: &mut CrackReport,
) -> anyhow::Result<()> {
    let picture = target.read_rgba(&gpu.device, &gpu.queue)?;
    let suspects = enclosed_pixels(&picture, target.size, BACKGROUND_RGB);
    report.frames += 1;
    report.enclosed_pixels += suspects.len() as u64;
    let (Some(faults), Some(pixels)) = (&mut report.faults, &mut report.crack_pixels) else { return Ok(()) };
    let Some(placement) = renderer.placement() else { return Ok(()) };
    let drawn = renderer.read_mesh()?;
    let mesh = Mesh::from_gpu(&drawn);
    *faults += if culled {
        faults_in_view(&drawn, &mesh, placement)
    } else {
        let f = gpu_faults(&drawn, placement, renderer.terrain());
        f.open_edges + f.misoriented + f.not_finite + u64::from(f.area_error >= 1e-6)
    };
    let below = |p: &&[u32; 2]| sees_below(&mesh, camera.eye_m, camera.ray(**p, target.size));
    *pixels += suspects.iter().filter(below).count() as u64;
    Ok(())
}

/// Faults of a mesh without the patches out of view: edges may be open only towards those patches and at the
/// border of the data.
fn faults_in_view(drawn: &GpuMesh, mesh: &Mesh, placement: &Placement) -> u64 {
    let windows = &placement.windows;
    let seen: HashSet<_> =
        drawn.drawn().iter().map(|patch| (patch.level, patch.rect.lo, patch.rect.hi)).collect();
    let unseen: Vec<_> = patches(windows)
        .into_iter()
        .map(|(_, patch)| (patch.level, patch.rect.lo, patch.rect.hi))
        .filter(|patch| !seen.contains(patch))
        .map(|(level, lo, hi)| tessclip::clipmap::Rect {
            lo: windows.lattice.base(level, lo),
            hi: windows.lattice.base(level, hi),
        })
        .collect();
    let domain = windows.domain();
    let base = |ix: u32| {
        let p = mesh.vertices[ix as usize];
        [0, 1].map(|a| {
            let cells = (p[a] - drawn.anchor_m[a]) / f64::from(placement.spacing_m[a]);
            placement.anchor[a] + cells.round() as i32
        })
    };
    let mut edges: HashMap<[u32; 2], [u32; 2]> = HashMap::with_capacity(mesh.triangles.len() * 2);
    let mut faults = mesh.vertices.iter().flatten().filter(|v| !v.is_finite()).count() as u64;
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|ix| mesh.vertices[ix as usize]);
        let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        faults += u64::from(cross.is_nan() || cross <= 0.0);
        for (from, to) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            edges.entry([from.min(to), from.max(to)]).or_default()[usize::from(from > to)] += 1;
        }
    }
    let open = edges.into_iter().filter(|(_, ways)| *ways != [1, 1]);
    let wrong = open.filter(|(ends, ways)| {
        let [p, q] = ends.map(base);
        let on_border = (0..2).any(|a| p[a] == q[a] && (p[a] == domain.lo[a] || p[a] == domain.hi[a]));
        let beside_unseen = || unseen.iter().any(|r| r.contains(p) && r.contains(q));
        ways[0] + ways[1] != 1 || !(on_border || beside_unseen())
    });
    faults + wrong.count() as u64
}

#[cfg(test)]
mod tests {
    use super::is_checked;

    #[test]
    fn checked_frames_are_spread_evenly() {
        let checked = |frames: u32, checks: u32| -> Vec<u32> {
            (0..frames).filter(|k| is_checked(*k, frames, checks)).collect()
        };
        assert_eq!(checked(10, 2), [4, 9]);
        assert_eq!(checked(7, 3), [2, 4, 6]);
        assert_eq!(checked(3, 50), [0, 1, 2]);
        assert!(checked(100, 0).is_empty());
    }
}
