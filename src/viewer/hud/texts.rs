//! The texts of the panels, kept from frame to frame: laying text out is most of what panels cost.

use egui::Vec2;

use super::format::{count, cut, fitted, known};
use super::panel::{self, Fit, GAP, INSET};
use super::{numbers, status};
use crate::viewer::facts::Facts;
use crate::viewer::look::Look;

/// Texts live this long, seconds.
const PERIOD_S: f64 = 0.2;

/// What texts are made of.
#[derive(Clone, Copy)]
pub struct Moment<'a> {
    pub facts: &'a Facts,
    pub look: &'a Look,
    /// The window, points.
    pub size: Vec2,
    /// True while the cursor is over a panel, and not over ground.
    pub on_panel: bool,
}

/// All texts that change by themselves.
#[derive(Debug, Default)]
pub struct Texts {
    /// When they were made, seconds, and for which window, points.
    made: Option<(f64, Vec2)>,
    /// What the window has room for.
    pub fit: Fit,
    /// Numbers above the graph, or all there are.
    pub numbers: String,
    /// Numbers below the graph.
    pub more_numbers: String,
    /// The camera, and the ground under the cursor.
    pub status: String,
    /// What is going on.
    pub badges: String,
    /// What just happened.
    pub message: String,
    /// True when badges and message have no room beside the status, and stand above it.
    pub stacked: bool,
    /// Names and triangles of the two halves of a split screen.
    pub halves: Option<[String; 2]>,
}

impl Texts {
    /// Makes them again when they are too old, or made for another window.
    pub fn refresh(&mut self, moment: Moment<'_>, now_s: f64) {
        let fresh = self.made.is_some_and(|(made_s, size)| {
            size == moment.size && (made_s..made_s + PERIOD_S).contains(&now_s)
        });
        if !fresh {
            *self = Self::of(moment);
            self.made = Some((now_s, moment.size));
        }
    }

    /// The next refresh makes them again.
    pub fn expire(&mut self) {
        self.made = None;
    }

    fn of(moment: Moment<'_>) -> Self {
        let fit = Fit::of(moment.size);
        let texts = Self { fit, halves: halves(moment.facts, moment.look), ..Self::default() };
        match fit {
            Fit::Line => texts.line(moment),
            Fit::Compact => texts.compact(moment),
            Fit::Full => texts.full(moment),
        }
    }

    fn line(self, Moment { facts, size, .. }: Moment<'_>) -> Self {
        let columns = panel::columns(size.x);
        let numbers = match &facts.message {
            Some(message) => cut(message, columns),
            None => fitted(&numbers::fewest(facts), columns),
        };
        Self { numbers, ..self }
    }

    fn compact(self, moment: Moment<'_>) -> Self {
        let Moment { facts, look, size, .. } = moment;
        let mut items: Vec<String> = facts.message.iter().cloned().collect();
        items.extend(self.halves.iter().map(|[_, beside]| beside.clone()));
        items.extend(status::badges(facts, look));
        Self {
            numbers: numbers::few(facts),
            status: place_lines(moment),
            badges: fitted(&items, panel::columns(size.x)),
            stacked: true,
            ..self
        }
    }

    fn full(self, moment: Moment<'_>) -> Self {
        let Moment { facts, look, size, .. } = moment;
        let columns = panel::columns(size.x);
        let status = place_lines(moment);
        let badges = fitted(&status::badges(facts, look), columns);
        let message = facts.message.as_ref().map_or_else(String::new, |message| cut(message, columns));
        let right = widest(&badges).max(widest(&message));
        let both = panel::width(widest(&status)) + panel::width(right) + 2.0 * INSET + GAP;
        Self {
            numbers: numbers::above_graph(facts),
            more_numbers: numbers::below_graph(facts),
            status,
            badges,
            message,
            stacked: both > size.x,
            ..self
        }
    }
}

fn place_lines(Moment { facts, size, on_panel, .. }: Moment<'_>) -> String {
    let columns = panel::columns(size.x);
    let mut text = fitted(&status::camera(facts), columns);
    if let Some(under) = facts.cursor.as_ref().filter(|_| !on_panel) {
        text.push('\n');
        text.push_str(&fitted(&status::cursor(under, facts.degrees), columns));
    }
    text
}

fn widest(text: &str) -> usize {
    text.lines().map(|line| line.chars().count()).max().unwrap_or(0)
}

fn halves(facts: &Facts, look: &Look) -> Option<[String; 2]> {
    let ours = facts.counters.map(|c| u64::from(c.index_count / 3));
    let label = |name: &str, triangles: Option<u64>| format!("{name}  {} triangles", known(triangles, count));
    look.beside.map(|method| [label("ours", ours), label(method.name(), facts.beside_triangles)])
}

#[cfg(test)]
mod tests {
    use egui::vec2;

    use super::*;
    use crate::viewer::hud::tests::{full_facts, look};

    fn moment<'a>(facts: &'a Facts, look: &'a Look, size: Vec2) -> Moment<'a> {
        Moment { facts, look, size, on_panel: false }
    }

    #[test]
    fn texts_are_made_five_times_a_second() {
        let (mut facts, look, size) = (full_facts(), look(), vec2(1280.0, 720.0));
        let mut texts = Texts::default();
        let mut made = 0;
        for ix in 0_u32..100 {
            facts.terrain = format!("terrain {ix}");
            texts.refresh(moment(&facts, &look, size), f64::from(ix) * 0.01);
            made += u32::from(texts.numbers.starts_with(&facts.terrain));
        }
        assert_eq!(made, 5);
        // A window of another size, and a clock that was set back.
        let size = vec2(1300.0, 720.0);
        texts.refresh(moment(&facts, &look, size), 1.0);
        assert!(texts.numbers.starts_with("terrain 99"));
        facts.terrain = "again".into();
        texts.refresh(moment(&facts, &look, size), 0.5);
        assert!(texts.numbers.starts_with("again"));
    }

    #[test]
    fn the_message_takes_the_only_line() {
        let (mut facts, look, size) = (full_facts(), look(), vec2(320.0, 200.0));
        let texts = Texts::of(moment(&facts, &look, size));
        assert!(texts.numbers.starts_with("saved valley"), "{}", texts.numbers);
        facts.message = None;
        let texts = Texts::of(moment(&facts, &look, size));
        assert!(texts.numbers.contains("frames/s") && texts.status.is_empty());
    }

    #[test]
    fn under_a_panel_there_is_no_ground() {
        let (facts, look, size) = (full_facts(), look(), vec2(1280.0, 720.0));
        let lines = |on_panel| Texts::of(Moment { on_panel, ..moment(&facts, &look, size) }).status;
        assert!(lines(false).contains("\ncursor"));
        assert_eq!(lines(true).lines().count(), 1);
    }

    #[test]
    fn the_right_half_is_named() {
        let mut look = look();
        let facts = full_facts();
        assert_eq!(halves(&facts, &look), None);
        look.beside = Some(tessclip::rivals::Method::Roam);
        let [ours, beside] = halves(&facts, &look).unwrap();
        assert_eq!(ours, "ours  411\u{2009}522 triangles");
        assert_eq!(beside, "roam  98\u{2009}765 triangles");
    }
}
