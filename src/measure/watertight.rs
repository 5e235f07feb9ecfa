//! Is a mesh whole? Cover, orientation and conforming edges, from the triangles alone.

use std::collections::HashMap;

use super::Mesh;

/// What is wrong with a mesh, by kind; all zero when it is whole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// Edges inside the domain that do not belong to exactly two triangles, one in each direction.
    pub open_edges: u64,
    /// Triangles that are not counter-clockwise from above, or have no area.
    pub misoriented: u64,
    /// Coordinates that are NaN or infinite.
    pub not_finite: u64,
    /// |area of all triangles / area of the domain - 1|; with closed edges, 0 means each point is
    /// covered exactly once.
    pub area_error: f64,
}

impl Faults {
    /// True when the mesh covers its domain once, conforming and finite.
    #[must_use]
    pub fn none(&self) -> bool {
        self.open_edges == 0 && self.misoriented == 0 && self.not_finite == 0 && self.area_error < 1e-6
    }
}

/// Checks a mesh that should tile the rectangle `domain_m` (low and high corner, world metres).
///
/// If all triangles turn the same way, all inner edges are paired and the areas add up to the
/// domain's, the triangles cover every point exactly once: a gap would leave unpaired edges, and an
/// overlap with paired edges would need more area than there is.
/// `slack_m` is how far a border vertex may lie off the border (f32 rounding of far positions).
#[must_use]
pub fn check_mesh(mesh: &Mesh, domain_m: [[f64; 2]; 2], slack_m: f64) -> Faults {
    let mut faults = Faults {
        not_finite: mesh.vertices.iter().flatten().filter(|v| !v.is_finite()).count() as u64,
        ..Faults::default()
    };
    let mut edges: HashMap<[u32; 2], (u32, u32)> = HashMap::with_capacity(mesh.triangles.len() * 2);
    let mut area2 = 0.0;
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|ix| mesh.vertices[ix as usize]);
        let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if cross.is_nan() || cross <= 0.0 {
            faults.misoriented += 1;
        }
        area2 += cross;
        for (from, to) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let count = edges.entry([from.min(to), from.max(to)]).or_default();
            if from < to { count.0 += 1 } else { count.1 += 1 }
        }
    }
    let on_border = |ix: u32, axis: usize, side: usize| {
        (mesh.vertices[ix as usize][axis] - domain_m[side][axis]).abs() <= slack_m
    };
    for (edge, count) in edges {
        let along_border =
            (0..2).any(|a| (0..2).any(|s| on_border(edge[0], a, s) && on_border(edge[1], a, s)));
        let whole = if along_border { count.0 + count.1 == 1 } else { count == (1, 1) };
        if !whole {
            faults.open_edges += 1;
        }
    }
    let area = (domain_m[1][0] - domain_m[0][0]) * (domain_m[1][1] - domain_m[0][1]);
    faults.area_error = (area2 * 0.5 / area - 1.0).abs();
    faults
}

/// What is wrong with a mesh that should enclose a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClosedFaults {
    /// Edges that do not belong to exactly two triangles, one in each direction.
    pub open_edges: u64,
    /// Coordinates that are NaN or infinite.
    pub not_finite: u64,
    /// Vertices - edges + faces: 2 for a sphere, 0 for a torus; anything else has holes or handles.
    pub euler: i64,
}

/// Checks a closed mesh; vertices with the same bits are one ([`Mesh`]).
#[must_use]
pub fn check_closed(mesh: &Mesh) -> ClosedFaults {
    let mut edges: HashMap<[u32; 2], (u32, u32)> = HashMap::with_capacity(mesh.triangles.len() * 2);
    for t in &mesh.triangles {
        for (from, to) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let count = edges.entry([from.min(to), from.max(to)]).or_default();
            if from < to { count.0 += 1 } else { count.1 += 1 }
        }
    }
    let count = |v: usize| i64::try_from(v).unwrap_or(i64::MAX);
    ClosedFaults {
        open_edges: edges.values().filter(|c| **c != (1, 1)).count() as u64,
        not_finite: mesh.vertices.iter().flatten().filter(|v| !v.is_finite()).count() as u64,
        euler: count(mesh.vertices.len()) - count(edges.len()) + count(mesh.triangles.len()),
    }
}
