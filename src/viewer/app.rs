//! The event loop: opens the window when the system allows it, and hands events on.

use winit::application::ApplicationHandler;
use winit::event::{DeviceEvent, DeviceId, StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::WindowId;

use super::Start;
use super::host::Host;

/// What the event loop runs.
pub struct App {
    start: Option<Start>,
    host: Option<Host>,
    /// Why it ended, when not as it was asked to.
    pub failed: Option<anyhow::Error>,
}

impl App {
    pub fn new(start: Start) -> Self {
        Self { start: Some(start), host: None, failed: None }
    }

    /// Ends the program on a failure.
    fn check(&mut self, events: &ActiveEventLoop, done: anyhow::Result<()>) {
        if let Err(error) = done {
            self.failed = Some(error);
            events.exit();
        }
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(start) = self.start.take() else { return };
        let opened = Host::open(events, start).map(|host| self.host = Some(host));
        self.check(events, opened);
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        if let (StartCause::ResumeTimeReached { .. }, Some(host)) = (cause, &mut self.host) {
            host.redraw();
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(host) = &mut self.host else { return };
        let done = match event {
            WindowEvent::RedrawRequested => host.frame(),
            event => host.window_event(&event),
        };
        if host.quits {
            events.exit();
        }
        self.check(events, done);
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        if let (DeviceEvent::MouseMotion { delta }, Some(host)) = (event, &mut self.host) {
            host.mouse_moved(delta);
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Some(host) = &mut self.host else { return };
        // Drawing on is asked for by the window's own redraw event; here only a later time is waited for.
        events.set_control_flow(host.redraw_at().map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        if let Some(host) = self.host.take() {
            host.end();
        }
    }
}
