//! The whole comparison: for each path all settings fly in turn, then their errors are measured.

use std::path::Path;

use anyhow::bail;
use indicatif::ProgressBar;
use tessclip::gpu::{Gpu, Offscreen};
use tessclip::measure::pairs::{Measurer, Noise, Ratio, Turn, judge, judge_by, measure, median, medians};
use tessclip::measure::{Environment, FrameStatistics, percentile};
use tessclip::report::{
    Cannot, Comparison, ComparisonReport, Front, FrontPoint, MethodRow, PathComparison, Quantiles, SampleRow,
    SceneFacts, mark_fronts, runs, words, write_comparison,
};
use tessclip::rivals::{Detail, Lab, Method};
use tessclip::{Factors, Scene, Terrain};

use super::super::fly::progress;
use super::super::paths::{Course, Tempo};
use super::ExtentArgs;
use super::errors::Truth;
use super::flights::{FlightLog, Range};
use super::settings::{Setting, settings};
use super::uploads::uploads;

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    pub frames: u32,
    pub rounds: u32,
    /// Rounds that the settings of the sweep fly in; the others fly in all.
    pub sweep_rounds: u32,
    pub views: u32,
    pub sweep: bool,
    pub quick: bool,
    /// Longest flight, milliseconds.
    pub longest_flight_ms: f64,
    /// Picture where none is asked for, pixels.
    pub size: [u32; 2],
}

impl Extent {
    pub fn of(args: &ExtentArgs) -> Self {
        let usual = if args.quick { Self::quick() } else { Self::full() };
        Self {
            frames: args.frames.unwrap_or(usual.frames),
            rounds: args.rounds.unwrap_or(usual.rounds),
            views: args.views.unwrap_or(usual.views),
            sweep: args.sweep || usual.sweep,
            ..usual
        }
    }

    /// 1,200 frames a method, so that there is a 99th percentile.
    fn full() -> Self {
        Self {
            frames: 200,
            rounds: 6,
            sweep_rounds: 5,
            views: 12,
            sweep: false,
            quick: false,
            longest_flight_ms: 20_000.0,
            size: [1280, 720],
        }
    }

    /// A minute or two.
    pub fn quick() -> Self {
        Self {
            frames: 40,
            rounds: 5,
            sweep_rounds: 1,
            views: 4,
            sweep: true,
            quick: true,
            longest_flight_ms: 2_000.0,
            size: [640, 360],
        }
    }
}

/// The case that all are held against: ours.
const BASELINE: usize = 0;

/// What is compared.
pub struct Study<'a> {
    pub name: &'a str,
    pub terrain: &'a Terrain,
    pub scene: Scene,
    pub size: [u32; 2],
    pub fov_deg: f64,
    pub paths: &'a [String],
    pub methods: &'a [Method],
    pub detail: Detail,
    pub extent: Extent,
    /// What was done to the data so that all methods can draw it.
    pub note: Option<String>,
}

/// Flies the settings of one path and keeps all that was measured.
struct Flights<'a> {
    range: &'a Range<'a>,
    course: &'a Course,
    cases: &'a [Setting],
    sweep_rounds: usize,
    bar: &'a ProgressBar,
    /// By case and round.
    logs: Vec<Vec<FlightLog>>,
}

/// Frames of a round below which its 99th percentile is not asked for.
const LEAST_FOR_R99: usize = 100;

impl Measurer for Flights<'_> {
    type Error = anyhow::Error;

    fn flight(&mut self, turn: Turn) -> anyhow::Result<Vec<f64>> {
        let setting = &self.cases[turn.case];
        if !setting.usual && turn.round >= self.sweep_rounds {
            return Ok(Vec::new());
        }
        // The stride of the first flight is that of all: every round flies the same frames.
        let every = self.logs[turn.case].first().map(|log| log.every);
        let log = self.range.fly(setting, self.course, every)?;
        let times = log.frames.iter().map(|f| f.frame_ms).collect();
        self.logs[turn.case].push(log);
        self.bar.inc(1);
        Ok(times)
    }
}

impl Study<'_> {
    /// Measures everything; the report is written before, after each path, and at the end.
    pub fn run(&self, gpu: &Gpu, dir: &Path, quiet: bool) -> anyhow::Result<ComparisonReport> {
        let target = Offscreen::new(&gpu.device, self.size)?;
        let (device, queue) = (&gpu.device, &gpu.queue);
        let lab = Lab::new(device, queue, Offscreen::FORMAT, self.terrain, &self.scene);
        let range = Range {
            gpu,
            lab: &lab,
            target: &target,
            fov_deg: self.fov_deg,
            longest_flight_ms: self.extent.longest_flight_ms,
        };
        let mut report = self.empty_report(gpu);
        let tempo = Tempo { frames: self.extent.frames, hz: None, speed_m_s: None };
        let mut courses = Vec::new();
        for path in self.paths {
            let course = Course::open(path, self.terrain, tempo)?;
            course.at(0, self.fov_deg).1.validate()?;
            courses.push(course);
        }
        write_comparison(dir, &report)?;
        let (cases, cannot) = self.able(gpu, &lab)?;
        report.comparison.cannot = cannot;
        let steps = courses.len() as u64 * (self.flight_count(&cases) + cases.len() as u64);
        let bar = progress(steps, quiet);
        for course in &courses {
            let (path, samples) = self.path(&range, course, &cases, &bar, &mut report)?;
            report.comparison.paths.push(path);
            report.samples.extend(samples);
            report.comparison.words = words(&report.comparison);
            write_comparison(dir, &report)?;
        }
        bar.finish_and_clear();
        let moving = Course::open("straight", self.terrain, tempo)?;
        report.comparison.uploads = uploads(&range, self.methods, &moving)?;
        let mut said = words(&report.comparison);
        said.extend(self.note.iter().map(|note| format!("Of the data: {note}.")));
        report.comparison.words = said;
        report.runs = runs(&report.comparison);
        write_comparison(dir, &report)?;
        Ok(report)
    }

    /// The settings that can be drawn here: ours, the others, ours once more, then the sweep; and why the rest
    /// cannot. Ours at both ends of a round: what the machine does within one shows in A against A.
    fn able(&self, gpu: &Gpu, lab: &Lab) -> anyhow::Result<(Vec<Setting>, Vec<Cannot>)> {
        let wanted = settings(self.methods, self.detail, self.extent.sweep, self.extent.quick);
        let (mut usual, mut swept, mut cannot) = (Vec::new(), Vec::new(), Vec::<Cannot>::new());
        for mut setting in wanted {
            let made = lab.make(setting.method, &setting.detail).map(drop);
            // What was dropped is given back before the next one is made.
            gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
            if let Err(why) = made {
                let why = format!("{}: {why}", setting.words());
                cannot.push(Cannot { method: setting.method.name(), why });
                continue;
            }
            if let Some(n) = setting.window() {
                let factors = match setting.method {
                    Method::ByError => Factors::ByError { pixel_error: None, budget: None },
                    _ => Factors::Uniform,
                };
                let scene = Scene { n, levels: setting.detail.levels, factors, ..lab.scene.clone() };
                setting.detail.levels = Some(scene.shape(self.terrain)?.levels());
            }
            if setting.usual { usual.push(setting) } else { swept.push(setting) }
        }
        let Some(ours) = usual.iter().position(|s| s.method == Method::Tessellated) else {
            let why = cannot.iter().find(|c| c.method == Method::Tessellated.name());
            bail!("{}", why.map_or_else(String::new, |c| c.why.clone()));
        };
        let ours = usual.remove(ours);
        usual.insert(BASELINE, ours);
        usual.push(ours);
        usual.extend(swept);
        Ok((usual, cannot))
    }

    fn flight_count(&self, cases: &[Setting]) -> u64 {
        let rounds = |s: &Setting| if s.usual { self.extent.rounds } else { self.sweep_rounds() };
        cases.iter().map(|s| u64::from(rounds(s))).sum()
    }

    fn sweep_rounds(&self) -> u32 {
        self.extent.sweep_rounds.min(self.extent.rounds)
    }

    fn path(
        &self,
        range: &Range<'_>,
        course: &Course,
        cases: &[Setting],
        bar: &ProgressBar,
        report: &mut ComparisonReport,
    ) -> anyhow::Result<(PathComparison, Vec<SampleRow>)> {
        let mut flights = Flights {
            range,
            course,
            cases,
            sweep_rounds: self.sweep_rounds() as usize,
            bar,
            logs: cases.iter().map(|_| Vec::new()).collect(),
        };
        measure(cases.len(), self.extent.rounds as usize, &mut flights)?;
        let logs = flights.logs;
        let again = last_usual(cases);
        let noise = Noise::of(&round_medians(&logs[BASELINE], 1), &round_medians(&logs[again], 1));
        let truth = match self.extent.views {
            0 => None,
            views => match Truth::of(range, course, views, self.detail) {
                Ok(truth) => Some(truth),
                Err(why) => {
                    let why = format!("no error is measured: the full resolution cannot be drawn: {why:#}");
                    let known = report.comparison.cannot.iter().any(|c| c.why == why);
                    report.comparison.cannot.extend((!known).then_some(Cannot { method: "all", why }));
                    None
                }
            },
        };
        let mut methods = Vec::new();
        let mut fronts: Vec<Front> = Vec::new();
        for (case, setting) in cases.iter().enumerate() {
            bar.inc(1);
            if case == again {
                continue;
            }
            let error = truth.as_ref().map(|t| t.error_of(range, setting)).transpose()?;
            let mut row = row(setting, &logs[case], error);
            if setting.usual && case != BASELINE {
                row.ratio = self.ratio(&logs[case], [&logs[BASELINE], &logs[again]], row.every, &noise);
                row.r99_ratio = judge_by(
                    &round_times(&logs[case], 1),
                    [&round_times(&logs[BASELINE], 1), &round_times(&logs[again], 1)],
                    &noise,
                    r99,
                );
            }
            if let Some(n) = setting.window() {
                let levels = setting.detail.levels.map(u64::from);
                row.upload.vertices_if_full = levels.map(|l| u64::from(n).pow(2) * l);
            }
            let point = point(setting, &row);
            match fronts.iter_mut().find(|f| f.method == row.method) {
                Some(front) => front.points.push(point),
                None => fronts.push(Front { method: row.method, points: vec![point] }),
            }
            if setting.usual {
                methods.push(row);
            }
        }
        let outer_front = mark_fronts(&mut fronts);
        let path = course.path.name.clone();
        let samples = samples(&path, cases, again, &logs);
        Ok((PathComparison { path, noise, methods, fronts, outer_front }, samples))
    }

    /// A method's times against ours, over the frames that it flew: both, and ours against ours.
    fn ratio(
        &self,
        method: &[FlightLog],
        [first, second]: [&Vec<FlightLog>; 2],
        every: u32,
        noise: &Noise,
    ) -> Option<Ratio> {
        let [first, second] = [first, second].map(|logs| round_medians(logs, every));
        judge(&round_medians(method, every), &first, &noise.again(&first, &second))
    }

    fn empty_report(&self, gpu: &Gpu) -> ComparisonReport {
        ComparisonReport {
            schema: "tessclip-report/1",
            environment: Environment::gather(&gpu.info),
            scene: SceneFacts::of(self.name, self.terrain, self.size),
            runs: Vec::new(),
            comparison: Comparison {
                quick: self.extent.quick,
                baseline: Method::Tessellated.name(),
                frames_per_flight: self.extent.frames,
                rounds: self.extent.rounds,
                paths: Vec::new(),
                uploads: Vec::new(),
                cannot: Vec::new(),
                words: Vec::new(),
            },
            samples: Vec::new(),
        }
    }
}

/// The last case that flies in all rounds: ours once more.
fn last_usual(cases: &[Setting]) -> usize {
    cases.iter().rposition(|s| s.usual).unwrap_or(0)
}

/// Times of each round, of every k-th frame of the path.
fn round_times(logs: &[FlightLog], every: u32) -> Vec<Vec<f64>> {
    let of_log =
        |log: &FlightLog| log.frames.iter().filter(|f| f.number % every == 0).map(|f| f.frame_ms).collect();
    logs.iter().map(of_log).collect()
}

/// Their medians.
fn round_medians(logs: &[FlightLog], every: u32) -> Vec<f64> {
    medians(&round_times(logs, every))
}

/// p99 / p50 of a round.
fn r99(frames_ms: &[f64]) -> Option<f64> {
    if frames_ms.len() < LEAST_FOR_R99 {
        return None;
    }
    let mut sorted = frames_ms.to_vec();
    sorted.sort_by(f64::total_cmp);
    Some(percentile(&sorted, 0.99)? / percentile(&sorted, 0.5)?)
}

/// Statistics of all flights together; stutters are looked for within each.
fn pooled(logs: &[FlightLog]) -> FrameStatistics {
    let flights = round_times(logs, 1);
    let frames = flights.iter().map(Vec::len).sum::<usize>() as f64;
    let stutters =
        flights.iter().filter_map(|f| Some(FrameStatistics::of(f).stutter_share? * f.len() as f64));
    let share = stutters.sum::<f64>() / frames;
    let all = FrameStatistics::of(&flights.concat());
    FrameStatistics { stutter_share: all.stutter_share.map(|_| share), ..all }
}

/// What a setting's flights came to.
fn row(
    setting: &Setting,
    logs: &[FlightLog],
    error: Option<tessclip::measure::error::ErrorReport>,
) -> MethodRow {
    let frames = || logs.iter().flat_map(|log| &log.frames);
    let of = |f: fn(&super::flights::Frame) -> f64| frames().map(f).collect::<Vec<_>>();
    MethodRow {
        method: setting.method.name(),
        detail: setting.params(),
        frames: frames().count(),
        every: logs.iter().map(|log| log.every).max().unwrap_or(1),
        frame_ms: pooled(logs),
        cpu_ms: Quantiles::of(&of(|f| f.cpu_ms)),
        ratio: None,
        r99_ratio: None,
        rounds_ms: round_medians(logs, 1),
        upload: logs.first().map(|log| log.ledger).unwrap_or_default(),
        triangles_p50: median(&of(|f| f.triangles as f64)),
        draw_calls_p50: median(&of(|f| f.draw_calls as f64)),
        gpu_bytes: logs.iter().map(|log| log.gpu_bytes).max().unwrap_or(0),
        cpu_bytes: logs.iter().map(|log| log.cpu_bytes).max().unwrap_or(0),
        error,
    }
}

fn point(setting: &Setting, row: &MethodRow) -> FrontPoint {
    FrontPoint {
        detail: setting.params(),
        detail_words: setting.words(),
        p99_px: row.error.as_ref().and_then(|e| e.px.p99),
        median_ms: row.frame_ms.p50.unwrap_or(f64::NAN),
        p95_ms: row.frame_ms.p95,
        p99_ms: row.frame_ms.p99,
        triangles: row.triangles_p50,
        gpu_bytes: row.gpu_bytes,
        dominated: false,
        on_outer_front: false,
    }
}

/// Name of ours flown once more, in the raw samples.
const AGAIN: &str = "tessellated-again";

/// The raw samples: setting 0 of a method is the one asked for.
fn samples(path: &str, cases: &[Setting], again: usize, logs: &[Vec<FlightLog>]) -> Vec<SampleRow> {
    let mut rows = Vec::new();
    for (case, setting) in cases.iter().enumerate() {
        let before = |k: &usize| *k != again && cases[*k].method == setting.method;
        let number = if case == again { 0 } else { (0..case).filter(before).count() };
        let method = if case == again { AGAIN } else { setting.method.name() };
        for (round, log) in logs[case].iter().enumerate() {
            rows.extend(log.frames.iter().map(|f| SampleRow {
                path: path.into(),
                method,
                setting: number,
                round,
                frame: f.number as usize,
                frame_ms: f.frame_ms,
                cpu_ms: f.cpu_ms,
                control_bytes: f.control_bytes,
                height_bytes: f.height_bytes,
                vertex_bytes: f.vertex_bytes,
                index_bytes: f.index_bytes,
                triangles: Some(f.triangles),
                draw_calls: Some(f.draw_calls),
            }));
        }
    }
    rows
}
