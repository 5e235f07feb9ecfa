//! What reaches the GPU, ours beside the clipmaps that send vertices: Table 1 of Song et al. 2016, measured.

use tessclip::report::UploadRow;
use tessclip::rivals::{Detail, Method};

use super::super::paths::Course;
use super::flights::Range;
use super::settings::Setting;

/// Window sizes of the table.
const SIZES: [u32; 4] = [63, 127, 255, 511];
/// A vertex of the classic full grids: x, y, z and the coarser level's z (Losasso and Hoppe 2004).
const FULL_VERTEX_BYTES: u64 = 16;

/// Flies a course that moves all the time with each method at each window size, with the fewest levels that
/// cover the data; sizes whose one window holds all of it are left out.
pub fn uploads(range: &Range<'_>, methods: &[Method], course: &Course) -> anyhow::Result<Vec<UploadRow>> {
    let mut rows = Vec::new();
    for n in SIZES {
        let scene = tessclip::Scene { n, ..range.lab.scene.clone() };
        let Ok(shape) = scene.shape(&range.lab.terrain) else { continue };
        if shape.levels() < 2 {
            continue; // one window holds all data and never moves
        }
        let full = u64::from(n).pow(2) * u64::from(shape.levels());
        for method in [Method::Tessellated, Method::Classic, Method::Footprint] {
            if !methods.contains(&method) {
                continue;
            }
            let detail = Detail { n, ..Detail::default() };
            if range.lab.make(method, &detail).is_err() {
                continue;
            }
            let log = range.fly(&Setting { method, detail, usual: true }, course, Some(1))?;
            let (u, frames) = (&log.ledger, log.frames.len().max(1) as f64);
            let mean = |sum: u64| sum as f64 / frames;
            let bytes_per_frame =
                mean(u.vertex_bytes + u.index_bytes + u.control_bytes + u.surface_bytes + u.factor_bytes);
            rows.push(UploadRow {
                n,
                levels: shape.levels(),
                method: method.name(),
                vertices_start: u.vertices_start,
                bytes_start: u.mesh_bytes_start + u.control_bytes_start,
                vertices_per_frame: mean(u.vertices),
                bytes_per_frame,
                height_bytes_per_frame: (method != Method::Classic).then(|| mean(u.height_bytes)),
                full_grid_bytes: full * FULL_VERTEX_BYTES,
            });
        }
    }
    Ok(rows)
}
