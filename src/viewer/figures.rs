//! The figures that panels and scripts are shown: gathered from world, window and frames.

use std::time::{Duration, Instant};

use super::facts::Sent;
use super::host::Host;

/// The ground under the cursor is looked up so often at most: its ray takes many steps.
const CURSOR_EVERY: Duration = Duration::from_millis(100);

impl Host {
    /// What the panels and a script are told once, and again when another terrain is opened.
    pub(super) fn introduce(&mut self) {
        let shape = self.world.renderer().shape();
        self.footprints = tessclip::rivals::footprints(shape);
        self.facts.terrain = self.start.terrain_args.terrain.clone();
        self.facts.adapter = self.screen.gpu.describe();
        self.facts.levels = shape.levels();
        self.facts.patches_total = self.world.renderer().patch_slots();
        self.facts.degrees = self.world.terrain.poses_in_degrees();
        self.facts.vsync = self.screen.vsync().name();
        self.window.set_title(&format!("tessclip: {}", self.facts.terrain));
        log::info!("adapter: {}", self.facts.adapter);
    }

    /// What the panels show of this moment.
    pub(super) fn note(&mut self, size: [u32; 2]) {
        let now = Instant::now();
        if self.message_until.is_some_and(|until| now >= until) {
            self.message_until = None;
            self.facts.message = None;
        }
        let camera = self.camera();
        self.facts.frame_ms.clone_from(&self.pace.frame_ms);
        self.facts.pose = self.flyer.pose();
        self.facts.above_ground_m = self.world.above(camera.eye_m);
        self.facts.speed_m_s = self.flyer.speed_m_s(self.facts.above_ground_m);
        self.facts.hud_ms = self.pace.panels_ms().unwrap_or(0.0);
        self.facts.size_px = size;
        self.facts.heights_m = self.world.heights_m();
        self.facts.following = self.flyer.is_following();
        self.facts.counters = self.world.counters().copied();
        if self.cursor_at.is_none_or(|at| now.duration_since(at) >= CURSOR_EVERY) {
            self.cursor_at = Some(now);
            let pixel = self.mouse.pixel(size);
            self.facts.cursor =
                pixel.and_then(|p| self.world.under(&camera, p, size)).map(|(_, cursor)| cursor);
        }
    }

    /// After the frame: figures of this one and of those that came back. True when it must be drawn again.
    pub(super) fn gather(&mut self) -> anyhow::Result<bool> {
        let now = Instant::now();
        let upload = self.world.upload;
        let [ours, gpu_gems, classic] = {
            let sent = |method: &str| {
                self.footprints.iter().find(|f| f.method == method).map_or(0, |f| f.bytes_for(&upload))
            };
            [sent("tessellated"), sent("gpu-gems-2"), sent("classic")]
        };
        let amounts = [ours, classic, gpu_gems, upload.height_bytes + upload.surface_bytes];
        let mut told = [Sent::default(); 4];
        for ((told, rate), frame) in told.iter_mut().zip(&mut self.rates).zip(amounts) {
            *told = Sent { frame, per_s: rate.add(now, frame) };
        }
        [self.facts.ours, self.facts.classic, self.facts.gpu_gems, self.facts.heights] = told;
        self.facts.upload = upload;
        let stream = self.world.renderer().stream_counters();
        if let (Some(before), Some(after)) = (self.facts.stream, stream) {
            let tiles = after.tiles_read.saturating_sub(before.tiles_read);
            self.facts.tiles_per_s = self.rates[4].add(now, tiles);
        }
        self.facts.stream = stream;
        if let Some(times) = self.world.renderer().finished_pass_times() {
            self.facts.passes = times;
        }
        if self.screen.gpu.is_lost() {
            return Ok(true);
        }
        self.world.after()
    }
}
