//! Flies and gathers: every frame's figures. What lies outside the measured time stands after `done`.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::bail;
use indicatif::{ProgressBar, ProgressStyle};
use tessclip::gpu::{Counters, Gpu, Offscreen};
use tessclip::measure::{Environment, FrameTimes, OpenLoop, UploadLedger};
use tessclip::pyramid::StreamCounters;
use tessclip::report::{CrackReport, FrameRow, Report, SceneFacts, write_report};
use tessclip::{Renderer, Scene, Target, Terrain};

use super::super::paths::Course;
use super::super::picture::{draw_whole, warn_of_budget};
use super::{cracks, memory};

/// A flight to measure.
pub struct Flight<'a> {
    pub name: &'a str,
    pub terrain: &'a Terrain,
    pub scene: Scene,
    pub size: [u32; 2],
    pub fov_deg: f64,
    pub course: Course,
    /// Streamed terrain: start with a complete first view rather than a cold cache.
    pub wait: bool,
    /// Frames to look at for cracks.
    pub cracks: u32,
    /// For tests: the device is destroyed before this frame.
    pub lose_device_at: Option<u32>,
}

/// Frames drawn before the first measured one, to compile pipelines and touch memory.
const WARM_UP: u32 = 3;
/// Longest wait for the samples of the first view.
const LONGEST_WAIT: Duration = Duration::from_secs(120);
/// Most frames until a view is drawn whose samples are there: they are sent, and levels grow in, bit by bit.
const MOST_ARRIVING: u32 = 1_000;
/// Open loop: frames between two readings of the counters, which wait for the GPU.
const COUNTERS_EVERY: u32 = 16;
/// Sleeps end late by about this much; the rest is waited out awake.
const SLEEP_SLACK: Duration = Duration::from_millis(1);

/// What a flight gathers.
pub(super) struct Log {
    pub rows: Vec<FrameRow>,
    pub ledger: UploadLedger,
    /// Milliseconds of each pass.
    pub passes: BTreeMap<String, Vec<f64>>,
    pub control_points: u64,
    pub dropped_patches: u64,
    /// Counters of the stream before the first measured frame; none where nothing is streamed.
    pub stream_before: Option<StreamCounters>,
    pub need_to_drawn_ms: Vec<f64>,
    pub cracks: Option<CrackReport>,
    pub teleports: Teleports,
    pub open_loop: Option<OpenLoop>,
    pub rss_bytes_start: Option<u64>,
    pub devices_lost: u64,
    /// Frames since the counters were read.
    unread: u32,
    /// When frame 0 is due.
    epoch: Instant,
}

/// How long new places take to be complete.
#[derive(Default)]
pub(super) struct Teleports {
    since: Option<Instant>,
    pub waits_ms: Vec<f64>,
    pub unfinished: u64,
}

impl Teleports {
    fn leave(&mut self, now: Instant) {
        self.unfinished += u64::from(self.since.replace(now).is_some());
    }

    fn drawn(&mut self, levels_missing: u32, done: Instant) {
        if levels_missing == 0
            && let Some(since) = self.since.take()
        {
            self.waits_ms.push(ms(done.duration_since(since)));
        }
    }

    fn end(&mut self) {
        self.unfinished += u64::from(self.since.take().is_some());
    }
}

impl Flight<'_> {
    /// Flies and writes the report; the files are opened before the first frame.
    pub fn fly(&self, gpu: &Gpu, dir: &Path, quiet: bool) -> anyhow::Result<Report> {
        let mut gpu = gpu.clone();
        let (mut target, mut renderer) = self.equip(&gpu)?;
        let mut report = self.empty_report(&gpu, &renderer);
        write_report(dir, &report)?;
        let frames = self.course.tempo.frames;
        let bar = progress(u64::from(frames), quiet);
        let mut log = self.begin(&gpu, &mut renderer, &target)?;
        for frame in 0..frames {
            if self.lose_device_at == Some(frame) {
                gpu.device.destroy();
            }
            let drawn = self.frame(&gpu, &mut renderer, &target, frame, &mut log);
            if let Err(error) = drawn {
                if !gpu.is_lost() {
                    return Err(error);
                }
                log::warn!("frame {frame}: {error:#}; going on with a new device");
                gpu = Gpu::new()?;
                (target, renderer) = self.equip(&gpu)?;
                log.devices_lost += 1;
                self.frame(&gpu, &mut renderer, &target, frame, &mut log)?;
            }
            bar.inc(1);
        }
        log.teleports.end();
        bar.finish_and_clear();
        let shape = renderer.shape();
        log.ledger.vertices_if_full = Some(u64::from(shape.n()).pow(2) * u64::from(shape.levels()));
        report.runs = vec![self.summarise(&renderer, &log)];
        report.rows = log.rows;
        write_report(dir, &report)?;
        Ok(report)
    }

    /// Target and renderer on a device.
    fn equip(&self, gpu: &Gpu) -> anyhow::Result<(Offscreen, Renderer)> {
        let target = Offscreen::new(&gpu.device, self.size)?;
        let mut renderer =
            Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, self.terrain, &self.scene)?;
        renderer.time_passes();
        Ok((target, renderer))
    }

    /// Warms up, and leaves a streamed terrain as it was asked for: complete around the start, or cold.
    fn begin(&self, gpu: &Gpu, renderer: &mut Renderer, target: &Offscreen) -> anyhow::Result<Log> {
        let (_, start) = self.course.at(0, self.fov_deg);
        let mut ledger = UploadLedger::default();
        let first = renderer.prepare(&start, self.size)?;
        let streamed = renderer.stream_counters().is_some();
        if streamed && self.wait && !renderer.wait_complete(&start, LONGEST_WAIT)? {
            bail!("the first view is not complete after {} s; leave --wait out", LONGEST_WAIT.as_secs());
        }
        let mut drawn = 0;
        while drawn < WARM_UP || (self.wait && !renderer.is_complete() && drawn < MOST_ARRIVING) {
            draw_whole(gpu, renderer, target, &start)?;
            renderer.finished_pass_times();
            drawn += 1;
        }
        if streamed && !self.wait {
            // What the warm-up loaded must not help: everything is sent again with the first measured frame.
            renderer.forget_stream();
        } else {
            ledger.add(&first);
        }
        drop(renderer.take_need_to_drawn_ms());
        Ok(Log {
            rows: Vec::with_capacity(self.course.tempo.frames as usize),
            ledger,
            passes: BTreeMap::new(),
            control_points: first.control_points,
            dropped_patches: 0,
            stream_before: renderer.stream_counters(),
            need_to_drawn_ms: Vec::new(),
            cracks: (self.cracks > 0).then(|| cracks::empty(self.terrain)),
            teleports: Teleports::default(),
            open_loop: self.course.tempo.hz.map(|hz| OpenLoop::new(f64::from(hz))),
            rss_bytes_start: memory::resident_bytes(),
            devices_lost: 0,
            unread: 0,
            epoch: Instant::now(),
        })
    }

    fn frame(
        &self,
        gpu: &Gpu,
        renderer: &mut Renderer,
        target: &Offscreen,
        frame: u32,
        log: &mut Log,
    ) -> anyhow::Result<()> {
        let frames = self.course.tempo.frames;
        let (t_s, camera) = self.course.at(frame, self.fov_deg);
        let jumped = self.course.jumped(frame);
        let due_s = log.open_loop.as_ref().map(|schedule| {
            wait_for(schedule, frame, log.epoch);
            schedule.due_s(frame)
        });
        let begin = Instant::now();
        let upload = renderer.prepare(&camera, self.size)?;
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        renderer.record(
            &mut encoder,
            Target { color: &target.color, depth: &target.depth, clear: true, area: None },
        );
        gpu.queue.submit([encoder.finish()]);
        let cpu_ms = ms(begin.elapsed());
        gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        let done = Instant::now();
        if gpu.is_lost() {
            bail!("the GPU device was lost");
        }
        if jumped {
            log.teleports.leave(begin);
        }
        log.teleports.drawn(upload.levels_missing, done);
        let since_start_s = |at: Instant| at.duration_since(log.epoch).as_secs_f64();
        let (start_s, done_s) = (since_start_s(begin), since_start_s(done));
        let lateness = match (&mut log.open_loop, due_s) {
            (Some(schedule), Some(due_s)) => Some(schedule.add(FrameTimes { due_s, start_s, done_s })),
            _ => None,
        };
        for (pass, ms) in renderer.finished_pass_times().unwrap_or_default() {
            log.passes.entry(pass).or_default().push(ms);
        }
        log.need_to_drawn_ms.extend(renderer.take_need_to_drawn_ms());
        let idle = log.is_idle(frame + 1);
        let counters = if log.reads_counters(idle, frame + 1 == frames) {
            Some(renderer.read_counters()?)
        } else {
            None
        };
        if let Some(report) = log.cracks.as_mut().filter(|_| cracks::is_checked(frame, frames, self.cracks)) {
            cracks::look(gpu, renderer, target, &camera, self.scene.cull, report)?;
        }
        if let Some(counters) = &counters {
            log.dropped_patches += u64::from(counters.patches_dropped);
            renderer.grow(counters)?;
            if frame + 1 == frames {
                warn_of_budget(renderer, counters);
            }
        }
        log.ledger.add(&upload);
        let counted = |of: fn(&Counters) -> u32| counters.as_ref().map(of);
        log.rows.push(FrameRow {
            frame: frame as usize,
            t_s,
            frame_ms: ms(done.duration_since(begin)),
            cpu_ms,
            control_bytes: upload.control_bytes,
            height_bytes: upload.height_bytes,
            height_bytes_bound: upload.height_bound_samples * upload.sample_bytes,
            shifts: upload.shifts,
            patches: counted(|c| c.expand_x),
            vertices: counted(|c| c.vertices_needed),
            triangles: counted(|c| c.index_count / 3),
            levels_missing: upload.levels_missing,
            cache_bytes: renderer.stream_counters().map(|c| c.resident_bytes),
            rss_bytes: if idle { memory::resident_bytes() } else { None },
            due_s,
            response_ms: lateness.map(|l| l.response_ms),
            late_ms: lateness.map(|l| l.late_ms),
        });
        Ok(())
    }

    fn empty_report(&self, gpu: &Gpu, renderer: &Renderer) -> Report {
        Report {
            schema: "tessclip-report/1",
            environment: Environment::gather(&gpu.info),
            scene: SceneFacts::of(self.name, self.terrain, self.size),
            plan: renderer.plan().clone(),
            runs: Vec::new(),
            checks: None,
            pictures: Vec::new(),
            comparison: None,
            comparison_section: None,
            rows: Vec::new(),
        }
    }
}

impl Log {
    /// Whether there is time for more than drawing before the frame `next`; in closed loop always.
    fn is_idle(&self, next: u32) -> bool {
        let now_s = self.epoch.elapsed().as_secs_f64();
        self.open_loop.as_ref().is_none_or(|schedule| schedule.has_time_before(next, now_s))
    }

    /// Whether the counters of this frame are read: of every frame in closed loop; in open loop, where that
    /// would delay the next one, when there is time, at most of every 16th, and of the last.
    fn reads_counters(&mut self, idle: bool, last: bool) -> bool {
        self.unread += 1;
        let reads = self.open_loop.is_none() || last || (idle && self.unread >= COUNTERS_EVERY);
        if reads {
            self.unread = 0;
        }
        reads
    }
}

/// Waits until a frame is due; not at all when it is late.
fn wait_for(schedule: &OpenLoop, frame: u32, epoch: Instant) {
    loop {
        let left = Duration::from_secs_f64(schedule.wait_s(frame, epoch.elapsed().as_secs_f64()));
        if left.is_zero() {
            return;
        }
        if left > SLEEP_SLACK {
            std::thread::sleep(left - SLEEP_SLACK);
        } else {
            std::thread::yield_now();
        }
    }
}

fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
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
