//! The field that asks for coordinates.

use egui::{Context, Key, TextEdit, Ui};

use super::colors::NOTE;
use super::coordinates::{self, Goal};
use super::panel;

/// Width of the field, points.
const WIDTH_PT: f32 = 260.0;

/// The field, and what is typed into it.
#[derive(Debug, Default)]
pub struct GoTo {
    open: bool,
    text: String,
    /// Why the last coordinates could not be used.
    problem: Option<String>,
    /// The keyboard is still to be given to the field.
    wants_focus: bool,
}

impl GoTo {
    /// Opens an empty field, or gives the keyboard back to the open one.
    pub fn ask(&mut self) {
        self.open = true;
        self.wants_focus = true;
    }

    /// Closes the field and forgets what was typed.
    pub fn close(&mut self) {
        *self = Self::default();
    }

    /// True from the moment it is opened until the keyboard is its own.
    pub fn wants_focus(&self) -> bool {
        self.wants_focus
    }

    /// Shows the field while it is open, and gives the place that was entered, in degrees or in metres.
    pub fn show(&mut self, ctx: &Context, degrees: bool) -> Option<Goal> {
        if self.open && ctx.input(|input| input.key_pressed(Key::Escape)) {
            self.close();
        }
        if !self.open {
            return None;
        }
        let entered = panel::middle(ctx, "go to", |ui| self.field(ui, degrees)).inner;
        if !entered {
            return None;
        }
        match coordinates::parse(&self.text, degrees) {
            Ok(goal) => {
                self.close();
                Some(goal)
            }
            Err(problem) => {
                self.problem = Some(problem);
                self.wants_focus = true;
                None
            }
        }
    }

    /// True when Enter was pressed in it.
    fn field(&mut self, ui: &mut Ui, degrees: bool) -> bool {
        ui.set_min_width(WIDTH_PT);
        ui.strong("Go to");
        let edit = TextEdit::singleline(&mut self.text).id(panel::id("go to field"));
        let field = ui.add(edit.hint_text(coordinates::form(degrees)).desired_width(WIDTH_PT));
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        // In its first frame a panel is only measured, and nothing in it can have the keyboard.
        if self.wants_focus && !ui.is_sizing_pass() {
            field.request_focus();
            self.wants_focus = false;
        }
        match &self.problem {
            Some(problem) => ui.colored_label(NOTE, problem.as_str()),
            None => ui.weak("Enter goes there, Esc closes"),
        };
        entered
    }
}
