//! Factors by error: the GPU draws the nodes it chose as the twin does, culled or not, and limits are kept.
//! Any choice at all gives one conforming mesh: tests/leaves.rs. What choices go by: tests/factors_grades.rs.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

mod common;
#[path = "common/made.rs"]
mod made;

use std::collections::{BTreeSet, HashMap};

use glam::{DMat4, DVec2, DVec3, Vec4Swizzles};
use made::{
    Point, block_of, cameras, frame, holed, mountains, piece, renderer, scene, terrain, with_made_figures,
};
use tessclip::clipmap::Rect;
use tessclip::gpu::{Gpu, GpuMesh, Offscreen};
use tessclip::measure::invariants::gpu_faults;
use tessclip::pyramid::{SampleSource, VOID};
use tessclip::quads::{BLOCK_NODES, Patch, block_nodes, by_error, closed, full_cells, patches, rank};
use tessclip::reference::{Placement, expand};
use tessclip::{Camera, Prefilter, Renderer, Scene, Terrain};

/// Triangles in an order of their own, each from its least corner on.
fn sorted(triangles: impl Iterator<Item = [u32; 3]>) -> Vec<[u32; 3]> {
    let turned = |t: [u32; 3]| [t, [t[1], t[2], t[0]], [t[2], t[0], t[1]]].into_iter().min().unwrap();
    let mut all: Vec<_> = triangles.map(turned).collect();
    all.sort_unstable();
    all
}

/// What differs between a frame's whole mesh and the twin's with the nodes that it was drawn with, in words.
fn twin_faults(mesh: &GpuMesh, placement: &Placement, source: &dyn SampleSource) -> Vec<String> {
    let drawn = mesh.drawn();
    let key = |p: &Patch| (p.level, block_of(p));
    let full = |p: &Patch| full_cells(placement.windows.lattice, p.level, p.rect);
    // What is void all over is not drawn and owns no node that it need not.
    let mut all: Vec<_> = patches(&placement.windows).into_iter().map(|(_, patch)| patch).collect();
    let mut field: HashMap<_, _> =
        all.iter().map(|p| (key(p), closed(p.cells(), full(p), [0; BLOCK_NODES]))).collect();
    field.extend(drawn.iter().map(|p| (key(p), p.by_error.unwrap().rows)));
    all.retain(|patch| {
        let mut heights = Vec::new();
        source.read(patch.level, patch.rect, &mut heights);
        heights.iter().any(|h| *h != VOID)
    });
    if [drawn.len(), mesh.nodes.len()] != [all.len(); 2] {
        return vec![format!("{} patches and {} records of {}", drawn.len(), mesh.nodes.len(), all.len())];
    }
    let mut out = Vec::new();
    for (k, (patch, plain)) in drawn.iter().zip(&all).enumerate() {
        let mut expect = |same: bool, what: &str| {
            if !same {
                out.push(format!("{what}: {patch:?}"));
            }
            same
        };
        let (record, own) = (&mesh.nodes[k], patch.by_error.unwrap());
        let wanted = by_error(&placement.windows, plain, &|level, block| field[&(level, block)]);
        if !expect(closed(patch.cells(), full(patch), own.rows) == own.rows, "a node without those it needs")
            || !expect(wanted == *patch, "other extras than both sides own")
        {
            continue;
        }
        expect((record.rows, record.extras) == (own.rows, own.extras), "not as recorded");
        let twin = expand(placement, source, patch);
        let counts = [twin.vertices.len(), twin.triangles.len()].map(|count| u32::try_from(count).unwrap());
        expect([patch.vertex_count(), patch.triangle_count()] == counts, "miscounted");
        if !expect([record.vertices, record.triangles] == counts, "miscounted on the GPU") {
            continue;
        }
        let (vertices, triangles) = piece(mesh, k);
        let same = vertices.iter().zip(&twin.vertices).zip(&twin.valid).all(|((got, wanted), valid)| {
            got.position.map(f32::to_bits) == wanted.position.map(f32::to_bits)
                && if *valid { got.packed >> 24 == wanted.packed >> 24 } else { got.packed == u32::MAX }
        });
        expect(same, "other vertices");
        // Over voids triangles are collapsed.
        let got = sorted(triangles.into_iter().filter(|t| t[0] != t[1]));
        let whole = |t: &[u32; 3]| t.iter().all(|ix| twin.valid[*ix as usize]);
        expect(got == sorted(twin.triangles.iter().copied().filter(whole)), "other triangles");
    }
    out
}

/// Renderers of the same scene without and with culling.
fn pair(gpu: &Gpu, terrain: &Terrain, scene: &Scene) -> [Renderer; 2] {
    [false, true].map(|cull| renderer(gpu, terrain, &Scene { cull, ..scene.clone() }))
}

/// Draws a view with both: the whole mesh conforms, and what is seen is a part of it, vertex by vertex. Gives the
/// whole mesh and how many patches were culled.
fn whole_and_seen(
    gpu: &Gpu,
    target: &Offscreen,
    [whole, seen]: &mut [Renderer; 2],
    camera: &Camera,
) -> (GpuMesh, usize) {
    let all = frame(gpu, whole, target, camera);
    if !whole.source().has_voids() {
        let found = gpu_faults(&all, whole.placement().unwrap(), whole.terrain());
        assert!(found.none(), "{camera:?}: {found:?}");
    }
    let part = frame(gpu, seen, target, camera);
    let (patches, kept) = (all.drawn(), part.drawn());
    let places: HashMap<_, _> = (0..).zip(&patches).map(|(k, p)| ((p.level, block_of(p)), k)).collect();
    for (k, patch) in kept.iter().enumerate() {
        let at: usize = places[&(patch.level, block_of(patch))];
        assert_eq!(patches[at], *patch, "{camera:?}");
        assert!(piece(&part, k) == piece(&all, at), "{patch:?} {camera:?}");
    }
    (all, patches.len() - kept.len())
}

/// Rank of the finest nodes a patch owns, and whether it owns some nodes of a rank and leaves others out.
fn ranks_of(patch: &Patch) -> (u32, bool) {
    let own = patch.by_error.unwrap();
    let mut counts = [[0; 2]; 10];
    for node in block_nodes() {
        counts[rank(node) as usize][usize::from(own.has(node))] += 1;
    }
    let finest = counts.iter().position(|[_, own]| *own > 0).unwrap();
    (u32::try_from(finest).unwrap(), counts.iter().any(|[left_out, own]| *left_out > 0 && *own > 0))
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn the_gpu_draws_any_field_as_the_twin_and_culling_changes_no_factor() {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [320, 200]).unwrap();
    let (mut finest, mut mixed, mut culled) = (BTreeSet::new(), 0, 0);
    let sizes = ["width=400&height=333", "size=513", "width=145&height=610"];
    for (seed, ground) in (1..).zip(sizes.map(mountains).into_iter().chain([holed()])) {
        let terrain = with_made_figures(ground, seed);
        let mut renderers = pair(&gpu, &terrain, &scene(127, Some(1.0), None));
        for camera in cameras(&terrain) {
            let (mesh, less) = whole_and_seen(&gpu, &target, &mut renderers, &camera);
            let placement = renderers[0].placement().unwrap();
            let found = twin_faults(&mesh, placement, terrain.source.as_ref());
            assert!(found.is_empty(), "{seed} {camera:?}: {} faults: {}", found.len(), found[0]);
            culled += less;
            for patch in mesh.drawn() {
                if full_cells(placement.windows.lattice, patch.level, patch.rect) == [16; 2] {
                    let (rank, some) = ranks_of(&patch);
                    finest.insert(rank);
                    mixed += u32::from(some);
                }
            }
        }
    }
    eprintln!("finest ranks {finest:?}, {mixed} patches with parts of a rank, {culled} culled");
    assert_eq!(finest, (1..=9).collect(), "not every rank was the finest somewhere");
    assert!(mixed > 100, "{mixed} patches have parts of a rank");
    assert!(culled > 100, "culling took {culled} patches away");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn what_the_twin_draws_otherwise_is_noticed() {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [320, 200]).unwrap();
    let terrain = mountains("width=145&height=160");
    let whole = Scene { cull: false, drop_fine_levels: false, ..scene(127, Some(1.0), None) };
    let mut renderer = renderer(&gpu, &terrain, &whole);
    let good = frame(&gpu, &mut renderer, &target, &cameras(&terrain)[1]);
    let placement = renderer.placement().unwrap();
    let count = good.nodes.len();
    assert!(count > 20, "{count} patches");
    let tried = [0, count / 3, count / 2, count - 1];
    let faults = |change: &dyn Fn(&mut GpuMesh, usize)| {
        tried.map(|k| {
            let mut mesh = good.clone();
            change(&mut mesh, k);
            !twin_faults(&mesh, placement, terrain.source.as_ref()).is_empty()
        })
    };
    assert_eq!(faults(&|_, _| ()), [false; 4]);
    // A node more or less, an extra, a vertex that lies elsewhere, a triangle that is turned round or drawn twice.
    assert_eq!(faults(&|mesh, k| mesh.nodes[k].rows[8] ^= 1 << 8), [true; 4]);
    assert_eq!(faults(&|mesh, k| mesh.nodes[k].extras[k % 4] ^= 1 << 7), [true; 4]);
    let vertex = |k: usize| good.nodes[k].first_vertex as usize;
    let triangle = |k: usize| good.nodes[k].first_index as usize / 3;
    assert_eq!(faults(&|mesh, k| mesh.vertices[vertex(k)].position[2] += 0.5), [true; 4]);
    assert_eq!(faults(&|mesh, k| mesh.triangles[triangle(k)].swap(0, 1)), [true; 4]);
    assert_eq!(faults(&|mesh, k| mesh.triangles[triangle(k)] = good.triangles[triangle(k) + 1]), [true; 4]);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn views_conform_whole_and_culled_with_and_without_geomorph() {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [320, 200]).unwrap();
    let (mut culled, mut broken) = (0, 0);
    for (terrain, n) in
        [(mountains("width=531&height=402"), 127), (terrain("procedural:dunes?width=700&height=450"), 255)]
    {
        for morph in [false, true] {
            let mut both = pair(&gpu, &terrain, &Scene { morph, ..scene(n, Some(1.0), None) });
            // A budget weighs what is seen: culling may change what it is spent on.
            let limited = Scene { morph, cull: false, ..scene(n, None, Some(9_000)) };
            let mut limited = renderer(&gpu, &terrain, &limited);
            for camera in cameras(&terrain) {
                culled += whole_and_seen(&gpu, &target, &mut both, &camera).1;
                let mut mesh = frame(&gpu, &mut limited, &target, &camera);
                let placement = limited.placement().unwrap();
                let found = gpu_faults(&mesh, placement, &terrain);
                assert!(found.none(), "{n} {morph} {camera:?}: {found:?}");
                // The last vertex of a patch with extras is one of them: no neighbour knows it where it stands now.
                if let Some(record) = mesh.nodes.iter().find(|r| r.extras != [0; 4]) {
                    let last = (record.first_vertex + record.vertices - 1) as usize;
                    mesh.vertices[last].position[2] += 0.5;
                    assert!(gpu_faults(&mesh, placement, &terrain).open_edges > 0);
                    broken += 1;
                }
            }
        }
    }
    assert!(broken > 10, "{broken}");
    assert!(culled > 100, "culling took {culled} patches away");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn budgets_are_kept_and_used() {
    let gpu = common::gpu();
    let terrain = mountains("size=513");
    let target = Offscreen::new(&gpu.device, [640, 360]).unwrap();
    let budgets = [1, 2_000, 5_000, 20_000, 100_000, 50_000_000];
    let triangles = |r: &mut Renderer, c: &Camera| frame(&gpu, r, &target, c).counters.index_count / 3;
    let make = |pixel_error, budget| renderer(&gpu, &terrain, &scene(255, pixel_error, budget));
    let mut alone = budgets.map(|budget| make(None, Some(budget)));
    let mut both = budgets.map(|budget| make(Some(1.0), Some(budget)));
    let mut one_pixel = make(Some(1.0), None);
    let mut shares = Vec::new();
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
            let share = f64::from(count) / f64::from(budget);
            shares.push(share);
            if share >= 0.9 {
                continue;
            }
            // Many nodes may stand at one mark; then the next finer threshold takes too many.
            let threshold = alone[k].read_counters().unwrap().threshold_px;
            let mut next = make(Some(threshold * 0.5_f32.powf(0.05)), None);
            let finer = triangles(&mut next, &camera);
            assert!(finer > budget, "{count} of {budget}, and {finer} at the next threshold");
        }
    }
    shares.sort_by(f64::total_cmp);
    let filled = shares.iter().filter(|share| **share >= 0.9).count();
    eprintln!("budgets are used to {shares:.3?}");
    assert!(shares.len() > 4 && 4 * filled >= 3 * shares.len(), "{filled} of {} to 90 %", shares.len());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_budgets_mesh_has_no_history() {
    let gpu = common::gpu();
    let terrain = mountains("size=513");
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

/// Twice the signed area of a triangle of base samples.
fn cross([a, b, c]: [Point; 3]) -> i64 {
    let [p, q] = [b, c].map(|to| [0, 1].map(|axis| i64::from(to[axis] - a[axis])));
    p[0] * q[1] - p[1] * q[0]
}

/// Pixels that the full-resolution samples in view lie off what is drawn over them, at worst, and how many samples
/// were looked at. Triangles within one cell of their level are left out: there is nothing finer to draw, whatever
/// the threshold.
fn worst_px(terrain: &Terrain, mesh: &GpuMesh, clip: &DMat4, size: [u32; 2]) -> (f64, usize) {
    let half = DVec2::from(size.map(f64::from)) * 0.5;
    let (source, anchor) = (terrain.source.as_ref(), DVec3::from(mesh.anchor_m));
    let lattice = source.lattice();
    let (mut worst, mut tried) = (0.0_f64, 0);
    for (k, patch) in mesh.drawn().iter().enumerate() {
        let (bases, (vertices, triangles)) = (patch.bases(lattice), piece(mesh, k));
        let [lo, hi] = [patch.rect.lo, patch.rect.hi].map(|p| lattice.base(patch.level, p));
        let mut heights = Vec::new();
        source.read(0, Rect { lo, hi }, &mut heights);
        let width = hi[0] - lo[0] + 1;
        for t in triangles {
            let corners = t.map(|ix| bases[ix as usize]);
            let up = t.map(|ix| f64::from(vertices[ix as usize].position[2]));
            let low = [0, 1].map(|a: usize| corners.map(|p| p[a]).into_iter().min().unwrap());
            let high = [0, 1].map(|a: usize| corners.map(|p| p[a]).into_iter().max().unwrap());
            if (0..2).all(|a| high[a] - low[a] <= 1 << patch.level) {
                continue;
            }
            let [a, b, c] = corners;
            let area = cross(corners) as f64;
            for p in (low[1]..=high[1]).flat_map(|y| (low[0]..=high[0]).map(move |x| [x, y])) {
                let parts = [[b, c, p], [c, a, p], [a, b, p]].map(cross);
                if parts.iter().any(|part| *part < 0) {
                    continue;
                }
                let [x, y] = [0, 1].map(|a| terrain.origin_m[a] + f64::from(p[a]) * terrain.spacing_m[a]);
                let height = heights[((p[1] - lo[1]) * width + p[0] - lo[0]) as usize];
                let truth = DVec3::new(x, y, f64::from(height)) - anchor;
                let at = *clip * truth.extend(1.0);
                if at.w <= 0.0 || at.z > at.w || at.x.abs() > at.w || at.y.abs() > at.w {
                    continue;
                }
                let drawn = parts.iter().zip(up).map(|(part, z)| *part as f64 * z).sum::<f64>() / area;
                let moved = *clip * truth.truncate().extend(drawn).extend(1.0);
                // Thresholds go by the derivative at the true point; what comes nearer moves by as much more.
                let nearer = (at.w / moved.w).max(1.0);
                let px = ((moved.xy() / moved.w - at.xy() / at.w) * half).length() / nearer;
                worst = worst.max(if moved.w > 0.0 && nearer < 1.25 { px } else { f64::INFINITY });
                tried += 1;
            }
        }
    }
    (worst, tried)
}

/// Walls close up, a thousand times as high as their spacing: the scale of thresholds must reach that far.
#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_budget_is_used_however_great_the_relief_is() {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [640, 360]).unwrap();
    for factor in [1.0_f32, 1e3, 1e6] {
        let mut grid = common::terrain("procedural:mountains?size=513");
        grid.heights_m.iter_mut().for_each(|h| *h *= factor);
        let terrain = Terrain::new(&grid, Prefilter::Subsample);
        let mut renderer = renderer(&gpu, &terrain, &scene(511, None, Some(10_000)));
        let camera = terrain.overview(60.0);
        let count = frame(&gpu, &mut renderer, &target, &camera).counters.index_count / 3;
        eprintln!("relief times {factor}: {count} of 10000");
        assert!((9_000..=10_000).contains(&count), "{factor}: {count}");
    }
}

/// What was prepared and never recorded must leave the tables of blocks as they were.
#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_frame_that_is_never_recorded_leaves_nothing_behind() {
    let gpu = common::gpu();
    let terrain = mountains("size=1025");
    let target = Offscreen::new(&gpu.device, [320, 200]).unwrap();
    let mut renderer = renderer(&gpu, &terrain, &scene(127, Some(1.0), None));
    let [here, .., there] = cameras(&terrain);
    let first = frame(&gpu, &mut renderer, &target, &here);
    renderer.prepare(&there, target.size).unwrap();
    let again = frame(&gpu, &mut renderer, &target, &here);
    assert!(first.triangles == again.triangles && first.nodes == again.nodes);
    let elsewhere = frame(&gpu, &mut renderer, &target, &there);
    assert!(first.nodes != elsewhere.nodes);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn no_deviation_shows_more_than_the_threshold() {
    // Without geomorph: what is near a window's perimeter is moved towards the coarser level, of which figures know
    // nothing; by less than that level's own deviation.
    const MOST_PX: f64 = 2.0;
    let gpu = common::gpu();
    let terrain = mountains("size=513");
    let target = Offscreen::new(&gpu.device, [320, 200]).unwrap();
    // The second asks for twice the threshold.
    let [asked, twice] = [1.0, 2.0].map(|factor| {
        let mut renderer = renderer(&gpu, &terrain, &scene(255, Some((factor * MOST_PX) as f32), None));
        let (mut worst, mut tried) = (0.0_f64, 0);
        for camera in cameras(&terrain) {
            let mesh = frame(&gpu, &mut renderer, &target, &camera);
            let clip = renderer.clip(&camera, DVec3::from(mesh.anchor_m), target.size);
            let (px, count) = worst_px(&terrain, &mesh, &clip, target.size);
            assert!(px <= factor * MOST_PX * 1.001, "{px} px of {}: {camera:?}", factor * MOST_PX);
            worst = worst.max(px);
            tried += count;
        }
        eprintln!("{worst:.3} px at worst of {}, {tried} samples", factor * MOST_PX);
        assert!(tried > 10_000, "only {tried} samples lie under coarser triangles");
        worst
    });
    assert!(asked >= MOST_PX / 4.0, "thresholds are too careful: {asked} px");
    // What keeps to twice the threshold only does not keep to it.
    assert!(twice > MOST_PX * 1.001, "half the threshold is kept as well: {twice} px");
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
