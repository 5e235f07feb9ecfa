//! `tessclip fly`: a benchmark flight, closed loop (each frame starts when the last is done).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use tessclip::gpu::{Counters, Gpu, Offscreen};
use tessclip::measure::{Environment, FrameStatistics, UploadLedger};
use tessclip::report::{FrameRow, Geometry, Memory, Quantiles, Report, Run, SceneFacts, write_report};
use tessclip::{Renderer, Scene, Target, Terrain};

use super::Outcome;
use super::args::{LookArgs, ShapeArgs, TerrainArgs};
use super::paths::CameraPath;
use super::picture::draw_whole;
use super::scene_file::SceneFile;

#[derive(clap::Args)]
#[command(
    after_help = "Example: tessclip fly procedural:mountains --path double-turn --frames 300 --report out"
)]
pub struct Args {
    #[command(flatten)]
    terrain: TerrainArgs,
    #[command(flatten)]
    shape: ShapeArgs,
    #[command(flatten)]
    look: LookArgs,
    /// straight, double-turn, circle, or a CSV file t,x,y,z,yaw,pitch
    #[arg(long, default_value = "double-turn")]
    path: String,
    /// Frames to measure
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Directory for report.json, frames.csv and report.html
    #[arg(long, value_name = "DIR")]
    report: PathBuf,
}

pub fn run(args: &Args, quiet: bool) -> anyhow::Result<Outcome> {
    let file = SceneFile::of(&args.terrain.terrain)?;
    let terrain = args.terrain.over(&file).open()?;
    let scene = args.look.apply(args.shape.scene(&file), &file);
    scene.shape(&terrain)?;
    let path = CameraPath::open(&args.path, &terrain)?;
    path.at(0.0, args.look.fov(&file)).1.validate()?;
    let gpu = Gpu::new()?;
    let flight = Flight {
        name: &args.terrain.terrain,
        terrain: &terrain,
        scene,
        size: args.look.size(&file),
        fov_deg: args.look.fov(&file),
        path,
        frames: args.frames,
    };
    let report = flight.fly(&gpu, &args.report, quiet)?;
    for run in &report.runs {
        let ms = |v: Option<f64>| v.map_or("-".into(), |v| format!("{v:.2}"));
        super::print(&format!(
            "{}: {} frames, median {} ms, max {} ms, {} shifts, {} control bytes in the worst frame{}",
            run.path,
            run.frames,
            ms(run.frame_ms.p50),
            ms(run.frame_ms.max),
            run.upload.shifts,
            run.upload.control_bytes_max_frame,
            if run.valid { "" } else { " (NOT VALID)" },
        ))?;
    }
    super::print(&format!("wrote report.json, frames.csv and report.html to {}", args.report.display()))?;
    Ok(if report.runs.iter().all(|r| r.valid) { Outcome::Done } else { Outcome::FellShort })
}

/// A flight to measure.
pub struct Flight<'a> {
    pub name: &'a str,
    pub terrain: &'a Terrain,
    pub scene: Scene,
    pub size: [u32; 2],
    pub fov_deg: f64,
    pub path: CameraPath,
    pub frames: u32,
}

/// Frames drawn before the first measured one, to compile pipelines and touch memory.
const WARM_UP: u32 = 3;

impl Flight<'_> {
    /// Flies and writes the report; the files are opened before the first frame.
    pub fn fly(&self, gpu: &Gpu, dir: &Path, quiet: bool) -> anyhow::Result<Report> {
        let target = Offscreen::new(&gpu.device, self.size)?;
        let mut renderer =
            Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, self.terrain, &self.scene)?;
        renderer.time_passes();
        let mut report = self.empty_report(gpu, &renderer);
        write_report(dir, &report)?;
        let mut ledger = UploadLedger::default();
        let mut passes: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        let mut control_points = 0;
        let mut dropped = 0_u64;
        let (_, start) = self.path.at(0.0, self.fov_deg);
        let first = renderer.prepare(&start, self.size)?;
        control_points += first.control_points;
        ledger.add(&first);
        for _ in 0..WARM_UP {
            draw_whole(gpu, &mut renderer, &target, &start)?;
            renderer.finished_pass_times();
        }
        let bar = progress(u64::from(self.frames), quiet);
        for frame in 0..self.frames {
            let share = f64::from(frame) / f64::from((self.frames - 1).max(1));
            let (t_s, camera) = self.path.at(share, self.fov_deg);
            let begin = Instant::now();
            let upload = renderer.prepare(&camera, self.size)?;
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            renderer.record(&mut encoder, Target { color: &target.color, depth: &target.depth, clear: true });
            gpu.queue.submit([encoder.finish()]);
            let cpu_ms = begin.elapsed().as_secs_f64() * 1e3;
            gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
            let frame_ms = begin.elapsed().as_secs_f64() * 1e3;
            // Outside the measured time: per-pass times and counters.
            for (pass, ms) in renderer.finished_pass_times().unwrap_or_default() {
                passes.entry(pass).or_default().push(ms);
            }
            let counters: Counters = renderer.read_counters()?;
            dropped += u64::from(counters.patches_dropped);
            renderer.grow(&counters)?;
            ledger.add(&upload);
            report.rows.push(FrameRow {
                frame: frame as usize,
                t_s,
                frame_ms,
                cpu_ms,
                control_bytes: upload.control_bytes,
                height_bytes: upload.height_bytes,
                shifts: upload.shifts,
                patches: counters.expand_x,
                vertices: counters.vertices_needed,
                triangles: counters.index_count / 3,
            });
            bar.inc(1);
        }
        bar.finish_and_clear();
        let shape = renderer.shape();
        ledger.vertices_if_full = u64::from(shape.n()).pow(2) * u64::from(shape.levels());
        report.runs = vec![self.summarise(&renderer, &report.rows, ledger, &passes, control_points, dropped)];
        write_report(dir, &report)?;
        Ok(report)
    }

    fn empty_report(&self, gpu: &Gpu, renderer: &Renderer) -> Report {
        let last = self.terrain.source.lattice().last;
        Report {
            schema: "tessclip-report/1",
            environment: Environment::gather(&gpu.info),
            scene: SceneFacts {
                terrain: self.name.into(),
                base: self.terrain.base().to_string(),
                width_px: self.size[0],
                height_px: self.size[1],
                spacing_m: self.terrain.spacing_m,
                samples: last.map(|v| u64::from(v.unsigned_abs()) + 1),
            },
            plan: renderer.plan().clone(),
            runs: Vec::new(),
            checks: None,
            pictures: Vec::new(),
            rows: Vec::new(),
        }
    }

    fn summarise(
        &self,
        renderer: &Renderer,
        rows: &[FrameRow],
        upload: UploadLedger,
        passes: &BTreeMap<String, Vec<f64>>,
        control_points: u64,
        dropped_patches: u64,
    ) -> Run {
        let of = |f: fn(&FrameRow) -> f64| rows.iter().map(f).collect::<Vec<_>>();
        let triangles = FrameStatistics::of(&of(|r| f64::from(r.triangles)));
        let shape = renderer.shape();
        let window_m = f64::from(shape.n() - 1) * self.terrain.spacing_m[0].max(self.terrain.spacing_m[1]);
        let mut invalid_because = Vec::new();
        if dropped_patches > 0 {
            invalid_because.push(format!("{dropped_patches} patches were dropped for want of room"));
        }
        Run {
            method: "tessellated",
            params: serde_json::json!({
                "n": shape.n(), "levels": shape.levels(), "morph": self.scene.morph, "cull": self.scene.cull,
            }),
            frames: rows.len(),
            path: self.path.name.clone(),
            speed_windows_per_s: Some(self.path.length_m() / self.path.seconds() / window_m),
            frame_ms: FrameStatistics::of(&of(|r| r.frame_ms)),
            cpu_ms: Quantiles::of(&of(|r| r.cpu_ms)),
            gpu_ms: (!passes.is_empty())
                .then(|| passes.iter().map(|(k, v)| (k.clone(), Quantiles::of(v))).collect()),
            upload,
            geometry: Geometry {
                control_points,
                patches_p50: FrameStatistics::of(&of(|r| f64::from(r.patches))).p50,
                vertices_p50: FrameStatistics::of(&of(|r| f64::from(r.vertices))).p50,
                triangles_p50: triangles.p50,
                triangles_max: triangles.max,
                dropped_patches,
            },
            memory: Memory { gpu_bytes: renderer.gpu_bytes(), peak_rss_bytes: peak_rss_bytes() },
            error: None,
            stream: None,
            valid: invalid_because.is_empty(),
            invalid_because,
        }
    }
}

/// A bar on a terminal, nothing elsewhere.
pub fn progress(steps: u64, quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(steps);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} {per_sec} {eta}") {
        bar.set_style(style);
    }
    bar
}

/// Peak resident memory where Linux tells it.
fn peak_rss_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib * 1024)
}
