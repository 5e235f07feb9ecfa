//! What tells the two halves of a split screen apart.

use egui::{Align2, CornerRadius, Stroke, TextStyle, Ui, pos2};

use super::colors::{FILL, TEXT};

/// From the window's lower edge to the labels, points: above the panels there.
const LABELS_PT: f32 = 88.0;
/// Room for the panels below, points.
const FOOT_PT: f32 = 48.0;
/// Around a label, points.
const MARGIN_PT: f32 = 4.0;

/// A line in the middle of the window, and what the halves show where there is room to say it.
pub fn show(ui: &Ui, labels: Option<&[String; 2]>) {
    let rect = ui.ctx().content_rect();
    let painter = ui.painter();
    // Light on dark, to be seen over snow as well; not through the text of the panels below.
    let range = rect.top()..=rect.bottom() - FOOT_PT;
    painter.vline(rect.center().x, range.clone(), Stroke::new(3.0, FILL));
    painter.vline(rect.center().x, range, Stroke::new(1.0, TEXT));
    let font = TextStyle::Monospace.resolve(ui.style());
    for (label, side) in labels.into_iter().flatten().zip([0.25, 0.75]) {
        let galley = painter.layout_no_wrap(label.clone(), font.clone(), TEXT);
        let foot = pos2(rect.left() + side * rect.width(), rect.bottom() - LABELS_PT);
        let place = Align2::CENTER_BOTTOM.anchor_size(foot, galley.size());
        painter.rect_filled(place.expand(MARGIN_PT), CornerRadius::ZERO, FILL);
        painter.galley(place.min, galley, TEXT);
    }
}
