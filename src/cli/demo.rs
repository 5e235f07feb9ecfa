//! `tessclip demo`: no data, no arguments: pictures, a flight, a report and the checks in brief.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context as _;
use glam::DVec3;
use tessclip::gpu::Gpu;
use tessclip::heights::{GridSource, ReadOptions, open_terrain};
use tessclip::measure::invariants::Effort;
use tessclip::pyramid::store::{BuildOptions, Progress, build};
use tessclip::report::{ComparisonReport, Report, comparison_section, write_report};
use tessclip::rivals::{Detail, Method};
use tessclip::stream::{StreamOptions, TileSource};
use tessclip::surface::Ellipsoid;
use tessclip::{Camera, ColorMode, Factors, Prefilter, Scene, Terrain};

use super::Outcome;
use super::compare::{Extent, Study};
use super::fly::Flight;
use super::paths::{Course, Tempo};
use super::picture::{picture, write_png};

const TERRAIN: &str = "procedural:mountains?seed=7&size=2049";
const COMPARED: &str = "procedural:mountains?seed=7&size=1025";

#[derive(clap::Args)]
#[command(after_help = "Example: tessclip demo --out demo-out")]
pub struct Args {
    /// Directory for the pictures and the report
    #[arg(long, default_value = "demo-out", value_name = "DIR")]
    out: PathBuf,
}

pub fn run(args: &Args, quiet: bool) -> anyhow::Result<Outcome> {
    let begin = Instant::now();
    let say = |text: &str| if quiet { Ok(()) } else { super::print(text) };
    std::fs::create_dir_all(&args.out).with_context(|| format!("{}: cannot be made", args.out.display()))?;
    let gpu = Gpu::new()?;
    say(&format!("adapter: {}", gpu.describe()))?;
    let grid = open_terrain(TERRAIN, &ReadOptions::default())?;
    let terrain = Terrain::new(&grid, Prefilter::default());
    let size = [1280, 720];
    let mut pictures = Vec::new();
    for (name, scene, camera) in views(&terrain) {
        let file = format!("{name}.png");
        let rgba = picture(&gpu, &terrain, &scene, &camera, size, true)?;
        write_png(&args.out.join(&file), &rgba, size)?;
        say(&format!("  {}", args.out.join(&file).display()))?;
        pictures.push(file);
    }
    for (name, scene, terrain, camera) in worlds()? {
        let file = format!("{name}.png");
        let rgba = picture(&gpu, &terrain, &scene, &camera, size, true)?;
        write_png(&args.out.join(&file), &rgba, size)?;
        say(&format!("  {}", args.out.join(&file).display()))?;
        pictures.push(file);
    }
    say("store of the same terrain")?;
    let at = args.out.join("terrain.zarr");
    let store = BuildOptions { overwrite: true, sources: vec![TERRAIN.into()], ..BuildOptions::default() };
    build(&GridSource::new(grid), &at, &store, &Progress::default())?;
    let streamed = Terrain::streamed(TileSource::open(&at, StreamOptions::default())?);
    let name = at.display().to_string();
    say(
        "flights of 120 frames, 640 x 360: double turn from memory; another place each second, streamed, cold",
    )?;
    let mut over = fly(&gpu, &name, &streamed, "teleport", args, quiet)?;
    let mut report = fly(&gpu, TERRAIN, &terrain, "double-turn", args, quiet)?;
    report.runs.append(&mut over.runs);
    for run in &report.runs {
        say(&format!("  {}", super::fly::one_line(run)))?;
    }
    say("methods compared, quickly")?;
    let compared = compare(&gpu, args, quiet)?;
    for words in &compared.comparison.words {
        say(&format!("  {words}"))?;
    }
    report.comparison_section = Some(comparison_section(&compared)?);
    report.comparison = Some(compared.comparison);
    say("check, in brief")?;
    let odd = open_terrain("procedural:mountains?width=331&height=262", &ReadOptions::default())?;
    let rows = super::check::rows(&gpu, &odd, Effort::Brief)?;
    super::check::print_rows(&rows)?;
    let pass = rows.iter().all(|r| r.pass) && report.runs.iter().all(|r| r.valid);
    report.checks = Some(rows);
    report.pictures = pictures;
    write_report(&args.out, &report)?;
    super::print(&format!(
        "wrote {} pictures, report.html, report.json and frames.csv to {} in {:.0} s",
        report.pictures.len(),
        args.out.display(),
        begin.elapsed().as_secs_f64()
    ))?;
    Ok(if pass { Outcome::Done } else { Outcome::FellShort })
}

/// All methods on a smaller terrain; a report of its own, which the demo's repeats.
fn compare(gpu: &Gpu, args: &Args, quiet: bool) -> anyhow::Result<ComparisonReport> {
    let terrain = Terrain::new(&open_terrain(COMPARED, &ReadOptions::default())?, Prefilter::default());
    let extent = Extent::quick();
    let study = Study {
        name: COMPARED,
        terrain: &terrain,
        scene: Scene::default(),
        size: extent.size,
        fov_deg: 60.0,
        paths: &["double-turn".into()],
        methods: &Method::ALL,
        detail: Detail::default(),
        extent,
        note: None,
    };
    study.run(gpu, &args.out.join("compare"), quiet)
}

/// A short flight; its report is written, and overwritten by the next one's.
fn fly(
    gpu: &Gpu,
    name: &str,
    terrain: &Terrain,
    path: &str,
    args: &Args,
    quiet: bool,
) -> anyhow::Result<Report> {
    let tempo = Tempo { frames: 120, hz: None, speed_m_s: None };
    let flight = Flight {
        name,
        terrain,
        scene: Scene::default(),
        size: [640, 360],
        fov_deg: 60.0,
        course: Course::open(path, terrain, tempo)?,
        wait: false,
        cracks: 0,
        lose_device_at: None,
    };
    flight.fly(gpu, &args.out, quiet)
}

/// Views from the ground to high altitude, and what the method does.
fn views(terrain: &Terrain) -> Vec<(&'static str, Scene, Camera)> {
    let [low, high] = terrain.extent_m();
    let at = |u: f64, v: f64| [low[0] + (high[0] - low[0]) * u, low[1] + (high[1] - low[1]) * v];
    let stand = |u: f64, v: f64, above: f64, yaw_deg: f64, pitch_deg: f64| {
        let [x, y] = at(u, v);
        let ground = terrain.ground_height_m(x, y).map_or(0.0, f64::from);
        Camera {
            eye_m: DVec3::new(x, y, ground + above),
            yaw_deg,
            pitch_deg,
            fov_deg: 60.0,
            ..Camera::default()
        }
    };
    let plain = Scene::default;
    let colored = |color| Scene { color, ..Scene::default() };
    vec![
        ("1-ground", plain(), stand(0.36, 0.50, 60.0, 215.0, 3.0)),
        ("2-ridge", plain(), stand(0.32, 0.47, 500.0, 250.0, -8.0)),
        ("3-valley", plain(), stand(0.22, 0.30, 1_500.0, 20.0, -14.0)),
        ("4-flight", plain(), stand(0.50, 0.15, 2_500.0, 0.0, -18.0)),
        ("5-high", plain(), stand(0.50, 0.02, 9_000.0, 0.0, -28.0)),
        ("6-overview", Scene { fog: false, ..plain() }, terrain.overview(60.0)),
        (
            "7-levels-wireframe",
            Scene { n: 63, wireframe: true, ..colored(ColorMode::Levels) },
            stand(0.50, 0.40, 2_500.0, 0.0, -35.0),
        ),
        (
            "8-blocks",
            Scene { n: 127, drop_fine_levels: false, ..colored(ColorMode::Blocks) },
            stand(0.50, 0.40, 9_000.0, 0.0, -90.0),
        ),
        ("9-slope", colored(ColorMode::Slope), stand(0.50, 0.15, 2_500.0, 0.0, -18.0)),
        ("14-error", colored(ColorMode::Error), stand(0.50, 0.15, 2_500.0, 0.0, -18.0)),
        ("15-factors-by-error", Scene { n: 511, wireframe: true, factors: four_pixels(), ..plain() }, {
            stand(0.50, 0.40, 2_500.0, 0.0, -35.0)
        }),
    ]
}

/// So coarse that the edges of the triangles can be seen.
fn four_pixels() -> Factors {
    Factors::ByError { pixel_error: Some(4.0), budget: None }
}

/// Curved base surfaces: a planet from afar and where three of its charts meet, and a torus.
fn worlds() -> anyhow::Result<Vec<(&'static str, Scene, Terrain, Camera)>> {
    let read = |recipe: &str| open_terrain(recipe, &ReadOptions::default());
    let planet = Terrain::globe(vec![read("procedural:planet?seed=4&size=1025")?], Ellipsoid::WGS84)?;
    let torus = Terrain::on(
        &read("procedural:mountains?size=513")?,
        "torus:5000,1700".parse()?,
        Prefilter::default(),
    )?;
    let far = planet.overview(45.0);
    let low = planet.camera([-12.0, 4.0, 900e3, 15.0, -38.0], 60.0);
    let corner = planet.camera([45.0, 34.0, 1_500e3, 20.0, -60.0], 60.0);
    let ring = torus.overview(50.0);
    let levels = Scene { n: 127, wireframe: true, color: ColorMode::Levels, ..Scene::default() };
    Ok(vec![
        ("10-planet", Scene::default(), planet.clone(), far),
        ("11-planet-low", Scene::default(), planet.clone(), low),
        ("12-planet-charts", levels, planet, corner),
        ("13-torus", Scene::default(), torus, ring),
    ])
}
