//! A mesh to be checked: from the GPU's buffers or from the CPU twin.

use std::collections::HashMap;

use crate::gpu::GpuMesh;
use crate::pyramid::SampleSource;
use crate::quads::Patch;
use crate::reference::{Placement, expand};

/// Triangles over shared vertices; positions in world metres.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertices that are used, each position once.
    pub vertices: Vec<[f64; 3]>,
    /// Level of the patch that first wrote each vertex.
    pub levels: Vec<u32>,
    /// Triangles, counter-clockwise from above; collapsed ones (over voids) are left out.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The GPU's mesh in world coordinates: the anchor is added in f64, vertices with the same bits
    /// become one, and what no triangle uses is left out.
    #[must_use]
    pub fn from_gpu(gpu: &GpuMesh) -> Self {
        let mut out = Welder::default();
        for t in &gpu.triangles {
            let corner = |ix: u32| {
                let v = gpu.vertices.get(ix as usize)?;
                let p = [0, 1, 2].map(|a| gpu.anchor_m[a] + f64::from(v.position[a]));
                Some((p, v.level()))
            };
            // An index out of range shows as a lost triangle, which the checks report.
            if let (Some(a), Some(b), Some(c)) = (corner(t[0]), corner(t[1]), corner(t[2])) {
                out.add([a, b, c]);
            }
        }
        out.mesh
    }

    /// The twin's mesh of the given patches.
    #[must_use]
    pub fn from_twin<'a>(
        placement: &Placement,
        source: &dyn SampleSource,
        patches: impl IntoIterator<Item = &'a Patch>,
        anchor_m: [f64; 3],
    ) -> Self {
        let mut out = Welder::default();
        for patch in patches {
            let e = expand(placement, source, patch);
            for t in &e.triangles {
                if t.iter().any(|ix| !e.valid[*ix as usize]) {
                    continue;
                }
                out.add(t.map(|ix| {
                    let p = e.vertices[ix as usize].position;
                    ([0, 1, 2].map(|a| anchor_m[a] + f64::from(p[a])), patch.level)
                }));
            }
        }
        out.mesh
    }
}

#[derive(Default)]
struct Welder {
    mesh: Mesh,
    known: HashMap<[u64; 3], u32>,
}

impl Welder {
    fn add(&mut self, corners: [([f64; 3], u32); 3]) {
        let key = |p: [f64; 3]| p.map(|v| (v + 0.0).to_bits());
        if key(corners[0].0) == key(corners[1].0) && key(corners[1].0) == key(corners[2].0) {
            return;
        }
        let triangle = corners.map(|(p, level)| {
            *self.known.entry(key(p)).or_insert_with(|| {
                self.mesh.vertices.push(p);
                self.mesh.levels.push(level);
                u32::try_from(self.mesh.vertices.len() - 1).unwrap_or(u32::MAX)
            })
        });
        self.mesh.triangles.push(triangle);
    }
}
