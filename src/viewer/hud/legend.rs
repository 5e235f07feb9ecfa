//! What the colours of the picture stand for.

use egui::{Align2, Color32, Mesh, Rect, Sense, TextStyle, Ui, pos2, vec2};
use tessclip::ColorMode;
use tessclip::clipmap::MAX_LEVELS;

use super::colors::{TEXT, block, ink_on, level, ramp, refilled};
use super::format::metres;
use super::panel::SIDE_PT;
use crate::viewer::facts::Facts;

/// Levels a row.
const PER_ROW: u32 = 10;
/// Width and height of a level with the gap after it, points.
const SQUARE: [f32; 2] = [21.0, 16.0];
/// Width of one half of a swatch, and its height, points.
const SWATCH: [f32; 2] = [10.0, 14.0];
/// Height of a ramp and of the labels below it, points.
const RAMP: [f32; 2] = [10.0, 12.0];
/// Pieces of a ramp, between which colours are mixed as the screen has them.
const PIECES: u32 = 32;

/// The legend of a colouring; none for the shaded one.
pub fn show(ui: &mut Ui, color: ColorMode, facts: &Facts) {
    match color {
        ColorMode::Shaded => {}
        ColorMode::Levels => squares(ui, facts.levels.min(MAX_LEVELS)),
        ColorMode::Blocks => {
            let kinds = [(block(0), "M"), (block(1), "R"), (block(2), "L"), (block(3), "fill")];
            swatches(ui, "blocks; darker on even levels", &kinds);
        }
        ColorMode::Elevation => match facts.heights_m {
            Some(range) => {
                let [low, high] = range.map(|h| metres(f64::from(h)));
                scale(ui, "height", &[low.as_str(), high.as_str()]);
            }
            None => scale(ui, "height", &["lowest", "highest"]),
        },
        ColorMode::Slope => scale(ui, "slope", &["0°", "45°", "90°"]),
        ColorMode::Error => scale(ui, "error at most, px; grey: not known", &["1/16", "1/4", "1", "4", "16"]),
        ColorMode::Refill => {
            let [new, rest] = refilled();
            swatches(ui, "refill", &[([new; 2], "new this frame"), ([rest; 2], "kept")]);
        }
    }
}

/// A square a level, its number inside.
fn squares(ui: &mut Ui, levels: u32) {
    ui.label("levels, 0 the finest");
    let rows = levels.div_ceil(PER_ROW);
    let (rect, _) = ui.allocate_exact_size(vec2(SIDE_PT, rows as f32 * SQUARE[1]), Sense::hover());
    let square = |level: u32| {
        let at = vec2((level % PER_ROW) as f32 * SQUARE[0], (level / PER_ROW) as f32 * SQUARE[1]);
        Rect::from_min_size(rect.min + at, vec2(SQUARE[0] - 2.0, SQUARE[1] - 2.0))
    };
    let mut mesh = Mesh::default();
    for ix in 0..levels {
        mesh.add_colored_rect(square(ix), level(ix));
    }
    ui.painter().add(mesh);
    let font = TextStyle::Small.resolve(ui.style());
    for ix in 0..levels {
        let ink = ink_on(level(ix));
        ui.painter().text(square(ix).center(), Align2::CENTER_CENTER, ix, font.clone(), ink);
    }
}

/// Colours side by side, each in two halves, with their names.
fn swatches(ui: &mut Ui, title: &str, entries: &[([Color32; 2], &str)]) {
    ui.label(title);
    let (rect, _) = ui.allocate_exact_size(vec2(SIDE_PT, SWATCH[1]), Sense::hover());
    let font = TextStyle::Body.resolve(ui.style());
    let step = (SIDE_PT / entries.len().max(1) as f32).floor();
    let mut mesh = Mesh::default();
    for (ix, (halves, name)) in entries.iter().enumerate() {
        let at = rect.min + vec2(ix as f32 * step, 0.0);
        for (half, color) in halves.iter().enumerate() {
            let min = at + vec2(half as f32 * SWATCH[0], 0.0);
            mesh.add_colored_rect(Rect::from_min_size(min, vec2(SWATCH[0], SWATCH[1])), *color);
        }
        let beside = at + vec2(2.0 * SWATCH[0] + 4.0, 0.5 * SWATCH[1]);
        ui.painter().text(beside, Align2::LEFT_CENTER, *name, font.clone(), TEXT);
    }
    ui.painter().add(mesh);
}

/// The ramp with labels at equal distances below it.
fn scale(ui: &mut Ui, title: &str, labels: &[&str]) {
    ui.label(title);
    let (rect, _) = ui.allocate_exact_size(vec2(SIDE_PT, RAMP[0] + RAMP[1]), Sense::hover());
    ui.painter().add(ramp_mesh(Rect::from_min_size(rect.min, vec2(rect.width(), RAMP[0]))));
    let font = TextStyle::Small.resolve(ui.style());
    let last = labels.len().saturating_sub(1);
    for (ix, label) in labels.iter().enumerate() {
        let align = match ix {
            0 => Align2::LEFT_BOTTOM,
            _ if ix == last => Align2::RIGHT_BOTTOM,
            _ => Align2::CENTER_BOTTOM,
        };
        let x = rect.left() + rect.width() * ix as f32 / last.max(1) as f32;
        ui.painter().text(pos2(x, rect.bottom()), align, *label, font.clone(), TEXT);
    }
}

fn ramp_mesh(rect: Rect) -> Mesh {
    let mut mesh = Mesh::default();
    for ix in 0..=PIECES {
        let t = ix as f32 / PIECES as f32;
        let x = rect.left() + t * rect.width();
        for y in [rect.top(), rect.bottom()] {
            mesh.colored_vertex(pos2(x, y), ramp(t));
        }
        if ix > 0 {
            let v = 2 * ix;
            mesh.add_triangle(v - 2, v - 1, v);
            mesh.add_triangle(v - 1, v, v + 1);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ramp_fills_its_place_from_end_to_end() {
        let rect = Rect::from_min_size(pos2(3.0, 4.0), vec2(214.0, 10.0));
        let mesh = ramp_mesh(rect);
        assert!(mesh.is_valid());
        assert_eq!(mesh.calc_bounds(), rect);
        assert_eq!(mesh.vertices[0].color, ramp(0.0));
        assert_eq!(mesh.vertices.last().unwrap().color, ramp(1.0));
        let area: f32 = mesh
            .triangles()
            .map(|t| {
                let [a, b, c] = t.map(|ix| mesh.vertices[ix as usize].pos);
                let (u, v) = (b - a, c - a);
                0.5 * (u.x * v.y - u.y * v.x).abs()
            })
            .sum();
        assert!((area - 2140.0).abs() < 0.1, "{area}");
    }
}
