//! The table of controls.

use egui::{Context, ScrollArea, Sense, TextStyle, Ui, Vec2, vec2};

use super::colors::{TEXT, WEAK};
use super::panel;
use crate::viewer::keys::{CONTROLS, Control};

/// From the window's edges, points.
const EDGE_PT: f32 = 16.0;
/// The title above the table, points.
const TITLE_PT: f32 = 28.0;
/// Between the two columns, points.
const GAP_PT: f32 = 16.0;

/// Shows the table while `open`; its button closes it. Where the window is too small for it, it scrolls.
pub fn show(ctx: &Context, open: &mut bool) {
    if !*open {
        return;
    }
    let room = (ctx.content_rect().size() - Vec2::splat(2.0 * EDGE_PT)).max(Vec2::splat(100.0));
    panel::middle(ctx, "help", |ui| {
        ui.set_max_size(room);
        ui.horizontal(|ui| {
            ui.strong("Controls");
            if ui.button("Close").clicked() {
                *open = false;
            }
        });
        ScrollArea::both().max_width(room.x).max_height(room.y - TITLE_PT).show(ui, table);
    });
}

/// Two texts with as many lines: cheaper than a label for each of their cells.
fn table(ui: &mut Ui) {
    let font = TextStyle::Body.resolve(ui.style());
    let column = |part: fn(&Control) -> &'static str, color| {
        let text = CONTROLS.iter().map(part).collect::<Vec<_>>().join("\n");
        ui.painter().layout_no_wrap(text, font.clone(), color)
    };
    let keys = column(|control| control.keys, WEAK);
    let does = column(|control| control.does, TEXT);
    let right = keys.size().x + GAP_PT;
    let size = vec2(right + does.size().x, keys.size().y.max(does.size().y));
    let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
    ui.painter().galley(rect.min, keys, WEAK);
    ui.painter().galley(rect.min + vec2(right, 0.0), does, TEXT);
}
