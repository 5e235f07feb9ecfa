//! Where panels stand, and how much of them a window has room for.

use egui::{Align2, Area, Context, Frame, Id, InnerResponse, Order, Ui, Vec2};

use super::colors::FILL;

/// From the window's edge, points.
pub const INSET: f32 = 4.0;
/// Between two panels, points.
pub const GAP: f32 = 2.0;
/// Of what the panels on the right hold, points.
pub const SIDE_PT: f32 = 214.0;
/// Around what a panel holds, points.
const MARGIN: i8 = 4;
/// At most the width of a character of the panels' monospaced text, points.
const GLYPH_PT: f32 = 7.25;

/// How much the window has room for: panels keep out of its middle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fit {
    /// One line.
    Line,
    /// A few lines in the corners.
    Compact,
    /// All panels.
    #[default]
    Full,
}

impl Fit {
    /// That of a window, points. Panels may take a quarter of the width at each side, and a fifth of the height
    /// above and below.
    pub fn of(size: Vec2) -> Self {
        if size.x >= 1024.0 && size.y >= 560.0 {
            Self::Full
        } else if size.x >= 560.0 && size.y >= 340.0 {
            Self::Compact
        } else {
            Self::Line
        }
    }
}

/// Characters a line over the whole width may have; `width` of the window, points.
pub fn columns(width: f32) -> usize {
    ((width - 2.0 * INSET - 2.0 * f32::from(MARGIN)) / GLYPH_PT).max(8.0) as usize
}

/// Width of a panel whose longest line has so many characters, points.
pub fn width(columns: usize) -> f32 {
    columns as f32 * GLYPH_PT + 2.0 * f32::from(MARGIN)
}

/// Around a panel. What lies behind it is there before anything is painted.
pub fn frame() -> Frame {
    Frame::new().inner_margin(MARGIN)
}

/// The identity of a panel.
pub fn id(name: &'static str) -> Id {
    Id::unique(("hud", name))
}

/// A panel in a corner of the window, moved by `offset` points.
pub fn corner<R>(
    ctx: &Context,
    name: &'static str,
    corner: Align2,
    offset: [f32; 2],
    add: impl FnOnce(&mut Ui) -> R,
) -> InnerResponse<R> {
    let area = Area::new(id(name)).anchor(corner, offset).fade_in(false);
    area.show(ctx, |ui| frame().show(ui, add).inner)
}

/// A panel that the user opened: in the middle, above all others.
pub fn middle<R>(ctx: &Context, name: &'static str, add: impl FnOnce(&mut Ui) -> R) -> InnerResponse<R> {
    let area = Area::new(id(name)).anchor(Align2::CENTER_CENTER, Vec2::ZERO).fade_in(false);
    let frame = frame().fill(FILL);
    area.order(Order::Foreground).show(ctx, |ui| frame.show(ui, add).inner)
}
