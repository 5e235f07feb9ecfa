//! The panels as a user meets them: drawn without a window, clicked and typed at.

mod input;
mod layout;

use egui::epaint::ClippedShape;
use egui::{
    Context, Event, Key, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, Vec2, ViewportId, vec2,
};
use tessclip::Scene;
use tessclip::gpu::Counters;
use tessclip::measure::FrameUpload;
use tessclip::pyramid::StreamCounters;

use super::{Hud, Reply, panel, style};
use crate::viewer::facts::{Facts, KEPT_FRAMES, Sent, UnderCursor};
use crate::viewer::look::Look;

/// A look as the program starts with it.
pub fn look() -> Look {
    Look { scene: Scene::default(), exaggeration: 1.0, fov_deg: 60.0, frozen: None, beside: None }
}

/// Facts of a long flight over a streamed terrain: every panel has as much to say as it may get.
pub fn full_facts() -> Facts {
    let counters = Counters {
        index_count: 3 * 411_522,
        patches_visible: 1_200,
        patches_dropped: 2,
        ..bytemuck::Zeroable::zeroed()
    };
    let sent = |frame, per_s| Sent { frame, per_s };
    Facts {
        terrain: "/data/stores/alps-one-third-arc-second.zarr".into(),
        frame_ms: (0..KEPT_FRAMES).map(|ix| if ix % 60 == 59 { 45.0 } else { 16.7 }).collect(),
        cpu_ms: 3.21,
        hud_ms: 0.87,
        heights_m: Some([-12.0, 3450.0]),
        passes: (0..9).map(|ix| (format!("pass with a long name {ix}"), 0.37 * f64::from(ix))).collect(),
        counters: Some(counters),
        patches_total: 5_120,
        upload: FrameUpload { levels_drawn: 11, levels_missing: 1, ..FrameUpload::default() },
        ours: sent(1_234, 74_100.0),
        classic: sent(45_678, 2.7e6),
        gpu_gems: sent(12_300, 738_000.0),
        heights: sent(8_190, 491_400.0),
        levels: 12,
        stream: Some(StreamCounters {
            cache_hits: 1_234_567,
            cache_misses: 98_765,
            damaged_tiles: 3,
            resident_bytes: 498_000_000,
            limit_bytes: 512_000_000,
            ..StreamCounters::default()
        }),
        tiles_per_s: 123.4,
        pose: [8.375, 47.5, 4_321.0, 312.3, -12.3],
        degrees: true,
        above_ground_m: Some(2_345.6),
        speed_m_s: 1_234.5,
        cursor: Some(UnderCursor {
            place: [8.12345, 47.12345],
            drawn_m: 1_975.4,
            full_m: Some(1_974.9),
            slope_deg: 34.5,
            distance_m: 12_345.6,
            level: 4,
        }),
        vsync: "mailbox",
        size_px: [3840, 2160],
        recording_s: Some(12.3),
        replay_s: Some([3.1, 20.0]),
        following: true,
        message: Some("saved valley-of-the-very-long-name.png with its pose beside the scene file".into()),
        adapter: "llvmpipe (LLVM 20.1.2, 256 bits)".into(),
        beside_triangles: Some(98_765),
    }
}

/// A window that is only thought of.
struct Stage {
    ctx: Context,
    hud: Hud,
    facts: Facts,
    look: Look,
    size: Vec2,
    scale: f32,
    now_s: f64,
}

impl Stage {
    fn new(size: [f32; 2], scale: f32) -> Self {
        let ctx = Context::default();
        style(&ctx);
        let size = vec2(size[0], size[1]);
        Self { ctx, hud: Hud::default(), facts: full_facts(), look: look(), size, scale, now_s: 0.0 }
    }

    /// One that has been shown for some frames.
    fn settled() -> Self {
        let mut stage = Self::new([1280.0, 720.0], 1.0);
        stage.frames(3);
        stage
    }

    fn frame(&mut self, events: Vec<Event>) -> (Vec<ClippedShape>, Vec<Reply>) {
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, self.size));
        let mut input = RawInput { screen_rect, events, time: Some(self.now_s), ..RawInput::default() };
        input.viewports.entry(ViewportId::ROOT).or_default().native_pixels_per_point = Some(self.scale);
        let mut replies = Vec::new();
        let Self { ctx, hud, facts, look, now_s, .. } = self;
        let mut output = ctx.run_ui(input, |ui| replies = hud.draw(ui, facts, look, *now_s));
        let shapes = std::mem::take(&mut output.shapes);
        assert_eq!(output.pixels_per_point, self.scale);
        self.ctx.tessellate(shapes.clone(), self.scale);
        output.drop_without_applying_deltas();
        self.now_s += 0.05;
        (shapes, replies)
    }

    /// Frames without input; gives what the last one shows.
    fn frames(&mut self, n: u32) -> Vec<ClippedShape> {
        let mut shapes = Vec::new();
        for _ in 0..n {
            shapes = self.frame(Vec::new()).0;
        }
        shapes
    }

    fn texts(&mut self) -> Vec<(String, Rect)> {
        let mut out = Vec::new();
        for clipped in self.frames(1) {
            texts_of(&clipped.shape, &mut out);
        }
        out
    }

    fn says(&mut self, part: &str) -> bool {
        self.texts().iter().any(|(text, _)| text.contains(part))
    }

    fn press(&mut self, pos: Pos2, pressed: bool) -> Vec<Reply> {
        let modifiers = Modifiers::NONE;
        let button = Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers };
        self.frame(vec![Event::PointerMoved(pos), button]).1
    }

    /// Clicks what bears exactly this text.
    fn click(&mut self, text: &str) -> Vec<Reply> {
        let found = self.texts().into_iter().find(|(label, _)| label == text);
        let pos = found.unwrap_or_else(|| panic!("nothing bears '{text}'")).1.center();
        let mut replies = self.press(pos, true);
        replies.extend(self.press(pos, false));
        replies
    }

    fn key(&mut self, key: Key) -> Vec<Reply> {
        let modifiers = Modifiers::NONE;
        self.frame(vec![Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers }]).1
    }

    fn area(&self, name: &'static str) -> Option<Rect> {
        self.ctx.memory(|memory| memory.area_rect(panel::id(name)))
    }
}

fn texts_of(shape: &Shape, out: &mut Vec<(String, Rect)>) {
    match shape {
        Shape::Text(text) => out.push((text.galley.text().to_owned(), text.visual_bounding_rect())),
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| texts_of(shape, out)),
        _ => {}
    }
}
