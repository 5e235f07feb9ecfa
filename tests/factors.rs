//! Factors by error: any field of steps gives one conforming mesh, the GPU draws the field it chose as the twin
//! does, and limits are kept.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

mod common;
use std::collections::{BTreeSet, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec4Swizzles};
use proptest::prelude::*;
use tessclip::clipmap::{ClipmapShape, Lattice, Rect, Side, Windows};
use tessclip::gpu::{Gpu, GpuMesh, Offscreen};
use tessclip::measure::invariants::{draw, gpu_faults};
use tessclip::pyramid::{BlockDeviation, STEPS, SampleSource};
use tessclip::quads::{ByError, PATCH_CELLS, Patch, beyond, by_error, most_step, patches};
use tessclip::reference::{Placement, cell_triangles, expand};
use tessclip::{Camera, Factors, Prefilter, Renderer, Scene, Terrain};

type Point = [i32; 2];

fn hash(seed: u64, level: u32, block: Point) -> u64 {
    let mut hasher = DefaultHasher::new();
    (seed, level, block).hash(&mut hasher);
    hasher.finish()
}

fn block_of(patch: &Patch) -> Point {
    patch.rect.lo.map(|v| v.div_euclid(PATCH_CELLS.cast_signed()))
}

/// Open edges, triangles that are flat or turn the wrong way, and twice the area that is missing.
fn faults(windows: &Windows, patches: &[Patch]) -> [i64; 3] {
    let (domain, mut flat) = (windows.domain(), 0);
    let mut area_left = [0, 1].map(|a| i64::from(domain.hi[a] - domain.lo[a])).iter().product::<i64>() * 2;
    let mut edges: HashMap<[Point; 2], [u32; 2]> = HashMap::new();
    for patch in patches {
        let bases = patch.bases(windows.lattice);
        let [w, h] = patch.steps();
        let cells = (0..h).flat_map(|y| (0..w).map(move |x| [x, y]));
        let triangles: Vec<_> = cells.flat_map(|cell| cell_triangles(patch, cell)).collect();
        let used: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
        assert_eq!(bases.len(), used.len(), "a vertex is not used: {patch:?}");
        let counts = [patch.vertex_count(), patch.triangle_count()];
        assert_eq!([bases.len(), triangles.len()], counts.map(|c| c as usize));
        for t in triangles {
            let [a, b, c] = t.map(|ix| bases[ix as usize]);
            let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            flat += i64::from(cross <= 0);
            area_left -= i64::from(cross);
            for (p, q) in [(a, b), (b, c), (c, a)] {
                edges.entry([p.min(q), p.max(q)]).or_default()[usize::from(p < q)] += 1;
            }
        }
    }
    let border = |p: Point, q: Point, a: usize| p[a] == q[a] && [domain.lo[a], domain.hi[a]].contains(&p[a]);
    let whole = |[p, q]: [Point; 2], count: [u32; 2]| {
        if border(p, q, 0) || border(p, q, 1) { count[0] + count[1] == 1 } else { count == [1, 1] }
    };
    let open = edges.iter().filter(|(edge, count)| !whole(**edge, **count)).count();
    [open as i64, flat, area_left]
}

/// All patches of windows with random steps.
fn random_patches(windows: &Windows, seed: u64) -> Vec<Patch> {
    let step_of = |l, block| (hash(seed, l, block) % 5).min(most_step(windows, l, block).into()) as u32;
    patches(windows).iter().map(|(_, patch)| by_error(windows, patch, &step_of)).collect()
}

fn windows_over(last: Point, at: [f64; 2], finest: u32) -> Windows {
    let lattice = Lattice { last };
    let shape = ClipmapShape::covering_by_blocks(127, lattice).unwrap();
    let centre = [0, 1].map(|a| at[a] * f64::from(last[a]));
    Windows::place(shape, lattice, centre, finest)
}

/// Most data ends inside a cell of the coarser levels, some inside a block, some with the last block.
fn sizes() -> impl Strategy<Value = i32> {
    prop_oneof![130..=700_i32, prop::sample::select(vec![144, 145, 146, 257, 513, 529])]
}

fn places() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), Just(1.0), -0.1..1.1_f64, 0.0..1.0_f64]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn any_field_of_steps_conforms(
        size in [sizes(), sizes()], at in [places(), places()], finest in 0..2_u32, seed in any::<u64>()
    ) {
        let windows = windows_over(size.map(|s| s - 1), at, finest);
        prop_assert_eq!(windows.domain(), windows.lattice.domain());
        prop_assert_eq!(faults(&windows, &random_patches(&windows, seed)), [0; 3]);
    }
}

/// The patch with one half of a side divided otherwise, or with another step, where a neighbour must notice.
fn broken(windows: &Windows, patch: &Patch) -> Vec<Patch> {
    let good = patch.by_error.unwrap();
    let mut out = Vec::new();
    for (side, half) in Side::ALL.into_iter().flat_map(|side| [(side, 0), (side, 1)]) {
        let (s, h) = (side as usize, half as usize);
        let exists = h == 0 || patch.cells()[side.along()] > 8;
        if !exists || beyond(windows, patch.level, block_of(patch), side, half).is_none() {
            continue;
        }
        // The finest chain cannot be divided further; what is lost belongs to the division.
        if good.lost[s] == 0 && good.log2[s][h] + patch.level + good.step > 0 {
            let mut bad = good;
            // A step of 16 spans both halves.
            let halves = if good.step == 4 { 0..2 } else { h..h + 1 };
            bad.log2[s][halves].fill(good.log2[s][h].checked_sub(1).unwrap_or(1));
            out.push(Patch { by_error: Some(bad), ..*patch });
        }
        if good.lost == [0; 4] && patch.cells() == [PATCH_CELLS; 2] && good.step < 4 {
            out.push(Patch { by_error: Some(ByError { step: good.step + 1, ..good }), ..*patch });
        }
    }
    out
}

#[test]
fn a_wrong_division_is_noticed() {
    let mut tried = 0;
    for (last, at) in [([299, 216], [0.5, 0.4]), ([256, 143], [1.0, 0.0]), ([400, 333], [0.2, 0.7])] {
        let windows = windows_over(last, at, 0);
        let good = random_patches(&windows, 7);
        assert_eq!(faults(&windows, &good), [0; 3]);
        for k in 0..good.len() {
            for bad in broken(&windows, &good[k]).into_iter().step_by(4) {
                let patches = [&good[..k], &[bad], &good[k + 1..]].concat();
                assert_ne!(faults(&windows, &patches), [0; 3], "{bad:?}");
                tried += 1;
            }
        }
    }
    assert!(tried > 100, "{tried}");
}

/// Heights of another source with made deviations, which ask for every step somewhere.
struct Made {
    heights: Arc<dyn SampleSource>,
    seed: u64,
}

fn made(seed: u64, level: u32, block: Point) -> BlockDeviation {
    let mut metres = [0.0; STEPS];
    let mut log10 = -4.0;
    for (k, m) in metres.iter_mut().enumerate().skip(1) {
        let random = (hash(seed + k as u64, level, block) >> 40) as f32 / (1 << 24) as f32;
        log10 += random * if k == 1 { 8.0 } else { 4.0 };
        *m = 10_f32.powf(log10);
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
            out.extend((blocks.lo[0]..=blocks.hi[0]).map(|x| made(self.seed, level, [x, y])));
        }
        true
    }
}

fn terrain(spec: &str) -> Terrain {
    // The low-pass makes levels disagree: a vertex that takes the wrong level's height shows.
    Terrain::new(&common::terrain(&format!("procedural:mountains?{spec}")), Prefilter::LowPass)
}

/// Low, high and steep ones, in the middle, at borders and in corners.
fn cameras(terrain: &Terrain) -> [Camera; 6] {
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

fn scene(n: u32, pixel_error: Option<f32>, budget: Option<u32>) -> Scene {
    Scene { n, factors: Factors::ByError { pixel_error, budget }, ..Scene::default() }
}

fn renderer(gpu: &Gpu, terrain: &Terrain, scene: &Scene) -> Renderer {
    Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, terrain, scene).unwrap()
}

fn drawn(mesh: &GpuMesh) -> Vec<Patch> {
    mesh.patches.iter().map(|r| r.patch()).collect()
}

fn frame(gpu: &Gpu, renderer: &mut Renderer, target: &Offscreen, camera: &Camera) -> GpuMesh {
    draw(gpu, renderer, target, camera).unwrap();
    let mesh = renderer.read_mesh().unwrap();
    assert_eq!(mesh.counters.patches_dropped, 0);
    mesh
}

/// Triangles in an order of their own, each from its least corner on.
fn sorted(triangles: impl Iterator<Item = [u32; 3]>) -> Vec<[u32; 3]> {
    let turned = |t: [u32; 3]| [t, [t[1], t[2], t[0]], [t[2], t[0], t[1]]].into_iter().min().unwrap();
    let mut all: Vec<_> = triangles.map(turned).collect();
    all.sort_unstable();
    all
}

/// Holds the whole mesh of a frame against the twin, given the steps that it was drawn with.
fn expect_twin(mesh: &GpuMesh, placement: &Placement, source: &dyn SampleSource) {
    let drawn = drawn(mesh);
    let all = patches(&placement.windows);
    assert_eq!(drawn.len(), all.len());
    let field: HashMap<_, _> = drawn.iter().map(|p| ((p.level, block_of(p)), p.step())).collect();
    for ((record, patch), (_, plain)) in mesh.patches.iter().zip(&drawn).zip(&all) {
        assert_eq!(by_error(&placement.windows, plain, &|level, block| field[&(level, block)]), *patch);
        assert!(patch.step() <= most_step(&placement.windows, patch.level, block_of(patch)));
        let twin = expand(placement, source, patch);
        let (v0, t0) = (record.first_vertex as usize, record.first_index as usize / 3);
        for (got, wanted) in mesh.vertices[v0..].iter().zip(&twin.vertices) {
            assert_eq!(got.position.map(f32::to_bits), wanted.position.map(f32::to_bits), "{patch:?}");
            assert_eq!(got.packed >> 24, wanted.packed >> 24);
        }
        let got = mesh.triangles[t0..t0 + twin.triangles.len()].iter().copied();
        let wanted = twin.triangles.iter().map(|t| t.map(|ix| ix + record.first_vertex));
        assert_eq!(sorted(got), sorted(wanted));
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_gpu_draws_any_field_as_the_twin_and_culling_changes_no_factor() {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [320, 200]).unwrap();
    let mut steps = BTreeSet::new();
    let mut culled = 0;
    for (spec, seed) in [("width=400&height=333", 1), ("size=513", 2), ("width=145&height=610", 3)] {
        let plain = terrain(spec);
        let terrain = Terrain { source: Arc::new(Made { heights: plain.source.clone(), seed }), ..plain };
        let limited = scene(127, Some(1.0), None);
        let mut complete = renderer(&gpu, &terrain, &Scene { cull: false, ..limited.clone() });
        let mut seen = renderer(&gpu, &terrain, &limited);
        for camera in cameras(&terrain) {
            let whole = frame(&gpu, &mut complete, &target, &camera);
            let placement = complete.placement().unwrap();
            let found = gpu_faults(&whole, placement, &terrain);
            assert!(found.none(), "{spec} {camera:?}: {found:?}");
            expect_twin(&whole, placement, terrain.source.as_ref());
            let all = drawn(&whole);
            steps.extend(all.iter().map(Patch::step));
            let part = drawn(&frame(&gpu, &mut seen, &target, &camera));
            assert!(part.iter().all(|patch| all.contains(patch)), "{spec} {camera:?}");
            culled += all.len() - part.len();
        }
    }
    assert_eq!(steps, BTreeSet::from([0, 1, 2, 3, 4]), "not every step was tried");
    assert!(culled > 100, "culling took {culled} patches away");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn budgets_are_kept_and_used() {
    let gpu = common::gpu();
    let terrain = terrain("size=513");
    let target = Offscreen::new(&gpu.device, [640, 360]).unwrap();
    let budgets = [1, 2_000, 5_000, 20_000, 100_000, 50_000_000];
    let triangles = |r: &mut Renderer, c: &Camera| frame(&gpu, r, &target, c).counters.index_count / 3;
    let make = |pixel_error, budget| renderer(&gpu, &terrain, &scene(255, pixel_error, budget));
    let mut alone = budgets.map(|budget| make(None, Some(budget)));
    let mut both = budgets.map(|budget| make(Some(1.0), Some(budget)));
    let mut one_pixel = make(Some(1.0), None);
    let (mut bounded, mut filled) = (0, 0);
    for camera in cameras(&terrain) {
        let counts = alone.each_mut().map(|r| triangles(r, &camera));
        assert!(counts.is_sorted(), "{counts:?}");
        let (coarsest, finest) = (counts[0], counts[5]);
        let limited = triangles(&mut one_pixel, &camera);
        for (k, (budget, count)) in budgets.into_iter().zip(counts).enumerate() {
            let least = triangles(&mut both[k], &camera);
            // The coarser mesh wins; thresholds stand on marks 3.5 % apart that begin elsewhere with a pixel error.
            let most = limited.min(budget.max(coarsest));
            let told = format!("{budget}: {least} under both limits, {limited} and {count} alone");
            assert!(least <= most && f64::from(least) >= 0.9 * f64::from(limited.min(count)), "{told}");
            assert!(count <= budget.max(coarsest), "{count} of {budget}");
            if count == finest || coarsest > budget {
                continue;
            }
            bounded += 1;
            filled += u32::from(f64::from(count) >= 0.9 * f64::from(budget));
            if f64::from(count) >= 0.9 * f64::from(budget) {
                continue;
            }
            // Many blocks may change their step at one threshold; then the next finer one takes too many.
            let threshold = alone[k].read_counters().unwrap().threshold_px;
            let mut next = make(Some(threshold * 0.5_f32.powf(0.05)), None);
            let finer = triangles(&mut next, &camera);
            assert!(finer > budget, "{count} of {budget}, and {finer} at the next threshold");
        }
    }
    assert!(bounded > 4 && 2 * filled >= bounded, "{filled} of {bounded} budgets are used to 90 %");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_budgets_mesh_has_no_history() {
    let gpu = common::gpu();
    let terrain = terrain("size=513");
    let target = Offscreen::new(&gpu.device, [640, 360]).unwrap();
    let limited = scene(255, None, Some(20_000));
    let mut used = renderer(&gpu, &terrain, &limited);
    let bytes = |camera: &Camera, renderer: &mut Renderer| {
        let mesh = frame(&gpu, renderer, &target, camera);
        let vertices: &[u8] = bytemuck::cast_slice(&mesh.vertices);
        [vertices, bytemuck::cast_slice(&mesh.triangles)].concat()
    };
    let path = cameras(&terrain);
    let first: Vec<_> = path.iter().map(|c| bytes(c, &mut used)).collect();
    for (camera, wanted) in path.iter().zip(&first).rev() {
        assert!(bytes(camera, &mut used) == *wanted, "after another path: {camera:?}");
        assert!(bytes(camera, &mut used) == *wanted, "once more: {camera:?}");
        assert!(bytes(camera, &mut renderer(&gpu, &terrain, &limited)) == *wanted, "afresh: {camera:?}");
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn no_deviation_shows_more_than_the_threshold() {
    const MOST_PX: f64 = 2.0;
    let gpu = common::gpu();
    let terrain = terrain("size=513");
    let target = Offscreen::new(&gpu.device, [320, 200]).unwrap();
    let mut renderer = renderer(&gpu, &terrain, &scene(255, Some(MOST_PX as f32), None));
    let half = DVec2::from(target.size.map(f64::from)) * 0.5;
    let source = terrain.source.as_ref();
    let (mut worst, mut tried) = (0.0_f64, 0);
    for camera in cameras(&terrain) {
        let mesh = frame(&gpu, &mut renderer, &target, &camera);
        let anchor = DVec3::from(mesh.anchor_m);
        let clip = renderer.clip(&camera, anchor, target.size);
        for patch in drawn(&mesh).into_iter().filter(|p| p.step() > 0) {
            let (mut figures, mut heights) = (Vec::new(), Vec::new());
            let block = block_of(&patch);
            assert!(source.read_deviations(patch.level, Rect { lo: block, hi: block }, &mut figures));
            let deviation_m = f64::from(figures[0].metres(patch.step() as usize));
            let [lo, hi] = [patch.rect.lo, patch.rect.hi].map(|p| source.lattice().base(patch.level, p));
            source.read(0, Rect { lo, hi }, &mut heights);
            let places = (lo[1]..=hi[1]).flat_map(|y| (lo[0]..=hi[0]).map(move |x| [x, y]));
            for (p, height) in places.zip(heights) {
                let [x, y] = [0, 1].map(|a| terrain.origin_m[a] + f64::from(p[a]) * terrain.spacing_m[a]);
                let point = DVec3::new(x, y, f64::from(height)) - anchor;
                let at = clip * point.extend(1.0);
                if at.w <= 0.0 || at.z > at.w || at.x.abs() > at.w || at.y.abs() > at.w {
                    continue;
                }
                for off in [deviation_m, -deviation_m] {
                    let moved = clip * (point + DVec3::Z * off).extend(1.0);
                    let px = ((moved.xy() / moved.w - at.xy() / at.w) * half).length();
                    // Thresholds go by the derivative; what comes nearer moves by as much more.
                    let nearer = (at.w / moved.w).max(1.0);
                    let fits = moved.w > 0.0 && nearer < 1.05 && px <= (MOST_PX + 1e-3) * nearer;
                    assert!(fits, "{px} {nearer} {patch:?} {camera:?}");
                    worst = worst.max(px);
                }
            }
            tried += 1;
        }
    }
    assert!(tried > 50, "only {tried} patches were coarser");
    assert!(worst >= MOST_PX / 8.0, "thresholds are too careful: {worst} px");
}

/// Noise close up: errors beyond any scale, which a budget must still coarsen.
#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_budget_holds_however_rough_the_ground_is() {
    let gpu = common::gpu();
    let noise = (0..513_u32 * 513).map(|k| (k.wrapping_mul(2_654_435_761) >> 20) as f32).collect();
    let mut grid = tessclip::heights::HeightGrid::new(513, 513, noise).unwrap();
    grid.spacing_m = [10.0; 2];
    let terrain = Terrain::new(&grid, Prefilter::Subsample);
    let target = Offscreen::new(&gpu.device, [640, 360]).unwrap();
    let whole = Scene { cull: false, ..scene(511, None, Some(9_000)) };
    let mut renderer = renderer(&gpu, &terrain, &whole);
    for height in [4_000.0, 4_200.0, 6_000.0] {
        let eye_m = DVec3::new(2_560.0, 2_560.0, height);
        let camera = Camera { eye_m, pitch_deg: -50.0, fov_deg: 60.0, ..Camera::default() };
        let counters = frame(&gpu, &mut renderer, &target, &camera).counters;
        assert_eq!(counters.patches_dropped, 0);
        assert!(counters.index_count / 3 <= 9_000, "{}", counters.index_count / 3);
    }
}

#[test]
fn what_has_no_deviations_is_refused() {
    let grid = common::terrain("procedural:mountains?width=301&height=200");
    let refused = |terrain: &Terrain, n| scene(n, Some(1.0), None).shape(terrain).unwrap_err().to_string();
    let plane = Terrain::new(&grid, Prefilter::Subsample);
    assert!(refused(&plane, 63).contains("take n = 127"), "{}", refused(&plane, 63));
    assert!(scene(127, Some(1.0), None).shape(&plane).is_ok());
    let cylinder = Terrain::on(&grid, "cylinder:4000".parse().unwrap(), Prefilter::Subsample).unwrap();
    assert!(refused(&cylinder, 63).contains("take n = 127"), "{}", refused(&cylinder, 63));
    // Glued charts need a wider layout.
    assert!(refused(&cylinder, 255).contains("too small for this base surface"));
    assert!(scene(511, Some(1.0), None).shape(&cylinder).is_ok());
}
