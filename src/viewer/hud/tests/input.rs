//! What clicks, drags and keys do.

use egui::{Event, Key, Pos2, Rect, pos2};
use tessclip::rivals::Method;
use tessclip::{ColorMode, Scene};

use super::{Stage, look};
use crate::viewer::hud::{Reply, coordinates};
use crate::viewer::keys::{Action, CONTROLS};
use crate::viewer::look::Look;

#[test]
fn switches_change_the_look_at_once() {
    for scale in [1.0, 2.0] {
        let mut stage = Stage::new([1280.0, 720.0], scale);
        stage.frames(3);
        let before = stage.look.clone();
        assert!(stage.click("edges").is_empty());
        assert!(stage.click("fog").is_empty());
        let scene = Scene { wireframe: true, fog: false, ..before.scene.clone() };
        assert_eq!(stage.look, Look { scene, ..before });
    }
}

#[test]
fn lists_choose_colours_and_rivals() {
    let mut stage = Stage::settled();
    stage.click("colours: shaded");
    stage.frames(2);
    stage.click("slope");
    assert_eq!(stage.look.scene.color, ColorMode::Slope);
    assert!(stage.says("colours: slope"));
    stage.click("beside: nothing");
    stage.frames(2);
    assert_eq!(stage.click("classic"), [Reply::Beside(Some(Method::Classic))]);
    assert_eq!(stage.look.beside, None);
}

#[test]
fn buttons_ask_for_what_they_say() {
    let mut stage = Stage::settled();
    assert_eq!(stage.click("Screenshot"), [Reply::Do(Action::Screenshot { hud: false })]);
    assert_eq!(stage.click("Stop recording"), [Reply::Do(Action::Record)]);
    assert_eq!(stage.click("freeze"), [Reply::Do(Action::Freeze)]);
    assert_eq!(stage.click("factors by error"), [Reply::Do(Action::Factors)]);
    assert_eq!(stage.look, look());
}

#[test]
fn a_slider_moves_a_number_and_otherwise_leaves_it_alone() {
    let mut stage = Stage::settled();
    stage.look.exaggeration = 1.234_567_8;
    stage.look.scene.sun_deg = [-12.345_678, 97.0];
    let before = stage.look.clone();
    let label = stage.texts().into_iter().find(|(text, _)| text == "exaggeration").unwrap().1;
    assert_eq!(stage.look, before);
    let pos = pos2(stage.area("view").unwrap().left() + 70.0, label.center().y);
    stage.press(pos, true);
    stage.press(pos, false);
    let after = stage.look.exaggeration;
    assert!(after > 2.0 && after <= Look::EXAGGERATION[1], "{after}");
    assert_eq!(stage.look, Look { exaggeration: after, ..before });
}

#[test]
fn help_shows_every_control_until_it_is_closed() {
    let mut stage = Stage::settled();
    assert_eq!(stage.click("Help"), [Reply::Do(Action::Help)]);
    stage.hud.toggle_help();
    stage.frames(3);
    let texts = stage.texts();
    for control in CONTROLS {
        for part in [control.keys, control.does] {
            assert!(texts.iter().any(|(text, _)| text.lines().any(|line| line == part)), "{part}");
        }
    }
    let help = stage.area("help").unwrap();
    assert!(Rect::from_min_size(Pos2::ZERO, stage.size).contains_rect(help), "{help:?}");
    let table = texts.iter().find(|(text, _)| text.contains(CONTROLS[0].does)).unwrap().1;
    assert!(help.contains_rect(table), "{table:?} is cut off by {help:?}");
    stage.click("Close");
    assert!(!stage.says("Controls"));
    stage.hud.toggle_help();
    assert!(stage.says("Controls"));
    stage.hud.close();
    assert!(!stage.says("Controls"));
}

#[test]
fn coordinates_are_typed_and_entered() {
    let mut stage = Stage::settled();
    assert!(!stage.hud.owns_keyboard(&stage.ctx));
    stage.hud.ask_for_place();
    assert!(stage.hud.owns_keyboard(&stage.ctx));
    stage.frames(3);
    assert!(stage.hud.owns_keyboard(&stage.ctx));
    stage.frame(vec![Event::Text("8.2, 91".into())]);
    assert!(stage.key(Key::Enter).is_empty());
    assert!(stage.says(&coordinates::parse("8.2, 91", true).unwrap_err()));
    stage.frames(2);
    assert!(stage.hud.owns_keyboard(&stage.ctx));
    stage.key(Key::Backspace);
    stage.key(Key::Backspace);
    stage.frame(vec![Event::Text("47.5".into())]);
    assert_eq!(stage.key(Key::Enter), [Reply::GoTo { place: [8.2, 47.5], height_m: None }]);
    stage.frames(2);
    assert!(!stage.hud.owns_keyboard(&stage.ctx) && !stage.says("latitude"));
    stage.hud.ask_for_place();
    stage.frames(3);
    assert!(stage.key(Key::Escape).is_empty());
    stage.frames(2);
    assert!(!stage.hud.owns_keyboard(&stage.ctx) && !stage.says("Enter goes there"));
}

#[test]
fn the_pointer_belongs_to_panels_where_they_are() {
    let mut stage = Stage::settled();
    let middle = pos2(640.0, 360.0);
    let numbers = stage.area("numbers").unwrap().center();
    stage.frame(vec![Event::PointerMoved(middle)]);
    assert!(!stage.hud.owns_pointer(&stage.ctx));
    stage.frame(vec![Event::PointerMoved(numbers)]);
    assert!(stage.hud.owns_pointer(&stage.ctx));
    // A drag that began over the terrain stays the terrain's.
    stage.press(middle, true);
    stage.frame(vec![Event::PointerMoved(numbers)]);
    assert!(!stage.hud.owns_pointer(&stage.ctx));
    stage.press(numbers, false);
    // And one that began on a panel the panel's.
    stage.press(numbers, true);
    assert!(stage.hud.owns_pointer(&stage.ctx));
}
