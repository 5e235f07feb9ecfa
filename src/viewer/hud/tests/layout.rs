//! Where panels stand.

use egui::epaint::ClippedShape;
use egui::{Color32, FontId, Pos2, RawInput, Rect, ViewportId, pos2, vec2};
use tessclip::ColorMode;
use tessclip::rivals::Method;

use super::Stage;
use crate::viewer::hud::panel;

/// Window sizes in points and pixels a point.
const WINDOWS: [([f32; 2], f32); 8] = [
    ([1280.0, 720.0], 1.0),
    ([1280.0, 720.0], 2.0),
    ([1024.0, 560.0], 1.0),
    ([1920.0, 1080.0], 1.25),
    ([640.0, 360.0], 1.0),
    ([640.0, 360.0], 2.0),
    ([560.0, 340.0], 1.5),
    ([320.0, 200.0], 1.0),
];
const PANELS: [&str; 5] = ["numbers", "view", "legend", "status", "state"];

#[test]
fn the_middle_of_the_window_stays_free() {
    for (size, scale) in WINDOWS {
        for color in [ColorMode::Shaded, ColorMode::Levels, ColorMode::Blocks, ColorMode::Error] {
            let mut stage = Stage::new(size, scale);
            stage.facts.levels = 16;
            stage.look.scene.color = color;
            let window = Rect::from_min_size(Pos2::ZERO, stage.size);
            let middle = Rect::from_center_size(window.center(), stage.size * vec2(0.5, 0.6)).shrink(0.5);
            for ix in 0..4 {
                let shapes = stage.frames(1);
                assert!(ix == 0 || !shapes.is_empty(), "nothing is drawn at {size:?}");
                for clipped in shapes {
                    let seen = clipped.shape.visual_bounding_rect().intersect(clipped.clip_rect);
                    assert!(
                        !seen.is_positive() || !seen.intersects(middle),
                        "{seen:?} at {size:?}, {color:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn panels_stand_side_by_side_inside_the_window() {
    for (size, scale) in WINDOWS {
        let mut stage = Stage::new(size, scale);
        stage.look.scene.color = ColorMode::Levels;
        stage.frames(4);
        let window = Rect::from_min_size(Pos2::ZERO, stage.size).expand(0.5);
        let rects: Vec<_> = PANELS.iter().filter_map(|name| Some((*name, stage.area(name)?))).collect();
        let expected = if size[0] < 560.0 { 1 } else { 4 + usize::from(size[0] >= 1024.0) };
        assert_eq!(rects.len(), expected, "{size:?}: {rects:?}");
        for (ix, (name, rect)) in rects.iter().enumerate() {
            assert!(window.contains_rect(*rect), "{name} {rect:?} at {size:?}");
            for (other, beside) in &rects[ix + 1..] {
                assert!(
                    !rect.shrink(0.5).intersects(*beside),
                    "{name} {rect:?}, {other} {beside:?} at {size:?}"
                );
            }
        }
        if let Some(view) = stage.area("view") {
            assert!(view.width() <= 230.0, "{view:?}");
        }
    }
}

#[test]
fn characters_are_no_wider_than_lines_are_reckoned_with() {
    let stage = Stage::settled();
    for scale in [1.0, 2.0] {
        let mut input = RawInput::default();
        input.viewports.entry(ViewportId::ROOT).or_default().native_pixels_per_point = Some(scale);
        let mut width = 0.0;
        let output = stage.ctx.run_ui(input, |ui| {
            let text = "0".repeat(100);
            let font = FontId::monospace(12.0);
            width = ui.painter().layout_no_wrap(text, font, Color32::WHITE).size().x;
        });
        output.drop_without_applying_deltas();
        assert!(width > 100.0 && width <= panel::width(100) - panel::width(0), "{width}");
    }
}

#[test]
fn a_split_screen_is_divided_and_named() {
    let mut stage = Stage::settled();
    stage.look.beside = Some(Method::Geomipmap);
    stage.frames(5);
    let texts = stage.texts();
    let half = |name: &str| texts.iter().find(|(text, _)| text.starts_with(name)).unwrap().1;
    assert!(half("ours  411").right() < 640.0 && half("geomipmap  98").left() > 640.0);
    assert!(half("geomipmap").top() > 0.8 * 720.0);
    let line = |clipped: &ClippedShape| {
        let rect = clipped.shape.visual_bounding_rect();
        rect.contains(pos2(640.0, 360.0)) && rect.width() < 4.0 && rect.height() >= 640.0
    };
    assert!(stage.frames(1).iter().any(line));
}
