//! What keys do: one table for the program, the help overlay and the README (a test holds the README to it).

use tessclip::ColorMode;
use winit::keyboard::KeyCode;

/// What a key or a button of the panel asks for, once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// The overlay with this table.
    Help,
    /// Prints the command line of `render` that draws the same picture.
    PrintLine,
    /// The panels.
    Hud,
    /// Saves what is open as a scene file.
    SaveScene,
    /// The next kind of synchronisation with the screen.
    NextVsync,
    FullScreen,
    /// A picture; with the panels or without.
    Screenshot {
        hud: bool,
    },
    Color(ColorMode),
    Wireframe,
    Bounds,
    Fog,
    Morph,
    /// Factors by error, or uniform.
    Factors,
    /// Windows and culling stay where they are; the camera flies on.
    Freeze,
    /// Ours alone, or a rival in the right half.
    Beside,
    /// The next rival.
    NextRival,
    /// Factor on the heights, times this.
    Exaggerate(f64),
    /// Azimuth and altitude of the sun, degrees more.
    Sun([f64; 2]),
    /// Field of view, degrees more.
    Fov(f64),
    /// Speed, times this.
    Speed(f64),
    /// The camera keeps its height above the ground.
    Follow,
    /// Begins or ends a recording.
    Record,
    /// Begins or ends a replay.
    Replay,
    /// A camera that sees everything.
    Home,
    /// Asks for coordinates.
    GoTo,
    /// Ends the program (the window's own button as well).
    Quit,
}

/// A line of the table of controls.
pub struct Control {
    /// Keys as the help shows them.
    pub keys: &'static str,
    /// What they do.
    pub does: &'static str,
}

const fn control(keys: &'static str, does: &'static str) -> Control {
    Control { keys, does }
}

/// The table of controls, in the order of the help.
pub const CONTROLS: &[Control] = &[
    control("W A S D", "fly forward, left, back, right; E up, Q down"),
    control("Shift, Ctrl", "eight times as fast, an eighth as fast"),
    control("wheel, + -", "speed; it also grows with the height above the ground"),
    control("left click, right drag", "captures the mouse to look around, Esc frees it; looks around"),
    control("middle drag", "orbits around the point under the cursor"),
    control("double click", "flies to the point under the cursor"),
    control("Home, G", "sees everything; goes to coordinates"),
    control("T", "follows the ground at this height"),
    control(
        "1 2 3 4 5 6 7",
        "shaded, levels, blocks, elevation, slope, error on screen, refill of this frame",
    ),
    control("X, B", "triangle edges; bounds of the visible patches"),
    control("C", "freezes culling and levels: fly out and look at them"),
    control("V, N", "a rival in the right half; the next rival"),
    control("M, F, U", "geomorph; fog; factors by error or uniform"),
    control("[ ]", "vertical exaggeration"),
    control("arrows", "sun: azimuth and altitude; with Shift five degrees a step"),
    control(", .", "field of view; with Shift five degrees a step"),
    control("R, P", "records the camera as a path; replays it"),
    control("F1, F3", "this help; the panels"),
    control("F2, F4", "prints the render line of this picture; saves the scene as TOML"),
    control("F6, F11", "vsync; full screen"),
    control("F12", "screenshot with the pose in its metadata; with Shift the panels too"),
    control("F10", "quits"),
];

/// What a key asks for when it goes down. `None` for keys that are held to fly, and those that mean nothing.
pub fn action(key: KeyCode, shift: bool) -> Option<Action> {
    let step = if shift { 5.0 } else { 1.0 };
    Some(match key {
        KeyCode::F1 => Action::Help,
        KeyCode::F2 => Action::PrintLine,
        KeyCode::F3 => Action::Hud,
        KeyCode::F4 => Action::SaveScene,
        KeyCode::F6 => Action::NextVsync,
        KeyCode::F11 => Action::FullScreen,
        KeyCode::F12 => Action::Screenshot { hud: shift },
        KeyCode::Digit1 => Action::Color(ColorMode::Shaded),
        KeyCode::Digit2 => Action::Color(ColorMode::Levels),
        KeyCode::Digit3 => Action::Color(ColorMode::Blocks),
        KeyCode::Digit4 => Action::Color(ColorMode::Elevation),
        KeyCode::Digit5 => Action::Color(ColorMode::Slope),
        KeyCode::Digit6 => Action::Color(ColorMode::Error),
        KeyCode::Digit7 => Action::Color(ColorMode::Refill),
        KeyCode::KeyX => Action::Wireframe,
        KeyCode::KeyB => Action::Bounds,
        KeyCode::KeyF => Action::Fog,
        KeyCode::KeyM => Action::Morph,
        KeyCode::KeyU => Action::Factors,
        KeyCode::KeyC => Action::Freeze,
        KeyCode::KeyV => Action::Beside,
        KeyCode::KeyN => Action::NextRival,
        KeyCode::BracketLeft => Action::Exaggerate(0.8),
        KeyCode::BracketRight => Action::Exaggerate(1.25),
        KeyCode::ArrowLeft => Action::Sun([-step, 0.0]),
        KeyCode::ArrowRight => Action::Sun([step, 0.0]),
        KeyCode::ArrowUp => Action::Sun([0.0, step]),
        KeyCode::ArrowDown => Action::Sun([0.0, -step]),
        KeyCode::Comma => Action::Fov(-step),
        KeyCode::Period => Action::Fov(step),
        KeyCode::Equal | KeyCode::NumpadAdd => Action::Speed(1.25),
        KeyCode::Minus | KeyCode::NumpadSubtract => Action::Speed(0.8),
        KeyCode::KeyT => Action::Follow,
        KeyCode::KeyR => Action::Record,
        KeyCode::KeyP => Action::Replay,
        KeyCode::Home => Action::Home,
        KeyCode::KeyG => Action::GoTo,
        KeyCode::F10 => Action::Quit,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::CONTROLS;

    #[test]
    fn the_readme_has_this_table() {
        let readme = include_str!("../../README.md");
        let rows: Vec<String> = CONTROLS.iter().map(|c| format!("| {} | {} |", c.keys, c.does)).collect();
        let table = format!("| keys | what they do |\n|---|---|\n{}\n", rows.join("\n"));
        assert!(readme.contains(&table), "README.md must have:\n{table}");
    }
}
