//! What keys and the panels ask for, done.

use std::time::Instant;

use serde_json::json;
use tessclip::rivals::Method;
use tessclip::{ColorMode, Factors, Scene};
use winit::window::Fullscreen;

use super::facts::Facts;
use super::flyer::{Flyer, Ground};
use super::host::{Host, Playing};
use super::hud::Reply;
use super::keys::Action;
use super::look::Look;
use super::recorder::{Recorder, write_new};
use super::replay::Replay;
use super::status::print;
use super::world::World;
use crate::cli::factor_args::N_BY_ERROR;
use crate::cli::line::render_line;
use crate::cli::scene_writer::scene_toml;
use crate::cli::view::reopen;

impl Host {
    /// Does what a key asks for.
    pub(super) fn act(&mut self, action: Action) {
        let scene = &mut self.look.scene;
        match action {
            Action::Help => {
                self.shown = true;
                self.hud.toggle_help();
            }
            Action::Hud => self.shown = !self.shown,
            Action::GoTo => {
                self.shown = true;
                self.free_mouse();
                self.hud.ask_for_place();
            }
            Action::PrintLine => self.print_line(),
            Action::SaveScene => self.save_scene(),
            Action::NextVsync => {
                self.screen.next_vsync();
                self.facts.vsync = self.screen.vsync().name();
                self.tell("vsync", json!({ "vsync": self.facts.vsync }));
            }
            Action::FullScreen => {
                let full = self.window.fullscreen().is_none();
                self.window.set_fullscreen(full.then_some(Fullscreen::Borderless(None)));
            }
            Action::Screenshot { hud } => self.shot = Some(hud && self.shown),
            Action::Color(color) => scene.color = color,
            Action::Wireframe => scene.wireframe = !scene.wireframe,
            Action::Bounds => scene.bounds = !scene.bounds,
            Action::Fog => scene.fog = !scene.fog,
            Action::Morph => scene.morph = !scene.morph,
            Action::Factors => toggle_factors(scene, &self.start.look.scene),
            Action::Freeze => {
                self.look.frozen = if self.look.frozen.is_some() { None } else { Some(self.flyer.pose()) };
            }
            Action::Beside => {
                let usual = self.usual_rival();
                self.look.beside = if self.look.beside.is_some() { None } else { Some(usual) };
            }
            Action::NextRival => {
                let next = self.next_rival();
                self.tried = Some(next);
                self.look.beside = Some(next);
            }
            Action::Exaggerate(factor) => {
                let now = self.look.exaggeration;
                let next = now.abs() * factor;
                // Back at 1 exactly, whatever rounding says.
                let next = if (next - 1.0).abs() < 1e-6 { 1.0 } else { next };
                self.look.exaggeration = stepped(now.abs(), next, Look::EXAGGERATION).copysign(now);
            }
            Action::Sun([azimuth, altitude]) => {
                let [a, h] = scene.sun_deg;
                scene.sun_deg = [(a + azimuth).rem_euclid(360.0), (h + altitude).clamp(-90.0, 90.0)];
            }
            Action::Fov(more) => {
                let now = self.look.fov_deg;
                self.look.fov_deg = stepped(now, now + more, Look::FOV_DEG);
            }
            Action::Speed(factor) => self.flyer.scale_speed(factor),
            Action::Follow => {
                let on = !self.flyer.is_following();
                self.flyer.set_following(on, self.world.above(self.camera().eye_m));
                self.tell("follow", json!({ "on": on }));
            }
            Action::Record => self.toggle_recording(),
            Action::Replay => self.toggle_replay(),
            Action::Home => {
                let home = self.world.terrain.pose(&self.world.terrain.overview(self.look.fov_deg));
                self.flyer.reset_speed();
                self.fly(home);
            }
            Action::Quit => self.quits = true,
        }
        self.pace.input();
        self.panels.stir();
        self.window.request_redraw();
    }

    /// Does what the panels ask for.
    pub(super) fn answer(&mut self, reply: Reply) {
        match reply {
            Reply::Do(action) => self.act(action),
            Reply::Beside(method) => self.look.beside = method,
            Reply::GoTo { place, height_m } => {
                let world = &self.world;
                if let Some(wrong) = world.terrain.curved.as_ref().and_then(|c| c.bad_place(place)) {
                    self.say(wrong);
                    return;
                }
                let above = |p| world.above(p);
                let goal = self.flyer.go_to_goal(&world.terrain, place, height_m, &Ground { above: &above });
                self.fly(goal);
            }
        }
    }

    fn fly(&mut self, goal: [f64; 5]) {
        self.stop_playing("stopped");
        self.flyer.fly_to(&self.world.terrain, goal);
        self.pace.stir();
    }

    /// Flies to the ground under the cursor.
    pub(super) fn fly_to_cursor(&mut self) {
        let (camera, size) = (self.camera(), self.screen.size());
        let pixel = self.mouse.pixel(size);
        let Some((point, _)) = pixel.and_then(|p| self.world.under(&camera, p, size)) else { return };
        let world = &self.world;
        let above = |p| world.above(p);
        let goal = self.flyer.double_click_goal(&world.terrain, &camera, point, &Ground { above: &above });
        self.fly(goal);
    }

    fn usual_rival(&self) -> Method {
        self.start.look.beside.unwrap_or(Method::Geomipmap)
    }

    fn next_rival(&self) -> Method {
        // From the one that was tried, also where it could not be drawn: all have their turn.
        let now = self.tried.or(self.look.beside);
        let at = now.and_then(|m| Method::ALL.iter().position(|all| *all == m));
        at.map_or(self.usual_rival(), |at| Method::ALL[(at + 1) % Method::ALL.len()])
    }

    /// The line of `render` for what is on the screen.
    pub(super) fn line(&self, output: &str) -> String {
        let (terrain, size) = (&self.start.terrain_args, self.screen.size());
        let line = render_line(terrain, &self.world.look, self.flyer.pose(), size, output);
        if self.world.look.scene.color != ColorMode::Refill {
            return line;
        }
        // What a frame refills depends on the one before.
        format!("{line} --from={}", crate::cli::args::pose_words(self.before))
    }

    fn print_line(&mut self) {
        let line = self.line("view.png");
        if self.status.is_on() {
            self.tell("line", json!({ "line": line }));
        } else if let Err(error) = print(&line) {
            self.sorry(&anyhow::Error::new(error).context("the render line cannot be printed"));
            return;
        }
        self.say("the render line was printed".into());
    }

    fn save_scene(&mut self) {
        let (pose, size) = (self.flyer.pose(), self.screen.size());
        let saved = scene_toml(&self.start.terrain_args, &self.world.look, pose, size).and_then(|text| {
            let write = |path: &std::path::Path| crate::cli::args::write_whole(path, text.as_bytes());
            write_new(&self.start.out, "tessclip-scene", "toml", write)
        });
        match saved {
            Ok(path) => {
                self.tell("saved", json!({ "path": path }));
                self.say(format!("saved {}", path.display()));
            }
            Err(error) => self.sorry(&error),
        }
    }

    fn toggle_recording(&mut self) {
        if self.recorder.is_some() {
            self.stop_recording();
            return;
        }
        let begun = Recorder::begin(&self.start.out).and_then(|mut recorder| {
            recorder.add(0.0, self.flyer.pose())?;
            Ok(recorder)
        });
        match begun {
            Ok(recorder) => {
                self.tell("recording", json!({ "path": recorder.path() }));
                self.recorder = Some((recorder, Instant::now()));
            }
            Err(error) => self.sorry(&error),
        }
    }

    /// Ends the recording, where there is one, and writes it.
    pub(super) fn stop_recording(&mut self) {
        let Some((mut recorder, since)) = self.recorder.take() else { return };
        self.facts.recording_s = None;
        let path = recorder.path().to_path_buf();
        let last = recorder.add(since.elapsed().as_secs_f64(), self.flyer.pose());
        match last.and_then(|()| recorder.finish()) {
            Ok(keys) => {
                self.tell("recorded", json!({ "path": path, "keys": keys }));
                self.say(format!("recorded {} ({keys} lines); P replays it", path.display()));
                self.path = Some(path.to_string_lossy().into_owned());
            }
            Err(error) => self.sorry(&error),
        }
    }

    fn toggle_replay(&mut self) {
        if self.playing.is_some() {
            self.stop_playing("stopped");
            return;
        }
        // What is being recorded is replayed.
        self.stop_recording();
        let Some(path) = self.path.clone() else {
            self.say("nothing to replay: R records a path, --path names one".into());
            return;
        };
        if let Err(error) = self.play(&path) {
            self.sorry(&error);
        }
    }

    /// Begins to replay a path.
    pub(super) fn play(&mut self, path: &str) -> anyhow::Result<()> {
        let replay = Replay::open(path, &self.world.terrain)?;
        self.tell("replaying", json!({ "path": path, "seconds": replay.seconds() }));
        self.playing = Some(Playing { replay, since: Instant::now() });
        self.pace.stir();
        Ok(())
    }

    /// Ends a replay, where there is one; the camera stays where it led.
    pub(super) fn stop_playing(&mut self, how: &str) {
        if self.playing.take().is_some() {
            self.facts.replay_s = None;
            self.tell("replayed", json!({ "how": how }));
        }
    }

    /// Opens another terrain or scene, dropped on the window; the old one stays where that fails.
    pub(super) fn open_other(&mut self, terrain: &str) {
        if let Err(error) = self.try_open(terrain) {
            self.sorry(&error);
        }
    }

    fn try_open(&mut self, terrain: &str) -> anyhow::Result<()> {
        let opened = reopen(terrain, &self.start.terrain_args)?;
        // A look that was made for the old terrain need not suit this one: what asks most of a terrain is left out.
        let usual = &self.look.scene;
        let color = if usual.color == ColorMode::Error { ColorMode::Shaded } else { usual.color };
        let n = self.usual_n.unwrap_or(if usual.factors.by_error() { Scene::default().n } else { usual.n });
        let look = opened.look.unwrap_or_else(|| Look {
            scene: Scene { levels: None, n, color, factors: Factors::Uniform, ..usual.clone() },
            exaggeration: 1.0,
            frozen: None,
            beside: None,
            ..self.look.clone()
        });
        let (gpu, format) = (&self.screen.gpu, self.screen.format);
        let world = World::new(gpu, format, &opened.terrain, &look)?;
        let camera = match opened.pose {
            Some(pose) => world.terrain.camera(pose, look.fov_deg),
            None => world.terrain.overview(look.fov_deg),
        };
        camera.validate()?;
        self.stop_playing("stopped");
        self.stop_recording();
        self.path = None;
        self.flyer = Flyer::new(&world.terrain, &camera);
        if let Some(pose) = opened.pose {
            self.flyer.set_pose(pose);
        }
        self.look = world.look.clone();
        self.start.look = world.look.clone();
        self.world = world;
        self.tried = None;
        self.usual_n = None;
        self.start.terrain = opened.terrain;
        self.start.terrain_args = opened.terrain_args;
        self.facts = Facts::default();
        self.introduce();
        self.tell("opened", json!({ "terrain": self.facts.terrain }));
        self.say(format!("opened {}", self.facts.terrain));
        Ok(())
    }
}

/// A step from `now` to `next` that leads no further out of the limits; who is outside comes back step by step.
fn stepped(now: f64, next: f64, [least, most]: [f64; 2]) -> f64 {
    next.clamp(least.min(now), most.max(now))
}

/// Factors by error, or uniform; windows grow with them where they are too small.
fn toggle_factors(scene: &mut Scene, usual: &Scene) {
    if scene.factors.by_error() {
        scene.factors = Factors::Uniform;
        scene.n = if usual.factors.by_error() { Scene::default().n } else { usual.n };
    } else {
        scene.factors = match usual.factors {
            Factors::Uniform => Factors::ByError { pixel_error: Some(1.0), budget: None },
            given => given,
        };
        scene.n = scene.n.max(N_BY_ERROR);
    }
}

#[cfg(test)]
mod tests {
    use super::stepped;

    #[test]
    fn steps_stay_within_limits_or_lead_back() {
        let limits = [0.1, 20.0];
        assert_eq!(stepped(19.0, 25.0, limits), 20.0);
        assert_eq!(stepped(0.11, 0.09, limits), 0.1);
        assert_eq!(stepped(50.0, 40.0, limits), 40.0);
        assert_eq!(stepped(50.0, 60.0, limits), 50.0);
        assert_eq!(stepped(0.01, 0.008, limits), 0.01);
    }
}
