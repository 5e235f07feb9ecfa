//! The graph of frame times: one shape, a bar a frame.

use std::collections::VecDeque;

use egui::{Mesh, Rect, Sense, Ui, pos2, vec2};

use super::colors::{FRAMES, MARK};
use crate::viewer::facts::KEPT_FRAMES;

/// Width and height, points.
pub const SIZE: [f32; 2] = [KEPT_FRAMES as f32, 48.0];
/// Marked times: 60 and 30 frames a second, milliseconds.
const MARKS_MS: [f32; 2] = [16.7, 33.3];
/// The scale ends here at the latest, milliseconds.
const LAST_TOP_MS: f32 = 1.0e6;

/// Shows the last frames.
pub fn show(ui: &mut Ui, frame_ms: &VecDeque<f32>) {
    let (rect, _) = ui.allocate_exact_size(vec2(SIZE[0], SIZE[1]), Sense::hover());
    ui.painter().add(bars(frame_ms, rect));
}

/// What the scale is, for the line below.
pub fn caption(frame_ms: &VecDeque<f32>) -> String {
    format!("0 to {:.0} ms, marks {} and {}", top_ms(frame_ms), MARKS_MS[0], MARKS_MS[1])
}

/// Time at the upper edge: the longest frame rounded up to 1, 2 or 5 times a power of ten, and never so little
/// that the first mark is left out.
fn top_ms(frame_ms: &VecDeque<f32>) -> f32 {
    let longest = frame_ms.iter().copied().fold(0.0, f32::max).min(LAST_TOP_MS);
    let mut top = 20.0;
    let mut steps = [2.5, 2.0, 2.0].into_iter().cycle();
    while top < longest {
        top *= steps.next().unwrap_or(2.0);
    }
    top
}

/// Bars, the last frame at the right edge, and the marks over them.
fn bars(frame_ms: &VecDeque<f32>, rect: Rect) -> Mesh {
    let top = top_ms(frame_ms);
    let height = |ms: f32| (ms.max(0.0) / top).min(1.0) * rect.height();
    let wide = rect.width() / KEPT_FRAMES as f32;
    let mut mesh = Mesh::default();
    for (ix, ms) in frame_ms.iter().rev().take(KEPT_FRAMES).enumerate() {
        let right = rect.right() - ix as f32 * wide;
        let bar =
            Rect::from_min_max(pos2(right - wide, rect.bottom() - height(*ms)), pos2(right, rect.bottom()));
        let over = MARKS_MS.iter().filter(|mark| **mark < *ms).count();
        mesh.add_colored_rect(bar, FRAMES[over]);
    }
    for mark in MARKS_MS.into_iter().filter(|mark| *mark < top) {
        let y = (rect.bottom() - height(mark)).round();
        mesh.add_colored_rect(Rect::from_min_max(pos2(rect.left(), y), pos2(rect.right(), y + 1.0)), MARK);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rect() -> Rect {
        Rect::from_min_size(pos2(10.0, 20.0), vec2(SIZE[0], SIZE[1]))
    }

    #[test]
    fn the_scale_holds_the_longest_frame() {
        let top = |ms: f32| top_ms(&VecDeque::from([ms]));
        for (ms, expected) in [(0.0, 20.0), (20.0, 20.0), (20.1, 50.0), (51.0, 100.0), (101.0, 200.0)] {
            assert_eq!(top(ms), expected);
        }
        assert!(top(f32::INFINITY) >= LAST_TOP_MS);
        assert_eq!(top(f32::NAN), 20.0);
    }

    #[test]
    fn bars_stay_in_their_place_and_the_last_frame_is_at_the_right() {
        let frames: VecDeque<f32> = (0..300).map(|ix| ix as f32).collect();
        let mesh = bars(&frames, rect());
        assert!(mesh.is_valid());
        assert_eq!(mesh.vertices.len(), 4 * (KEPT_FRAMES + MARKS_MS.len()));
        let bounds = mesh.calc_bounds();
        assert!(rect().expand(1.0).contains_rect(bounds), "{bounds:?}");
        // 299 of 500 ms.
        let newest = mesh.vertices[0].pos;
        assert!((rect().bottom() - newest.y - 48.0 * 299.0 / 500.0).abs() < 0.01);
        assert!((newest.x - (rect().right() - 1.0)).abs() < 0.01);
    }

    #[test]
    fn colours_change_at_the_marks() {
        let mesh = bars(&VecDeque::from([10.0, 20.0, 40.0, f32::NAN]), rect());
        let colors: Vec<_> = mesh.vertices.iter().step_by(4).take(4).map(|v| v.color).collect();
        assert_eq!(colors, [FRAMES[0], FRAMES[2], FRAMES[1], FRAMES[0]]);
        assert!(mesh.vertices.iter().all(|v| v.pos.x.is_finite() && v.pos.y.is_finite()));
    }
}
