//! What the tests of factors by error share: terrains, made figures, views and frames.
#![allow(dead_code, reason = "each test file uses its own part")]

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use tessclip::clipmap::{Lattice, Rect};
use tessclip::gpu::{Gpu, GpuMesh, Offscreen};
use tessclip::measure::invariants::draw;
use tessclip::pyramid::{BlockDeviation, FIGURES, SampleSource};
use tessclip::quads::{PATCH_CELLS, Patch};
use tessclip::reference::Vertex;
use tessclip::{Camera, Factors, Prefilter, Renderer, Scene, Terrain};

pub type Point = [i32; 2];

fn hash(seed: u64, level: u32, block: Point) -> u64 {
    let mut hasher = DefaultHasher::new();
    (seed, level, block).hash(&mut hasher);
    hasher.finish()
}

pub fn block_of(patch: &Patch) -> Point {
    patch.rect.lo.map(|v| v.div_euclid(PATCH_CELLS.cast_signed()))
}

/// Heights of another source with made figures, which leave out any rank of nodes somewhere.
struct Made {
    heights: Arc<dyn SampleSource>,
    seed: u64,
}

/// A block's figures: next to nothing up to some rank, then much or nothing known; or anything that grows.
fn figures(seed: u64, level: u32, block: Point) -> BlockDeviation {
    let kind = hash(seed, level, block) % 16;
    let mut metres = [1e-4; FIGURES];
    let mut log10 = -4.0;
    for (rank, m) in metres.iter_mut().enumerate() {
        if kind > 9 {
            let random = (hash(seed + 1 + rank as u64, level, block) >> 40) as f32 / (1 << 24) as f32;
            log10 += 2.0 * random;
            *m = 10_f32.powf(log10);
        } else if rank as u64 >= kind {
            *m = if level.is_multiple_of(2) { f32::INFINITY } else { 1e6 };
        }
    }
    BlockDeviation::of(metres)
}

impl SampleSource for Made {
    fn lattice(&self) -> Lattice {
        self.heights.lattice()
    }
    fn has_voids(&self) -> bool {
        self.heights.has_voids()
    }
    fn read(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        self.heights.read(level, rect, out);
    }
    fn height_range(&self) -> Option<[f32; 2]> {
        self.heights.height_range()
    }
    fn has_deviations(&self) -> bool {
        true
    }
    fn read_deviations(&self, level: u32, blocks: Rect, out: &mut Vec<BlockDeviation>) -> bool {
        for y in blocks.lo[1]..=blocks.hi[1] {
            out.extend((blocks.lo[0]..=blocks.hi[0]).map(|x| figures(self.seed, level, [x, y])));
        }
        true
    }
}

/// The same heights with made figures.
pub fn with_made_figures(plain: Terrain, seed: u64) -> Terrain {
    Terrain { source: Arc::new(Made { heights: plain.source.clone(), seed }), ..plain }
}

pub fn terrain(spec: &str) -> Terrain {
    // The low-pass makes levels disagree: a vertex that takes the wrong level's height shows.
    Terrain::new(&crate::common::terrain(spec), Prefilter::LowPass)
}

pub fn mountains(size: &str) -> Terrain {
    terrain(&format!("procedural:mountains?{size}"))
}

/// Void samples: a lake over several blocks and single ones.
pub fn holed() -> Terrain {
    let mut grid = crate::common::terrain("procedural:mountains?width=303&height=250");
    let void = |i: usize| {
        let (x, y) = (i % 303, i / 303);
        ((140..190).contains(&x) && (100..150).contains(&y)) || (x * 31 + y * 17) % 1997 == 5
    };
    grid.valid = Some((0..303 * 250).map(|i| !void(i)).collect());
    Terrain::new(&grid, Prefilter::Subsample)
}

/// Low, high and steep ones, in the middle, at borders and in corners.
pub fn cameras(terrain: &Terrain) -> [Camera; 6] {
    let [low, high] = terrain.extent_m();
    [
        [0.5, 0.5, 3.0, 30.0, -10.0],
        [0.3, 0.6, 40.0, 140.0, -35.0],
        [0.0, 0.0, 8.0, 45.0, -5.0],
        [1.0, 1.0, 20.0, 225.0, -20.0],
        [0.5, 0.45, 400.0, 10.0, -80.0],
        [1.0, 0.2, 100.0, 290.0, -25.0],
    ]
    .map(|[u, v, above, yaw, pitch]| {
        let [x, y] = [low[0] + u * (high[0] - low[0]), low[1] + v * (high[1] - low[1])];
        let z = f64::from(terrain.ground_height_m(x, y).unwrap()) + above * terrain.spacing_m[0];
        terrain.camera([x, y, z, yaw, pitch], 60.0)
    })
}

pub fn scene(n: u32, pixel_error: Option<f32>, budget: Option<u32>) -> Scene {
    Scene { n, factors: Factors::ByError { pixel_error, budget }, ..Scene::default() }
}

pub fn renderer(gpu: &Gpu, terrain: &Terrain, scene: &Scene) -> Renderer {
    Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, scene).unwrap()
}

pub fn frame(gpu: &Gpu, renderer: &mut Renderer, target: &Offscreen, camera: &Camera) -> GpuMesh {
    draw(gpu, renderer, target, camera).unwrap();
    let mesh = renderer.read_mesh().unwrap();
    assert_eq!(mesh.counters.patches_dropped, 0);
    mesh
}

/// Vertices and triangles of one patch; indices count from its first vertex.
pub fn piece(mesh: &GpuMesh, k: usize) -> (&[Vertex], Vec<[u32; 3]>) {
    let record = &mesh.nodes[k];
    let (v0, t0) = (record.first_vertex as usize, record.first_index as usize / 3);
    let triangles = &mesh.triangles[t0..t0 + record.triangles as usize];
    let from_first = triangles.iter().map(|t| t.map(|ix| ix - record.first_vertex)).collect();
    (&mesh.vertices[v0..v0 + record.vertices as usize], from_first)
}
