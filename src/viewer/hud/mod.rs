//! The panels over the picture: numbers, state, what can be changed and done, and help.
//!
//! They keep out of the middle of the window, but for the help and the field for coordinates, which the user
//! opens. All of it is drawn inside `Context::run_ui`.

mod colors;
mod coordinates;
mod format;
mod goto;
mod graph;
mod help;
mod legend;
mod looks;
mod numbers;
mod panel;
mod split;
mod status;
mod style;
#[cfg(test)]
mod tests;
mod texts;

use egui::{Align2, Context, RichText, Ui};
use tessclip::ColorMode;
use tessclip::rivals::Method;

pub use self::colors::FILL;
use self::colors::NOTE;
use self::coordinates::Goal;
use self::goto::GoTo;
use self::panel::{Fit, GAP, INSET};
pub use self::style::style;
use self::texts::{Moment, Texts};
use super::facts::Facts;
use super::keys::Action;
use super::look::Look;

/// What the user asked the panels for.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// As if its key had been pressed.
    Do(Action),
    /// A place in the terrain's own units (longitude and latitude in degrees, or x and y in metres) and a height
    /// in metres, where one was given.
    GoTo { place: [f64; 2], height_m: Option<f64> },
    /// The method to draw in the right half; none for ours alone.
    Beside(Option<Method>),
}

/// The panels, and what they remember from frame to frame.
#[derive(Debug, Default)]
pub struct Hud {
    help: bool,
    goto: GoTo,
    texts: Texts,
}

impl Hud {
    /// Shows the table of controls, or hides it.
    pub fn toggle_help(&mut self) {
        self.help = !self.help;
    }

    /// Opens the field for coordinates.
    pub fn ask_for_place(&mut self) {
        self.goto.ask();
    }

    /// Closes what the user opened: the help and the field.
    pub fn close(&mut self) {
        self.help = false;
        self.goto.close();
    }

    /// Draws the panels over the window's root `ui`; `now_s` is any clock that goes on, seconds. Numbers and
    /// switches of `look` are changed in place; all else that was asked for comes back. Colours and spacing are
    /// those that [`style()`] has set up.
    pub fn draw(&mut self, ui: &Ui, facts: &Facts, look: &mut Look, now_s: f64) -> Vec<Reply> {
        let ctx = ui.ctx();
        let size = ctx.content_rect().size();
        let on_panel = self.owns_pointer(ctx);
        self.texts.refresh(Moment { facts, look, size, on_panel }, now_s);
        if look.beside.is_some() {
            split::show(ui, self.texts.halves.as_ref().filter(|_| self.texts.fit == Fit::Full));
        }
        let mut replies = Vec::new();
        let below = self.top(ctx, facts, look, &mut replies);
        if self.texts.fit != Fit::Line {
            self.legend(ctx, facts, look, below);
            self.bottom(ctx);
        }
        help::show(ctx, &mut self.help);
        let goal = self.goto.show(ctx, facts.degrees);
        replies.extend(goal.map(|Goal { place, height_m }| Reply::GoTo { place, height_m }));
        replies
    }

    /// All texts are made anew with the next frame.
    pub fn renew(&mut self) {
        self.texts.expire();
    }

    /// True while keys belong to a text field.
    pub fn owns_keyboard(&self, ctx: &Context) -> bool {
        self.goto.wants_focus() || ctx.text_edit_focused()
    }

    /// True while the pointer belongs to a panel: over one, or since a button went down on one.
    pub fn owns_pointer(&self, ctx: &Context) -> bool {
        ctx.egui_wants_pointer_input()
    }

    /// Numbers at the left and the view at the right. Gives where the legend may begin, points from above.
    fn top(&self, ctx: &Context, facts: &Facts, look: &mut Look, replies: &mut Vec<Reply>) -> f32 {
        let full = self.texts.fit == Fit::Full;
        panel::corner(ctx, "numbers", Align2::LEFT_TOP, [INSET, INSET], |ui| {
            ui.monospace(self.texts.numbers.as_str());
            if full {
                graph::show(ui, &facts.frame_ms);
                ui.monospace(self.texts.more_numbers.as_str());
            }
        });
        if !full {
            return INSET;
        }
        let view = panel::corner(ctx, "view", Align2::RIGHT_TOP, [-INSET, INSET], |ui| {
            looks::show(ui, facts, look, replies);
        });
        view.response.rect.bottom() + GAP
    }

    fn legend(&self, ctx: &Context, facts: &Facts, look: &Look, below: f32) {
        let color = look.scene.color;
        if color != ColorMode::Shaded {
            panel::corner(ctx, "legend", Align2::RIGHT_TOP, [-INSET, below], |ui| {
                legend::show(ui, color, facts);
            });
        }
    }

    /// The camera at the left, and what is going on at the right.
    fn bottom(&self, ctx: &Context) {
        let texts = &self.texts;
        let status = panel::corner(ctx, "status", Align2::LEFT_BOTTOM, [INSET, -INSET], |ui| {
            ui.monospace(texts.status.as_str());
        });
        let lift = if texts.stacked { status.response.rect.height() + GAP } else { 0.0 };
        panel::corner(ctx, "state", Align2::RIGHT_BOTTOM, [-INSET, -INSET - lift], |ui| {
            ui.monospace(texts.badges.as_str());
            if !texts.message.is_empty() {
                ui.label(RichText::new(texts.message.as_str()).monospace().color(NOTE));
            }
        });
    }
}
