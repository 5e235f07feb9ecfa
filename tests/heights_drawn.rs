//! Heights asked of the CPU lie on what the GPU drew, whatever the base surface, the factors and the geomorph: points
//! of triangles read back are looked up again.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

mod common;

use glam::DVec3;
use tessclip::gpu::{Gpu, GpuMesh, Offscreen};
use tessclip::heights::{Degrees, HeightGrid, PositionGrid};
use tessclip::measure::invariants::draw;
use tessclip::renderer::DrawnSurface;
use tessclip::surface::{Base, Ellipsoid};
use tessclip::{Camera, Factors, Prefilter, Renderer, Scene, Terrain};

/// Triangles tried a frame; each gives seven points.
const TRIANGLES: usize = 400;

struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// From 0 to 1.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// World positions of a mesh's vertices.
fn positions(mesh: &GpuMesh) -> Vec<DVec3> {
    let anchor = DVec3::from(mesh.anchor_m);
    mesh.vertices.iter().map(|v| anchor + DVec3::from(v.position.map(f64::from))).collect()
}

/// A point of a drawn triangle, and the level drawn there where it lies inside.
type Point = (DVec3, Option<u32>);

/// Points of random triangles: one inside, the corners and the middles of the edges. Those on the outline are moved
/// inwards by `inset` of the way.
fn points_of(mesh: &GpuMesh, inset: f64) -> Vec<Point> {
    let positions = positions(mesh);
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut out = Vec::new();
    for _ in 0..20 * TRIANGLES {
        let pick = random.next() % mesh.triangles.len() as u64;
        let t = mesh.triangles[usize::try_from(pick).unwrap()];
        let [a, b, c] = t.map(|ix| positions[ix as usize]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        // What collapsed over a void, and slivers, whose planes are rounding.
        if (b - a).cross(c - a).length() <= 0.01 * longest * longest {
            continue;
        }
        let middle = (a + b + c) / 3.0;
        let (mut s, mut t_share) = (random.share(), random.share());
        if s + t_share > 1.0 {
            (s, t_share) = (1.0 - s, 1.0 - t_share);
        }
        let inside = a + (b - a) * s + (c - a) * t_share;
        out.push((inside.lerp(middle, 0.05), Some(mesh.vertices[t[0] as usize].level())));
        for p in [a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5] {
            out.push((p.lerp(middle, inset), None));
        }
        if out.len() >= 7 * TRIANGLES {
            break;
        }
    }
    assert!(out.len() >= 7 * 50, "only {} points", out.len());
    out
}

/// Metres that a point lies off a surface, at right angles to it; `None` where it finds nothing.
fn off_m(terrain: &Terrain, drawn: &DrawnSurface, p: DVec3) -> Option<f64> {
    let spot = drawn.at(p)?;
    // Where positions are the data, the slope is not against what `above_m` is measured along.
    let sheets = terrain.curved.as_ref().is_some_and(|c| c.points.is_some());
    let lean = if sheets { 1.0 } else { spot.slope_deg.to_radians().cos() };
    Some(spot.above_m.abs() * lean)
}

/// A terrain, how it is drawn and from where.
struct Case<'a> {
    name: &'a str,
    terrain: &'a Terrain,
    scene: Scene,
    cameras: Vec<Camera>,
    /// What the GPU's positions may be off, metres.
    most_m: f64,
    /// See [`points_of`]: open curved surfaces end at straight edges, from which f32 positions stray.
    inset: f64,
    /// Share of the points that may lie on another sheet.
    astray: f64,
}

/// On curved surfaces the GPU's polynomials leave out more of what is far away, in proportion to what it shows as:
/// hundredths of a pixel of globes as coarse as these, where blocks bend by a tenth of a radian; a tenth of a pixel
/// of a torus, where they bend by half of one.
fn allowed_m(terrain: &Terrain, camera: &Camera, p: DVec3, most_m: f64) -> f64 {
    let share = match terrain.base() {
        Base::Plane => 0.0,
        Base::Torus { .. } => 1e-4,
        _ => 3e-5,
    };
    most_m + share * camera.eye_m.distance(p)
}

impl<'a> Case<'a> {
    fn new(name: &'a str, terrain: &'a Terrain, scene: Scene, cameras: Vec<Camera>) -> Self {
        Self { name, terrain, scene, cameras, most_m: 1e-3, inset: 0.0, astray: 0.0 }
    }

    fn renderer(&self, gpu: &Gpu) -> Renderer {
        Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, self.terrain, &self.scene).unwrap()
    }

    /// Draws every view and looks points of it up; tells how many levels were among them at most.
    fn check(&self) -> usize {
        let gpu = common::gpu();
        let target = Offscreen::new(&gpu.device, [320, 200]).unwrap();
        let mut renderer = self.renderer(&gpu);
        let (mut most_levels, mut worst) = (0, 0.0_f64);
        for (k, camera) in self.cameras.iter().enumerate() {
            draw(&gpu, &mut renderer, &target, camera).unwrap();
            let mesh = renderer.read_mesh().unwrap();
            assert_eq!(mesh.counters.patches_dropped, 0);
            let drawn = renderer.drawn().unwrap();
            let points = points_of(&mesh, self.inset);
            let mut levels = std::collections::BTreeSet::new();
            let mut astray = 0;
            for (p, level) in &points {
                let told = || format!("{}, camera {k} {camera:?}: {p}", self.name);
                let spot = drawn.at(*p);
                let off = off_m(self.terrain, &drawn, *p);
                let most_m = allowed_m(self.terrain, camera, *p, self.most_m);
                if self.astray > 0.0 {
                    astray += usize::from(off.is_none_or(|m| m > most_m));
                    continue;
                }
                let (spot, off) = (spot.unwrap_or_else(|| panic!("{}", told())), off.unwrap());
                assert!(off <= most_m, "{}: {off} m off {spot:?}", told());
                if let Some(level) = level {
                    assert_eq!(spot.level, *level, "{}: {spot:?}", told());
                }
                worst = worst.max(off);
                levels.insert(spot.level);
            }
            let most = self.astray * points.len() as f64;
            assert!(astray as f64 <= most, "{}, camera {k}: {astray} of {}", self.name, points.len());
            most_levels = most_levels.max(levels.len());
        }
        eprintln!("{}: {worst:.2e} m off at worst, {most_levels} levels", self.name);
        most_levels
    }
}

fn uniform(n: u32, morph: bool) -> Scene {
    Scene { n, morph, cull: false, drop_fine_levels: false, ..Scene::default() }
}

fn by_error(n: u32, pixel_error: Option<f32>, budget: Option<u32>) -> Scene {
    Scene { factors: Factors::ByError { pixel_error, budget }, ..uniform(n, false) }
}

/// Heights of levels differ: what takes the wrong level's shows.
fn mountains(width: u32, height: u32) -> Terrain {
    let spec = format!("procedural:mountains?width={width}&height={height}&spacing=30");
    Terrain::new(&common::terrain(&spec), Prefilter::LowPass)
}

/// In the middle, at the border, in a corner, outside and high up, in shares of the data; all see some of it.
fn over_plane(terrain: &Terrain) -> Vec<Camera> {
    let [low, high] = terrain.extent_m();
    [
        ([0.5, 0.5], 60.0, 40.0, -10.0),
        ([0.31, 0.77], 250.0, 140.0, -35.0),
        ([1.0, 0.2], 40.0, -60.0, -20.0),
        ([0.0, 0.0], 900.0, 45.0, -60.0),
        ([1.3, 0.6], 2_000.0, -90.0, -30.0),
    ]
    .map(|([u, v], above, yaw_deg, pitch_deg)| {
        let (x, y) = (low[0] + u * (high[0] - low[0]), low[1] + v * (high[1] - low[1]));
        let ground = f64::from(terrain.ground_height_m(x, y).unwrap_or(0.0));
        let eye_m = DVec3::new(x, y, ground + above);
        Camera { eye_m, yaw_deg, pitch_deg, fov_deg: 60.0, ..Camera::default() }
    })
    .to_vec()
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn on_a_plane_with_and_without_geomorph() {
    let terrain = mountains(203, 150);
    for (n, morph) in [(15, false), (31, false), (31, true), (63, true)] {
        let name = format!("plane, n = {n}, morph {morph}");
        let levels = Case::new(&name, &terrain, uniform(n, morph), over_plane(&terrain)).check();
        assert!(levels >= 2, "{name}: {levels} levels");
    }
    // The finest levels left out, as a small picture asks for.
    let dropping = Scene { drop_fine_levels: true, ..uniform(31, true) };
    Case::new("plane from high up", &terrain, dropping, over_plane(&terrain)).check();
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn on_a_plane_with_factors_by_error() {
    // The data ends within a block and within a cell.
    let terrain = mountains(531, 402);
    for (pixel_error, budget) in [(Some(2.0), None), (None, Some(9_000)), (Some(6.0), None)] {
        for (cull, morph) in [(false, true), (true, false)] {
            let scene = Scene { cull, morph, ..by_error(127, pixel_error, budget) };
            let name = format!("plane by error, {pixel_error:?} px, {budget:?} triangles, cull {cull}");
            // Culled patches have no factors: what lies on their borders may be theirs.
            let inset = if cull { 1e-3 } else { 0.0 };
            Case { inset, ..Case::new(&name, &terrain, scene, over_plane(&terrain)) }.check();
        }
    }
}

/// Void samples: a lake in the middle and single ones.
fn holed() -> HeightGrid {
    let mut grid = common::terrain("procedural:mountains?width=203&height=150&spacing=30");
    let void = |i: usize| {
        let (x, y) = (i % 203, i / 203);
        ((60..76).contains(&x) && (50..63).contains(&y)) || (x * 31 + y * 17) % 997 == 5
    };
    grid.valid = Some((0..203 * 150).map(|i| !void(i)).collect());
    grid
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn holes_and_borders_are_those_of_the_mesh() {
    let terrain = Terrain::new(&holed(), Prefilter::Subsample);
    for morph in [false, true] {
        Case::new("plane with voids", &terrain, uniform(31, morph), over_plane(&terrain)).check();
    }
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [64, 64]).unwrap();
    let case = Case::new("holes", &terrain, uniform(31, false), vec![]);
    let mut renderer = case.renderer(&gpu);
    assert!(renderer.drawn().is_err(), "nothing was drawn yet");
    let camera = Camera { eye_m: DVec3::new(2_000.0, 1_700.0, 3_000.0), ..Camera::default() };
    draw(&gpu, &mut renderer, &target, &camera).unwrap();
    let (mesh, drawn) = (renderer.read_mesh().unwrap(), renderer.drawn().unwrap());
    let hole = DVec3::new(67.0 * 30.0, 56.0 * 30.0, 0.0);
    assert_eq!((drawn.at(hole), terrain.height_at(hole)), (None, None));
    for (x, y) in [(-1.0, 100.0), (202.0 * 30.0 + 1.0, 100.0), (100.0, -0.5), (100.0, 149.0 * 30.0 + 0.5)] {
        let beside = DVec3::new(x, y, 0.0);
        assert_eq!((drawn.at(beside), terrain.height_at(beside)), (None, None), "{beside}");
    }
    // Anywhere in the data: something is found exactly where a triangle is drawn.
    let flat: Vec<_> = positions(&mesh).iter().map(|p| p.truncate()).collect();
    let mut random = Random(77);
    let mut counts = [0; 2];
    for k in 0..600 {
        // Every third near the lake.
        let near = k % 3 == 0;
        let (low, size) = if near { ([55.0, 45.0], [26.0, 23.0]) } else { ([0.0; 2], [202.0, 149.0]) };
        let p = [0, 1].map(|a: usize| 30.0 * (low[a] + size[a] * random.share()));
        let p = DVec3::new(p[0], p[1], 0.0);
        // Share of the point's least barycentric coordinate, by triangle.
        let inside = mesh.triangles.iter().filter_map(|t| {
            let [a, b, c] = t.map(|ix| flat[ix as usize]);
            let area = (b - a).perp_dot(c - a);
            let q = p.truncate() - a;
            let (u, v) = (q.perp_dot(c - a) / area, (b - a).perp_dot(q) / area);
            (area > 0.0).then_some(u.min(v).min(1.0 - u - v))
        });
        let best = inside.fold(f64::NEG_INFINITY, f64::max);
        if best.abs() < 1e-6 {
            continue;
        }
        assert_eq!(drawn.at(p).is_some(), best > 0.0, "{p}");
        counts[usize::from(best > 0.0)] += 1;
    }
    assert!(counts[0] > 30 && counts[1] > 300, "{counts:?}");
}

fn planet(size: u32) -> Terrain {
    let grid = common::terrain(&format!("procedural:planet?size={size}"));
    Terrain::globe(vec![grid], Ellipsoid::WGS84).unwrap()
}

/// Over poles, cube corners and borders, and beside them, from several heights.
fn over_planet(terrain: &Terrain) -> Vec<Camera> {
    let corner = (1.0_f64 / 2.0_f64.sqrt()).atan().to_degrees();
    let places =
        [[0.0, 90.0], [180.0, 0.0], [45.0, corner], [-135.7, -corner + 0.4], [12.3, 45.6], [45.0, 3.0]];
    let views = places.iter().enumerate();
    views.map(|(k, [x, y])| terrain.camera([*x, *y, [2e4, 4e5, 3e6][k % 3], 30.0, -40.0], 60.0)).collect()
}

/// A millionth of the radius: what two cells of a coarse level leave of their block's polynomial.
const PLANET_M: f64 = 6.4;

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn on_a_globe_across_its_charts() {
    let terrain = planet(129);
    for (n, morph) in [(31, false), (63, true)] {
        let name = format!("planet, n = {n}, morph {morph}");
        let case = Case::new(&name, &terrain, uniform(n, morph), over_planet(&terrain));
        let levels = Case { most_m: PLANET_M, ..case }.check();
        assert!(levels >= 2, "{name}: {levels} levels");
    }
    let dropping = Scene { drop_fine_levels: true, cull: true, ..uniform(31, true) };
    let case = Case::new("planet as seen", &terrain, dropping, over_planet(&terrain));
    Case { most_m: PLANET_M, ..case }.check();
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn on_a_globe_with_factors_by_error() {
    let terrain = planet(513);
    let cameras = over_planet(&terrain)[2..5].to_vec();
    let case = Case::new("planet by error", &terrain, by_error(511, Some(1.0), None), cameras);
    Case { most_m: PLANET_M, ..case }.check();
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn on_rings_and_patches() {
    let dunes = common::terrain("procedural:dunes?width=301&height=200");
    let torus = Base::Torus { major_m: 4_000.0, minor_m: 1_200.0 };
    let torus = Terrain::on(&dunes, torus, Prefilter::Subsample).unwrap();
    let mut cameras = Vec::new();
    for (x, y) in [(0.0, 0.0), (2_999.0, 1_990.0), (8_970.0, 4_100.0), (4_500.0, 3_000.0)] {
        cameras.push(torus.camera([x, y, 300.0, 0.0, -20.0], 60.0));
    }
    // Where a cell spans half a radian, normals are a decimetre off at its heights.
    for (n, morph, most_m) in [(31, false, 0.2), (63, false, 2e-2), (63, true, 2e-2)] {
        let name = format!("torus, n = {n}, morph {morph}");
        let case = Case::new(&name, &torus, uniform(n, morph), cameras.clone());
        assert!(Case { most_m, ..case }.check() >= 2);
    }
    let by_error = by_error(511, None, Some(9_000));
    Case { most_m: 2e-2, ..Case::new("torus by error", &torus, by_error, cameras) }.check();

    // Degrees on the ellipsoid, with open borders: a chart of its own.
    let mut alps = common::terrain("procedural:mountains?width=203&height=150");
    alps.georeference.degrees =
        Some(Degrees { west: 9.0, south: 46.0, step: [0.002; 2], metres_per_degree: [77_000.0, 111_200.0] });
    let wgs84 = Base::Ellipsoid { a_m: Ellipsoid::WGS84.a, b_m: Ellipsoid::WGS84.b };
    let alps = Terrain::on(&alps, wgs84, Prefilter::LowPass).unwrap();
    let poses = [[9.2, 46.15, 3_500.0], [9.0, 46.0, 4_000.0], [9.404, 46.2, 9_000.0]];
    let cameras: Vec<_> = poses.map(|[x, y, z]| alps.camera([x, y, z, 20.0, -30.0], 60.0)).to_vec();
    for morph in [false, true] {
        let case = Case::new("patch of the Earth", &alps, uniform(31, morph), cameras.clone());
        assert!(Case { most_m: 2e-2, inset: 1e-3, ..case }.check() >= 2);
    }
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn on_positions_that_hang_over_and_fold() {
    let camera = |eye: [f64; 3], pitch_deg| {
        let eye_m = DVec3::from(eye);
        Camera { eye_m, yaw_deg: 90.0, pitch_deg, fov_deg: 60.0, ..Camera::default() }
    };
    let cameras = vec![camera([-2_000.0, 300.0, 1_500.0], -20.0), camera([3_500.0, -1_000.0, 500.0], -5.0)];
    let terrain = |recipe: &str| Terrain::sampled(PositionGrid::parse(recipe).unwrap());
    // One level: under the wave and on the wall as well.
    let overhang = terrain("overhang?size=113");
    let case = Case::new("overhang", &overhang, uniform(255, false), cameras.clone());
    Case { most_m: 2e-2, inset: 1e-4, ..case }.check();
    // Coarse triangles cut through the wave, and stand out over its rim.
    let overhang = terrain("overhang?size=257");
    let case = Case::new("overhang in levels", &overhang, uniform(31, true), cameras.clone());
    Case { most_m: 2e-2, inset: 1e-4, astray: 0.05, ..case }.check();
    // Three sheets lie on each other: which one is found is open, and their triangles differ by decimetres.
    let fold = terrain("fold?size=113");
    let case = Case::new("fold", &fold, uniform(255, false), cameras);
    Case { most_m: 2e-2, inset: 1e-4, astray: 0.1, ..case }.check();
}

/// Where one level is drawn, without geomorph, it is the full-resolution surface.
#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn what_is_drawn_of_one_level_is_the_full_resolution() {
    let plane = mountains(113, 90);
    let planet = planet(129);
    let dunes = common::terrain("procedural:dunes?width=301&height=200");
    let torus = Base::Torus { major_m: 4_000.0, minor_m: 1_200.0 };
    let torus = Terrain::on(&dunes, torus, Prefilter::Subsample).unwrap();
    let overhang = Terrain::sampled(PositionGrid::parse("overhang?size=113").unwrap());
    let on_torus = torus.camera([10.0, 20.0, 500.0, 0.0, -20.0], 60.0);
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [64, 64]).unwrap();
    for (name, terrain, camera, most_m) in [
        ("plane", &plane, over_plane(&plane)[1], 1e-3),
        ("planet", &planet, over_planet(&planet)[4], PLANET_M),
        ("torus", &torus, on_torus, 2e-2),
        ("overhang", &overhang, Camera { eye_m: DVec3::new(0.0, 0.0, 3e3), ..Camera::default() }, 2e-2),
    ] {
        let case = Case::new(name, terrain, uniform(255, false), vec![camera]);
        let mut renderer = case.renderer(&gpu);
        assert_eq!(renderer.shape().levels(), 1, "{name}");
        draw(&gpu, &mut renderer, &target, &camera).unwrap();
        let (mesh, drawn) = (renderer.read_mesh().unwrap(), renderer.drawn().unwrap());
        for (p, _) in points_of(&mesh, 1e-4) {
            let (full, spot) = (terrain.surface_at(p).unwrap(), drawn.at(p).unwrap());
            let off =
                full.above_m.abs() * if name == "overhang" { 1.0 } else { full.slope_deg.to_radians().cos() };
            assert!(off <= most_m, "{name} {p}: {full:?}");
            assert_eq!(full.level, 0);
            let apart = full.point_m.distance(spot.point_m);
            let steep = full.slope_deg.to_radians().tan().abs().max(1.0);
            assert!(apart <= 2.0 * most_m * steep, "{name} {p}: {full:?} {spot:?}");
        }
    }
}

/// The same points on the surface of another view: many lie off it.
#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn another_frames_surface_is_told_apart() {
    let plane = mountains(203, 150);
    let planet = planet(129);
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [64, 64]).unwrap();
    for (name, terrain, cameras, most_m) in
        [("plane", &plane, over_plane(&plane), 1e-3), ("planet", &planet, over_planet(&planet), PLANET_M)]
    {
        let case = Case::new(name, terrain, uniform(31, true), vec![]);
        let mut renderer = case.renderer(&gpu);
        draw(&gpu, &mut renderer, &target, &cameras[3]).unwrap();
        let other = renderer.drawn().unwrap();
        draw(&gpu, &mut renderer, &target, &cameras[1]).unwrap();
        let points = points_of(&renderer.read_mesh().unwrap(), 0.0);
        let wrong = |drawn: &DrawnSurface| {
            let most_m = |p: DVec3| allowed_m(terrain, &cameras[1], p, most_m);
            let lost = |p: DVec3| off_m(terrain, drawn, p).is_none_or(|m| m > most_m(p));
            points.iter().filter(|(p, _)| lost(*p)).count()
        };
        assert_eq!(wrong(&renderer.drawn().unwrap()), 0, "{name}");
        let off = wrong(&other);
        assert!(off * 8 > points.len(), "{name}: {off} of {}", points.len());
    }
}

/// What the camera does not see is there all the same.
#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn culled_patches_count_as_drawn() {
    let terrain = mountains(203, 150);
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [64, 64]).unwrap();
    let camera = over_plane(&terrain)[0];
    let surface = |cull| {
        let scene = Scene { cull, ..uniform(31, true) };
        let mut renderer = Case::new("culling", &terrain, scene, vec![]).renderer(&gpu);
        draw(&gpu, &mut renderer, &target, &camera).unwrap();
        (renderer.drawn().unwrap(), renderer.read_mesh().unwrap().triangles.len())
    };
    let ((seen, few), (all, many)) = (surface(true), surface(false));
    assert!(few < many);
    let mut random = Random(5);
    for _ in 0..500 {
        let p = DVec3::new(random.share() * 202.0 * 30.0, random.share() * 149.0 * 30.0, 0.0);
        assert_eq!(seen.at(p), all.at(p), "{p}");
        assert!(seen.at(p).is_some(), "{p}");
    }
}
