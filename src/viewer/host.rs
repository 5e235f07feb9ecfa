//! The open window: one frame after another while anything moves, none while nothing does.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use glam::DVec3;
use serde_json::json;
use tessclip::rivals::Footprint;
use tessclip::{Camera, ColorMode};
use winit::dpi::PhysicalSize;
use winit::event_loop::ActiveEventLoop;
use winit::window::{Window, WindowAttributes};

use super::Start;
use super::facts::Facts;
use super::flyer::{Flyer, Ground, Held};
use super::hud::Hud;
use super::input::Mouse;
use super::look::Look;
use super::pace::{Pace, Rate};
use super::panels::Panels;
use super::recorder::Recorder;
use super::replay::Replay;
use super::screen::{Acquired, Screen};
use super::status::Status;
use super::world::World;
use crate::cli::factor_args::LEAST_N_BY_ERROR;

/// How long a message stands.
const MESSAGE_FOR: Duration = Duration::from_secs(6);
/// Between two cameras of a recording that are told apart by nothing else, seconds.
const INSTANT_S: f64 = 1e-3;
/// While a camera is recorded that stands, its clock is shown so often.
const CLOCK_EVERY: Duration = Duration::from_millis(500);
/// How often samples on their way are looked for while nothing else moves.
const STREAM_EVERY: Duration = Duration::from_millis(16);

/// Samples a side of a window of whole blocks on glued charts, at least.
const LEAST_N_GLUED: u32 = 511;

/// A path being replayed.
pub(super) struct Playing {
    pub replay: Replay,
    pub since: Instant,
}

/// All that belongs to the window.
pub struct Host {
    pub window: Arc<Window>,
    /// Asked to end.
    pub quits: bool,
    pub(super) start: Start,
    pub(super) screen: Screen,
    pub(super) panels: Panels,
    pub(super) hud: Hud,
    pub(super) world: World,
    /// The look asked for; `world.look` is the one that is drawn.
    pub(super) look: Look,
    pub(super) flyer: Flyer,
    pub(super) held: Held,
    pub(super) mouse: Mouse,
    pub(super) pace: Pace,
    pub(super) facts: Facts,
    pub(super) status: Status,
    pub(super) recorder: Option<(Recorder, Instant)>,
    pub(super) playing: Option<Playing>,
    /// What P replays.
    pub(super) path: Option<String>,
    pub(super) shown: bool,
    /// Alt or the like is held: keys are the window system's.
    pub(super) elsewhere: bool,
    /// The window system says that nothing of the window can be seen.
    pub(super) hidden: bool,
    pub(super) shot: Option<bool>,
    /// Pose of the frame before.
    pub(super) before: [f64; 5],
    /// The rival that N came to last.
    pub(super) tried: Option<tessclip::rivals::Method>,
    /// Samples a side of a window before the colouring of errors needed more.
    pub(super) usual_n: Option<u32>,
    pub(super) message_until: Option<Instant>,
    pub(super) rates: [Rate; 5],
    pub(super) footprints: [Footprint; 3],
    pub(super) cursor_at: Option<Instant>,
    redraw_at: Option<Instant>,
    moving: bool,
    /// CPU milliseconds of the panels in this frame.
    panels_cpu_ms: f64,
}

impl Host {
    /// Opens the window on what is to be seen.
    pub fn open(events: &ActiveEventLoop, start: Start) -> anyhow::Result<Self> {
        let [width, height] = start.size;
        let attributes = WindowAttributes::default()
            .with_title(format!("tessclip: {}", start.terrain_args.terrain))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = Arc::new(events.create_window(attributes).context("the window cannot be opened")?);
        let screen = Screen::open(&window, events.owned_display_handle(), start.vsync)?;
        let panels = Panels::new(&window, &screen.gpu.device, screen.plain, screen.copies);
        let mut world = World::new(&screen.gpu, screen.format, &start.terrain, &start.look)?;
        let look = world.look.clone();
        let camera = match start.pose {
            Some(pose) => world.terrain.camera(pose, look.fov_deg),
            None => world.terrain.overview(look.fov_deg),
        };
        camera.validate()?;
        let mut flyer = Flyer::new(&world.terrain, &camera);
        if let Some(pose) = start.pose {
            flyer.set_pose(pose);
        }
        let mut host = Self {
            window,
            quits: false,
            screen,
            panels,
            hud: Hud::default(),
            look,
            flyer,
            held: Held::default(),
            mouse: Mouse::default(),
            pace: Pace::new(),
            facts: Facts::default(),
            status: Status::new(start.state),
            recorder: None,
            playing: None,
            path: start.path.clone(),
            shown: !start.no_hud,
            elsewhere: false,
            hidden: false,
            shot: None,
            before: [0.0; 5],
            tried: None,
            usual_n: None,
            message_until: None,
            rates: Default::default(),
            footprints: tessclip::rivals::footprints(world.renderer().shape()),
            cursor_at: None,
            redraw_at: None,
            moving: true,
            panels_cpu_ms: 0.0,
            world,
            start,
        };
        host.before = host.flyer.pose();
        host.introduce();
        if let Some(path) = host.path.clone() {
            host.play(&path)?;
        }
        host.window.request_redraw();
        Ok(host)
    }

    /// The camera that looks.
    pub(super) fn camera(&self) -> Camera {
        self.flyer.camera(&self.world.terrain, self.look.fov_deg)
    }

    /// Says something for a while.
    pub(super) fn say(&mut self, message: String) {
        log::info!("{message}");
        self.facts.message = Some(message);
        self.panels.stir();
        self.message_until = Some(Instant::now() + MESSAGE_FOR);
        self.pace.stir();
        self.window.request_redraw();
    }

    /// Says that something was not done, and goes on.
    pub(super) fn sorry(&mut self, error: &anyhow::Error) {
        let line = format!("{error:#}").split_whitespace().collect::<Vec<_>>().join(" ");
        self.status.tell("problem", json!({ "message": line }));
        self.say(line);
    }

    /// When the next frame is due, where none was asked for yet.
    pub fn redraw_at(&self) -> Option<Instant> {
        self.redraw_at
    }

    /// Asks for the frame that is due.
    pub fn redraw(&mut self) {
        self.redraw_at = None;
        self.window.request_redraw();
    }

    /// One frame.
    pub fn frame(&mut self) -> anyhow::Result<()> {
        self.redraw_at = None;
        if self.hidden {
            return Ok(());
        }
        if self.screen.gpu.is_lost() {
            self.recover()?;
        }
        if self.start.lose_device_at.is_some_and(|at| u64::from(at) == self.pace.frames) {
            self.start.lose_device_at = None;
            self.screen.gpu.device.destroy();
        }
        if self.pace.wait(&self.screen.gpu.device).is_err() || self.screen.gpu.is_lost() {
            self.recover()?;
        }
        let texture = match self.screen.acquire()? {
            Acquired::Frame(texture) => texture,
            Acquired::Skip { again } => {
                if again {
                    self.redraw_at = Some(Instant::now() + STREAM_EVERY);
                }
                return Ok(());
            }
        };
        self.facts.beside_triangles = self.world.beside_triangles();
        let begin = Instant::now();
        let dt_s = self.pace.begin();
        let moves = self.move_camera(dt_s);
        if !moves && self.pace.is_last() {
            // What panels show while nothing moves is how it came to rest.
            self.hud.renew();
            self.panels.stir();
        }
        let size = self.screen.size();
        let repaint_in = self.lay_out(size);
        self.take_look();
        let camera = self.camera();
        if let Err(error) = self.world.prepare(&camera, size) {
            self.sorry(&error);
            // Whatever led there, the overview of ours alone can be drawn.
            self.look = Look { beside: None, frozen: None, ..self.look.clone() };
            self.take_look();
            self.flyer = Flyer::new(&self.world.terrain, &self.world.terrain.overview(self.look.fov_deg));
            self.world.prepare(&self.camera(), size)?;
        }
        let submission = self.draw(&texture.texture, size, begin)?;
        self.screen.present(texture);
        self.panels.finish(&self.screen.gpu.queue);
        let again = self.gather()?;
        let streaming = !self.world.renderer().is_complete();
        let counts_down = self.start.frames.is_some();
        let at_once = moves || again || self.shot.is_some() || repaint_in.is_zero() || counts_down;
        let more = self.pace.end(submission, at_once || streaming) || counts_down;
        self.rest(moves, more, repaint_in);
        if streaming && !at_once {
            // Samples on their way are looked for, not raced for with those who load them.
            self.redraw_at = Some(Instant::now() + STREAM_EVERY);
        }
        self.before = self.flyer.pose();
        Ok(())
    }

    /// Asks for the next frame, or tells that there is none to come.
    fn rest(&mut self, moves: bool, more: bool, repaint_in: Duration) {
        if self.pace.frames == 1 {
            let size = self.screen.size();
            let scale = self.window.scale_factor();
            self.tell("ready", json!({ "adapter": self.facts.adapter, "size": size, "scale": scale }));
        }
        if self.moving && !moves {
            self.tell("rest", json!({}));
        }
        self.moving = moves;
        if self.start.frames.is_some_and(|most| self.pace.frames >= u64::from(most)) {
            self.quits = true;
        }
        let soon = |d: Duration| Instant::now().checked_add(d);
        if more {
            if self.world.renderer().is_complete() || moves || self.start.frames.is_some() {
                self.window.request_redraw();
            }
        } else {
            self.redraw_at = if repaint_in < Duration::from_secs(3600) { soon(repaint_in) } else { None };
            if self.recorder.is_some() {
                self.redraw_at = self.redraw_at.min(soon(CLOCK_EVERY)).or(soon(CLOCK_EVERY));
            }
            if let Some(until) = self.message_until {
                self.redraw_at = Some(self.redraw_at.map_or(until, |at| at.min(until)));
            }
            let input_ms = self.pace.input_ms;
            self.tell("idle", json!({ "input_ms": input_ms[0], "input_ms_max": input_ms[1] }));
            self.pace.input_ms[1] = 0.0;
        }
    }

    /// An event with what a script wants to know besides.
    pub(super) fn tell(&self, event: &str, more: serde_json::Value) {
        let counters = self.world.counters();
        let mut all = json!({
            "frames": self.pace.frames,
            "pose": self.flyer.pose(),
            "above_m": self.facts.above_ground_m,
            "color": crate::cli::line::color_name(self.look.scene.color),
            "triangles": counters.map(|c| c.index_count / 3),
        });
        if let (Some(all), serde_json::Value::Object(more)) = (all.as_object_mut(), more) {
            all.extend(more);
        }
        self.status.tell(event, all);
    }

    /// Input, replay, flight: where the camera is now. True while it moves.
    fn move_camera(&mut self, dt_s: f64) -> bool {
        if let Some(playing) = &self.playing {
            let t_s = playing.since.elapsed().as_secs_f64();
            let seconds = playing.replay.seconds();
            match playing.replay.at(t_s, self.look.fov_deg) {
                Some(camera) => {
                    self.flyer.set_pose(self.world.terrain.pose(&camera));
                    self.facts.replay_s = Some([t_s, seconds]);
                }
                None => {
                    if let Some(camera) = playing.replay.at(seconds, self.look.fov_deg) {
                        self.flyer.set_pose(self.world.terrain.pose(&camera));
                    }
                    self.stop_playing("ended");
                }
            }
            self.record(dt_s);
            return true;
        }
        let world = &self.world;
        let above = |p: DVec3| world.above(p);
        let moves = self.flyer.step(dt_s, &self.held, &world.terrain, &Ground { above: &above });
        self.record(dt_s);
        moves
    }

    /// Adds the camera to the recording.
    fn record(&mut self, dt_s: f64) {
        let Some((recorder, since)) = &mut self.recorder else { return };
        let t_s = since.elapsed().as_secs_f64();
        self.facts.recording_s = Some(t_s);
        // After a rest nothing moved until just now.
        let stood = if dt_s == 0.0 { recorder.stood_until(t_s - INSTANT_S) } else { Ok(()) };
        if let Err(error) = stood.and_then(|()| recorder.add(t_s, self.flyer.pose())) {
            self.recorder = None;
            self.facts.recording_s = None;
            self.sorry(&error);
        }
    }

    /// Lays out the panels over what is known; returns when they want to be drawn again.
    fn lay_out(&mut self, size: [u32; 2]) -> Duration {
        self.note(size);
        let begin = Instant::now();
        let (now_s, shown) = (self.pace.now_s(), self.shown);
        let (hud, facts, look) = (&mut self.hud, &self.facts, &mut self.look);
        let mut replies = Vec::new();
        let repaint_in = self.panels.run(&self.window, size, |ui| {
            if shown {
                replies.extend(hud.draw(ui, facts, look, now_s));
            }
        });
        self.panels_cpu_ms = begin.elapsed().as_secs_f64() * 1e3;
        for reply in replies {
            self.answer(reply);
        }
        repaint_in
    }

    /// What no terrain of this kind can be drawn with is put right. Errors are coloured by whole blocks, which small
    /// windows do not hold: they grow for it, and shrink again. Positions have no heights to exaggerate.
    fn fit_look(&mut self) {
        if self.world.terrain.curved.as_ref().is_some_and(|c| c.points.is_some()) {
            self.look.exaggeration = 1.0;
        }
        let scene = &mut self.look.scene;
        let least = if self.world.terrain.graph().is_glued() { LEAST_N_GLUED } else { LEAST_N_BY_ERROR };
        if scene.color == ColorMode::Error && scene.n < least {
            self.usual_n = Some(std::mem::replace(&mut scene.n, least));
        } else if scene.color != ColorMode::Error
            && let Some(n) = self.usual_n.take()
            && scene.n == least
            && !scene.factors.by_error()
        {
            scene.n = n;
        }
    }

    /// Draws with the look that was asked for, or says why not and takes the old one back.
    pub(super) fn take_look(&mut self) {
        if self.look == self.world.look {
            return;
        }
        self.fit_look();
        let (gpu, format) = (self.screen.gpu.clone(), self.screen.format);
        if let Err(error) = self.world.take(&gpu, format, &self.look) {
            self.sorry(&error);
        }
        self.look = self.world.look.clone();
        let shape = self.world.renderer().shape();
        self.facts.levels = shape.levels();
        self.facts.patches_total = self.world.renderer().patch_slots();
        self.footprints = tessclip::rivals::footprints(shape);
        self.pace.stir();
        let look = json!({
            "frozen": self.look.frozen.is_some(),
            "beside": self.look.beside.map(tessclip::rivals::Method::name),
            "wireframe": self.look.scene.wireframe,
            "bounds": self.look.scene.bounds,
            "exaggeration": self.look.exaggeration,
            "fov": self.look.fov_deg,
            "sun": self.look.scene.sun_deg,
        });
        self.tell("look", look);
        self.panels.stir();
    }

    /// Records and submits the prepared frame, and the screenshot that was asked for.
    fn draw(
        &mut self,
        texture: &wgpu::Texture,
        size: [u32; 2],
        begin: Instant,
    ) -> anyhow::Result<wgpu::SubmissionIndex> {
        let gpu = self.screen.gpu.clone();
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        if let Some(depth) = self.screen.depth() {
            self.world.record(&mut encoder, [&view, depth], size);
        }
        if self.shown {
            let begin = Instant::now();
            self.panels.upload(&gpu.device, &gpu.queue, &mut encoder);
            let plain = wgpu::TextureViewDescriptor { format: Some(self.screen.plain), ..Default::default() };
            self.panels.put(&mut encoder, texture, &texture.create_view(&plain));
            self.panels_cpu_ms += begin.elapsed().as_secs_f64() * 1e3;
            self.pace.panels(self.panels_cpu_ms + self.panels.gpu_ms);
        }
        let commands = encoder.finish();
        // Software drivers draw within what follows.
        self.facts.cpu_ms = begin.elapsed().as_secs_f64() * 1e3;
        let submission = gpu.queue.submit([commands]);
        if let Some(with_panels) = self.shot.take()
            && let Err(error) = self.shoot(with_panels, size)
        {
            self.sorry(&error);
        }
        Ok(submission)
    }

    /// Another device after this one was lost; terrain, look and camera stay.
    fn recover(&mut self) -> anyhow::Result<()> {
        log::warn!("the GPU device was lost; going on with a new one");
        self.screen.reopen().context("the GPU device was lost")?;
        let format = self.screen.format;
        self.panels =
            Panels::new(&self.window, &self.screen.gpu.device, self.screen.plain, self.screen.copies);
        self.world = World::new(&self.screen.gpu, format, &self.start.terrain, &self.look)?;
        self.pace.forget_submission();
        self.introduce();
        self.tell("device-lost", json!({}));
        self.say("the GPU device was lost; this is a new one".into());
        Ok(())
    }

    /// The last words.
    pub fn end(mut self) {
        self.stop_recording();
        let times = [0.5, 0.99].map(|p| self.facts.frame_percentile(p));
        let means = [self.pace.mean_ms(), self.pace.panels_ms()];
        self.tell(
            "quit",
            json!({
                "frame_ms_p50": times[0], "frame_ms_p99": times[1], "frame_ms": means[0], "panels_ms": means[1],
            }),
        );
    }
}
