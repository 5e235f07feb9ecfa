//! What every vertex should be, in f64 and from the data alone: held against what the GPU made.
//!
//! Nothing here mirrors a shader's arithmetic. A vertex is named by its patch record and its place in
//! the expansion's order; the windows say which level (and chart) owns that node; the source and the base
//! surface say where it is. Only [`Lens::drawn`] follows the shader, because that is what it is to judge.

use glam::{DMat3, DVec2, DVec3, Mat4, Vec3, Vec4};

use crate::camera::Camera;
use crate::clipmap::{ChartWindows, Node, Rect};
use crate::gpu::GpuMesh;
use crate::pyramid::VOID;
use crate::quads::Patch;
use crate::renderer::Renderer;
use crate::scene::Terrain;

/// A vertex of a mesh and the node it shows.
#[derive(Clone, Copy, Debug)]
pub struct Named {
    /// Its index among the mesh's vertices.
    pub vertex: usize,
    /// The base node, as its owner's chart counts it.
    pub node: Node,
    /// Level whose sample it is.
    pub level: u32,
}

/// Base nodes of a patch's vertices in the order of its expansion: the grid, then the extra ones of the
/// south, north, west and east side.
#[must_use]
pub fn patch_nodes(windows: &ChartWindows, patch: &Patch) -> Vec<Node> {
    let chart = patch.chart as usize;
    let lattice = windows.charts[chart].lattice;
    patch.bases(lattice).into_iter().map(|base| Node { chart, base }).collect()
}

/// The node and level that own what a patch of `level` shows at `node`.
#[must_use]
pub fn owner(windows: &ChartWindows, node: Node, level: u32) -> (Node, u32) {
    if windows.graph.is_glued() {
        return windows.owner(node);
    }
    (node, windows.charts[node.chart].owner(level, node.base))
}

/// Every vertex of a mesh by name, patch by patch; those a patch's record leaves out of the mesh are not.
#[must_use]
pub fn named_vertices(mesh: &GpuMesh, windows: &ChartWindows) -> Vec<Named> {
    let mut out = Vec::with_capacity(mesh.vertices.len());
    for (record, patch) in mesh.patches.iter().zip(mesh.drawn()) {
        for (k, node) in patch_nodes(windows, &patch).into_iter().enumerate() {
            let (node, level) = owner(windows, node, patch.level);
            let vertex = record.first_vertex as usize + k;
            if vertex < mesh.vertices.len() {
                out.push(Named { vertex, node, level });
            }
        }
    }
    out
}

/// World position of a node by the samples of `level`; `None` over a void.
#[must_use]
pub fn true_position(terrain: &Terrain, node: Node, level: u32) -> Option<DVec3> {
    let lattice = match &terrain.curved {
        Some(curved) => curved.graph.charts[node.chart].lattice,
        None => terrain.source.lattice(),
    };
    position_at(terrain, node.chart, level, lattice.node(level, node.base))
}

fn position_at(terrain: &Terrain, chart: usize, level: u32, index: [i32; 2]) -> Option<DVec3> {
    if let Some(curved) = &terrain.curved {
        return curved.position(chart, level, index).map(|(p, _)| p);
    }
    let base = terrain.source.lattice().base(level, index);
    let h = terrain.source.sample(level, index);
    let ground = |a: usize| terrain.origin_m[a] + f64::from(base[a]) * terrain.spacing_m[a];
    (h != VOID).then(|| DVec3::new(ground(0), ground(1), f64::from(h)))
}

/// Unit normal of a node: the cross product of its central differences at `level`, one-sided at the
/// window's border; a void neighbour counts as the node itself. `None` over a void and where the cells
/// have (next to) no area, so that there is none.
#[must_use]
pub fn true_normal(terrain: &Terrain, windows: &ChartWindows, node: Node, level: u32) -> Option<DVec3> {
    let own = &windows.charts[node.chart];
    let index = own.lattice.node(level, node.base);
    let area: Rect = own.held(level);
    let centre = position_at(terrain, node.chart, level, index)?;
    let mut sides = [DVec3::ZERO; 2];
    for (a, side) in sides.iter_mut().enumerate() {
        let (mut low, mut high) = (index, index);
        low[a] = (index[a] - 1).max(area.lo[a]);
        high[a] = (index[a] + 1).min(area.hi[a]);
        let at = |p: [i32; 2]| position_at(terrain, node.chart, level, p);
        *side = match (at(high), at(low)) {
            (Some(high), Some(low)) => high - low,
            (high, low) if terrain.curved.is_some() => high.unwrap_or(centre) - low.unwrap_or(centre),
            // On a plane a void's neighbour keeps its place and lends its height.
            (up, down) => {
                let run = own.lattice.base(level, high)[a] - own.lattice.base(level, low)[a];
                let mut d = DVec3::ZERO;
                d[a] = f64::from(run) * terrain.spacing_m[a];
                d.z = up.unwrap_or(centre).z - down.unwrap_or(centre).z;
                d
            }
        };
    }
    let [u, v] = sides.map(|s| s.try_normalize());
    let n = u?.cross(v?);
    let mirrored = windows.graph.charts[node.chart].mirrored;
    // Two directions that all but coincide span no plane.
    (n.length() > 1e-6).then(|| n.normalize() * if mirrored { -1.0 } else { 1.0 })
}

/// The normal that a packed word stands for, as shaders/plane/relief.wgsl and shaders/curved/relief.wgsl
/// read it.
#[must_use]
pub fn packed_normal(packed: u32, curved: bool) -> DVec3 {
    let q = [packed & 0xfff, (packed >> 12) & 0xfff].map(f64::from);
    let p = q.map(|v| if curved { v / 2047.0 - 1.0 } else { v / 4095.0 * 2.0 - 1.0 });
    let z = 1.0 - p[0].abs() - p[1].abs();
    let folded = |a: usize| (1.0 - p[1 - a].abs()) * if p[a] >= 0.0 { 1.0 } else { -1.0 };
    let flat = if z >= 0.0 { p } else { [folded(0), folded(1)] };
    DVec3::new(flat[0], flat[1], z).normalize_or_zero()
}

/// Degrees between two unit vectors; exact also where they all but agree.
#[must_use]
pub fn degrees_between(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// A camera's picture, exactly and as it is drawn.
#[derive(Clone, Debug)]
pub struct Lens {
    eye: DVec3,
    /// Rows: right, up, forward.
    view: DMat3,
    /// Pixels a unit of tangent.
    focal_px: f64,
    half_px: DVec2,
    near_m: f64,
    from_anchor: Vec3,
    clip: Mat4,
    absolute: Mat4,
}

impl Lens {
    /// The lens of a frame whose positions are relative to `anchor_m`.
    #[must_use]
    pub fn new(renderer: &Renderer, camera: &Camera, anchor_m: [f64; 3], size_px: [u32; 2]) -> Self {
        let anchor = DVec3::from_array(anchor_m);
        let from_anchor = (camera.eye_m - anchor).as_vec3();
        let clip = renderer.clip(camera, anchor + from_anchor.as_dvec3(), size_px);
        let [right, up] = camera.right_and_up();
        let half_px = DVec2::from_array(size_px.map(|v| f64::from(v) * 0.5));
        Self {
            eye: camera.eye_m,
            view: DMat3::from_cols(right, up, camera.forward()).transpose(),
            focal_px: half_px.y / (camera.fov_deg.to_radians() * 0.5).tan(),
            half_px,
            near_m: clip.row(2).w,
            from_anchor,
            clip: clip.as_mat4(),
            absolute: renderer.clip(camera, DVec3::ZERO, size_px).as_mat4(),
        }
    }

    /// Where a world point falls in the picture, pixels from the top left; `None` before the near plane.
    #[must_use]
    pub fn exact(&self, world: DVec3) -> Option<DVec2> {
        let p = self.view * (world - self.eye);
        (p.z >= self.near_m).then(|| self.half_px + DVec2::new(p.x, -p.y) * (self.focal_px / p.z))
    }

    /// Metres from the eye to a world point.
    #[must_use]
    pub fn distance(&self, world: DVec3) -> f64 {
        world.distance(self.eye)
    }

    /// True inside the picture.
    #[must_use]
    pub fn shows(&self, px: DVec2) -> bool {
        px.cmpge(DVec2::ZERO).all() && px.cmple(self.half_px * 2.0).all()
    }

    /// Clip position of a vertex in f32, step by step as shaders/shared/shading.wgsl has it.
    #[must_use]
    pub fn clip(&self, position: [f32; 3]) -> Vec4 {
        self.clip * (Vec3::from_array(position) - self.from_anchor).extend(1.0)
    }

    /// Where the GPU draws a vertex: its clip position, divided.
    #[must_use]
    pub fn drawn(&self, position: [f32; 3]) -> DVec2 {
        self.pixel(self.clip(position))
    }

    /// Where the point falls without any anchor: the world position rounded to f32, transformed by one
    /// f32 matrix, as Fruehstueck 2008 does it.
    #[must_use]
    pub fn drawn_absolute(&self, world: DVec3) -> DVec2 {
        self.pixel(self.absolute * world.as_vec3().extend(1.0))
    }

    fn pixel(&self, clip: Vec4) -> DVec2 {
        let c = clip.as_dvec4();
        self.half_px + DVec2::new(c.x, -c.y) / c.w * self.half_px
    }
}
