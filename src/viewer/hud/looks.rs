//! The view panel: how the terrain is looked at, and what can be done.

use egui::{ComboBox, Slider, SliderClamping, Ui};
use tessclip::ColorMode;
use tessclip::rivals::Method;

use super::Reply;
use super::panel::SIDE_PT;
use crate::viewer::facts::Facts;
use crate::viewer::keys::Action;
use crate::viewer::look::Look;

/// The colourings, in the order of their keys.
const COLORS: [(ColorMode, &str); 7] = [
    (ColorMode::Shaded, "shaded"),
    (ColorMode::Levels, "levels"),
    (ColorMode::Blocks, "blocks"),
    (ColorMode::Elevation, "elevation"),
    (ColorMode::Slope, "slope"),
    (ColorMode::Error, "error on screen"),
    (ColorMode::Refill, "refill"),
];
/// What the right half shows when it shows no rival.
const NO_RIVAL: &str = "nothing";

/// The widgets of the panel. What is a plain number or switch of the look is changed at once.
pub fn show(ui: &mut Ui, facts: &Facts, look: &mut Look, replies: &mut Vec<Reply>) {
    ui.set_width(SIDE_PT);
    ui.strong("View");
    coloring(ui, look);
    switches(ui, look, replies);
    rivals(ui, look, replies);
    sliders(ui, look);
    buttons(ui, facts, replies);
}

fn coloring(ui: &mut Ui, look: &mut Look) {
    let color = &mut look.scene.color;
    let name = COLORS.iter().find(|(mode, _)| *mode == *color).map_or("", |(_, name)| *name);
    let list = ComboBox::from_id_salt("color").width(SIDE_PT).truncate();
    list.selected_text(format!("colours: {name}")).show_ui(ui, |ui| {
        for (mode, name) in COLORS {
            ui.selectable_value(color, mode, name);
        }
    });
}

fn switches(ui: &mut Ui, look: &mut Look, replies: &mut Vec<Reply>) {
    let mut by_error = look.scene.factors.by_error();
    let mut frozen = look.frozen.is_some();
    let scene = &mut look.scene;
    ui.columns_const(|[left, right]| {
        left.checkbox(&mut scene.wireframe, "edges");
        left.checkbox(&mut scene.bounds, "bounds");
        left.checkbox(&mut scene.fog, "fog");
        right.checkbox(&mut scene.morph, "geomorph");
        if right.checkbox(&mut by_error, "factors by error").clicked() {
            replies.push(Reply::Do(Action::Factors));
        }
        if right.checkbox(&mut frozen, "freeze").clicked() {
            replies.push(Reply::Do(Action::Freeze));
        }
    });
}

fn rivals(ui: &mut Ui, look: &Look, replies: &mut Vec<Reply>) {
    let name = look.beside.map_or(NO_RIVAL, Method::name);
    let mut picked = look.beside;
    let list = ComboBox::from_id_salt("beside").width(SIDE_PT).truncate();
    list.selected_text(format!("beside: {name}")).show_ui(ui, |ui| {
        ui.selectable_value(&mut picked, None, NO_RIVAL);
        for method in Method::ALL {
            ui.selectable_value(&mut picked, Some(method), method.name());
        }
    });
    if picked != look.beside {
        replies.push(Reply::Beside(picked));
    }
}

/// Ends and unit of a slider.
struct Scale {
    ends: [f64; 2],
    unit: &'static str,
    logarithmic: bool,
}

fn sliders(ui: &mut Ui, look: &mut Look) {
    let times = Scale { ends: Look::EXAGGERATION, unit: "×", logarithmic: true };
    slider(ui, &mut look.exaggeration, "exaggeration", &times);
    let degrees = |ends| Scale { ends, unit: "°", logarithmic: false };
    let [azimuth, altitude] = &mut look.scene.sun_deg;
    slider(ui, azimuth, "sun azimuth", &degrees([0.0, 360.0]));
    slider(ui, altitude, "sun altitude", &degrees([-90.0, 90.0]));
    slider(ui, &mut look.fov_deg, "field of view", &degrees(Look::FOV_DEG));
}

/// A slider that leaves a value as it is until it is moved, with all its digits and even beyond the ends.
fn slider(ui: &mut Ui, value: &mut f64, name: &str, scale: &Scale) {
    let mut moved = *value;
    let [low, high] = scale.ends;
    let slider = Slider::new(&mut moved, low..=high)
        .clamping(SliderClamping::Edits)
        .logarithmic(scale.logarithmic)
        .max_decimals(2)
        .suffix(scale.unit)
        .text(name);
    if ui.add(slider).changed() {
        *value = moved;
    }
}

fn buttons(ui: &mut Ui, facts: &Facts, replies: &mut Vec<Reply>) {
    let record = if facts.recording_s.is_some() { "Stop recording" } else { "Record" };
    let replay = if facts.replay_s.is_some() { "Stop replay" } else { "Replay" };
    let all = [
        ("Screenshot", Action::Screenshot { hud: false }),
        ("Home", Action::Home),
        (record, Action::Record),
        ("Go to", Action::GoTo),
        (replay, Action::Replay),
        ("Save scene", Action::SaveScene),
        ("Help", Action::Help),
        ("Render line", Action::PrintLine),
    ];
    ui.columns_const(|columns: &mut [Ui; 2]| {
        for (ix, (name, action)) in all.into_iter().enumerate() {
            if columns[ix % 2].button(name).clicked() {
                replies.push(Reply::Do(action));
            }
        }
    });
}
