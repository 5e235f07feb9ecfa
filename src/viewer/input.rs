//! Events of the window: keys, mouse, size, focus, files.

use std::time::{Duration, Instant};

use serde_json::json;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::CursorGrabMode;

use super::flyer::Ground;
use super::host::Host;
use super::keys::{Action, action};

/// Two clicks within this time and this far apart are a double click.
const DOUBLE_CLICK: Duration = Duration::from_millis(400);
const DOUBLE_CLICK_PX: f64 = 6.0;
/// Keys that mean the same while something is typed.
const FUNCTION_KEYS: [KeyCode; 4] = [KeyCode::F2, KeyCode::F10, KeyCode::F11, KeyCode::F12];
/// A line of a wheel as pixels of a touch pad.
const PX_A_LINE: f64 = 40.0;

/// What the mouse is doing.
#[derive(Default)]
pub struct Mouse {
    /// Pixels of the window; none outside.
    at: Option<PhysicalPosition<f64>>,
    /// Turned into looking around until Esc.
    captured: bool,
    /// The right button is held: the same while it is.
    looking: bool,
    orbiting: bool,
    last_click: Option<(Instant, PhysicalPosition<f64>)>,
}

impl Mouse {
    /// The pixel under the cursor; the middle one while it is captured.
    pub fn pixel(&self, size: [u32; 2]) -> Option<[u32; 2]> {
        if size.contains(&0) {
            return None;
        }
        if self.captured {
            return Some(size.map(|v| v / 2));
        }
        let at = self.at?;
        let within = |v: f64, most: u32| (v >= 0.0 && v < f64::from(most)).then_some(v as u32);
        Some([within(at.x, size[0])?, within(at.y, size[1])?])
    }
}

impl Host {
    /// Any event but the one that asks for a frame.
    pub fn window_event(&mut self, event: &WindowEvent) -> anyhow::Result<()> {
        // The cursor of a captured mouse wanders where nobody sees it.
        let pointer = matches!(
            event,
            WindowEvent::CursorMoved { .. } | WindowEvent::MouseInput { .. } | WindowEvent::MouseWheel { .. }
        );
        let panels = match pointer && self.mouse.captured {
            true => egui_winit::EventResponse::default(),
            false => self.panels.event(&self.window, event),
        };
        if panels.repaint {
            self.pace.stir();
            self.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => self.quits = true,
            WindowEvent::Resized(size) => self.resized(*size),
            WindowEvent::ScaleFactorChanged { scale_factor, .. } => {
                self.tell("scale", json!({ "scale": scale_factor }));
            }
            WindowEvent::Occluded(hidden) => self.hidden = *hidden,
            WindowEvent::Focused(false) => {
                // Whatever is let go of elsewhere is not told here.
                self.held = Default::default();
                self.free_mouse();
                self.flyer.end_orbit();
                self.mouse.orbiting = false;
            }
            WindowEvent::DroppedFile(path) => self.open_other(&path.to_string_lossy()),
            WindowEvent::ModifiersChanged(now) => {
                self.elsewhere = now.state().alt_key() || now.state().super_key();
            }
            // Of keys that were down before the window had the keyboard nobody meant it.
            WindowEvent::KeyboardInput { event, is_synthetic: false, .. } => {
                let typing = self.shown && self.hud.owns_keyboard(&self.panels.context);
                self.key(event, typing || self.elsewhere);
            }
            WindowEvent::MouseInput { state, button, .. } => {
                self.button(*button, state.is_pressed(), panels.consumed);
            }
            WindowEvent::MouseWheel { delta, .. } if !panels.consumed => {
                let lines = match delta {
                    MouseScrollDelta::LineDelta(_, y) => f64::from(*y),
                    MouseScrollDelta::PixelDelta(p) => p.y / PX_A_LINE,
                };
                self.act(Action::Speed(1.25_f64.powf(lines)));
            }
            WindowEvent::CursorMoved { position, .. } => self.cursor_moved(*position),
            WindowEvent::CursorLeft { .. } => self.mouse.at = None,
            _ => return Ok(()),
        }
        self.pace.input();
        self.window.request_redraw();
        Ok(())
    }

    fn resized(&mut self, size: PhysicalSize<u32>) {
        if self.screen.resize(size.into()) {
            self.say("the window is larger than this device can draw: its picture is stretched".into());
        }
        let size = self.screen.size();
        self.tell("resized", json!({ "size": size }));
    }

    fn key(&mut self, event: &KeyEvent, typing: bool) {
        let PhysicalKey::Code(code) = event.physical_key else { return };
        let down = event.state == ElementState::Pressed;
        // What is typed into a field is no command, but for the keys that type nothing.
        if typing && down && !FUNCTION_KEYS.contains(&code) {
            return;
        }
        let held = match code {
            KeyCode::KeyW => Some(&mut self.held.forward),
            KeyCode::KeyS => Some(&mut self.held.back),
            KeyCode::KeyA => Some(&mut self.held.left),
            KeyCode::KeyD => Some(&mut self.held.right),
            KeyCode::KeyE => Some(&mut self.held.up),
            KeyCode::KeyQ => Some(&mut self.held.down),
            KeyCode::ShiftLeft | KeyCode::ShiftRight => Some(&mut self.held.fast),
            KeyCode::ControlLeft | KeyCode::ControlRight => Some(&mut self.held.slow),
            _ => None,
        };
        if let Some(held) = held {
            *held = down;
            if down {
                self.stop_playing("stopped");
            }
        }
        if !down {
            return;
        }
        if code == KeyCode::Escape {
            if self.mouse.captured {
                self.free_mouse();
            } else {
                self.hud.close();
            }
            return;
        }
        let wanted = action(code, self.held.fast);
        // Held keys repeat; only what is stepped may repeat with them.
        let steps = matches!(
            wanted,
            Some(Action::Exaggerate(_) | Action::Sun(_) | Action::Fov(_) | Action::Speed(_))
        );
        if let Some(wanted) = wanted.filter(|_| steps || !event.repeat) {
            self.act(wanted);
        }
    }

    fn button(&mut self, button: MouseButton, down: bool, on_panel: bool) {
        match (button, down) {
            (MouseButton::Left, true) if !on_panel => self.clicked(),
            (MouseButton::Middle, true) if !on_panel => {
                let (camera, size) = (self.camera(), self.screen.size());
                let pixel = self.mouse.pixel(size);
                if let Some((point, _)) = pixel.and_then(|p| self.world.under(&camera, p, size)) {
                    self.stop_playing("stopped");
                    self.flyer.begin_orbit(point);
                    self.mouse.orbiting = true;
                }
            }
            (MouseButton::Middle, false) => {
                self.flyer.end_orbit();
                self.mouse.orbiting = false;
            }
            (MouseButton::Right, true) if !on_panel => self.mouse.looking = true,
            (MouseButton::Right, false) => self.mouse.looking = false,
            _ => {}
        }
    }

    /// The first click captures the mouse; a second one at once flies to where both went.
    fn clicked(&mut self) {
        let Some(at) = self.mouse.at else { return };
        let now = Instant::now();
        let before = self.mouse.last_click.replace((now, at));
        let twice = before.is_some_and(|(then, there)| {
            now.duration_since(then) < DOUBLE_CLICK
                && (at.x - there.x).hypot(at.y - there.y) < DOUBLE_CLICK_PX
        });
        if !twice {
            self.capture_mouse();
            return;
        }
        self.mouse.last_click = None;
        self.free_mouse();
        self.fly_to_cursor();
    }

    fn capture_mouse(&mut self) {
        // Which of both is known depends on the window system; without either the cursor may leave the window.
        let grabbed = self.window.set_cursor_grab(CursorGrabMode::Locked);
        if grabbed.or_else(|_| self.window.set_cursor_grab(CursorGrabMode::Confined)).is_err() {
            log::info!("the window system does not hold the cursor in the window");
        }
        self.window.set_cursor_visible(false);
        self.panels.lose_pointer();
        self.mouse.captured = true;
    }

    pub(super) fn free_mouse(&mut self) {
        if self.mouse.captured {
            // It was ours, and letting go of it cannot fail in a way that matters.
            let _ = self.window.set_cursor_grab(CursorGrabMode::None);
            self.window.set_cursor_visible(true);
        }
        self.mouse.captured = false;
        self.mouse.looking = false;
    }

    fn cursor_moved(&mut self, position: PhysicalPosition<f64>) {
        let before = self.mouse.at.replace(position);
        let Some(before) = before.filter(|_| self.mouse.orbiting && !self.mouse.captured) else { return };
        self.orbit([position.x - before.x, position.y - before.y]);
    }

    fn orbit(&mut self, delta_px: [f64; 2]) {
        let (world, size) = (&self.world, self.screen.size());
        let above = |p| world.above(p);
        self.flyer.orbit(delta_px, &world.terrain, size, &Ground { above: &above });
    }

    /// Motion of the mouse itself, whatever the cursor does.
    pub fn mouse_moved(&mut self, delta: (f64, f64)) {
        if !self.mouse.captured && !self.mouse.looking {
            return;
        }
        self.stop_playing("stopped");
        if self.mouse.orbiting {
            self.orbit([delta.0, delta.1]);
        } else {
            self.flyer.look([delta.0, delta.1], self.look.fov_deg);
        }
        self.pace.input();
        self.window.request_redraw();
    }
}
