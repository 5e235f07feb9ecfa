//! `tessclip view`: a window over the renderer. A host and nothing more: what is drawn is drawn by the library,
//! as in `render` and `fly`.
//!
//! Events come in through `app`, are understood in `input` and `actions`, move the camera in `flyer`, and end in
//! `host`'s one frame after another: input, camera, `world` (terrain and renderers), `hud`, `screen`.

mod actions;
mod app;
mod facts;
mod figures;
mod flyer;
mod host;
mod hud;
mod input;
mod keys;
pub mod look;
mod overlay;
mod pace;
mod panels;
mod recorder;
mod replay;
mod screen;
mod shot;
mod status;
#[cfg(test)]
mod tests;
mod world;

use std::path::PathBuf;

use anyhow::{Context as _, anyhow};
use tessclip::Terrain;
use winit::event_loop::EventLoop;

use self::app::App;
use self::look::Look;
use crate::cli::args::TerrainArgs;
use crate::cli::view::Vsync;

/// What the window opens with.
pub struct Start {
    /// As it was asked for, for the lines and scenes that are written.
    pub terrain_args: TerrainArgs,
    /// With its own heights: the look exaggerates them.
    pub terrain: Terrain,
    pub look: Look,
    /// None for one that sees everything.
    pub pose: Option<[f64; 5]>,
    /// Played from the start.
    pub path: Option<String>,
    pub vsync: Vsync,
    /// Events are printed.
    pub state: bool,
    /// Frames to draw before it ends by itself.
    pub frames: Option<u32>,
    /// Where screenshots, paths and scenes go.
    pub out: PathBuf,
    /// Of the window, pixels at scale 1.
    pub size: [u32; 2],
    /// For tests: the device is destroyed before this frame.
    pub lose_device_at: Option<u32>,
    /// Without panels.
    pub no_hud: bool,
}

/// Runs until the window is closed.
pub fn run(start: Start) -> anyhow::Result<()> {
    let events = EventLoop::new().map_err(|error| {
        let named = ["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(|name| std::env::var_os(name).is_some());
        // The error's own words begin with a place in its source.
        let words = error.to_string();
        let why = words.split_once(": ").filter(|_| named).map_or("", |(_, why)| why);
        anyhow!(
            "no window can be opened here: {why}{}let DISPLAY or WAYLAND_DISPLAY name a window system that runs, or take \
             tessclip render or fly, which need none",
            if why.is_empty() { "" } else { "; " }
        )
    })?;
    let mut app = App::new(start);
    events.run_app(&mut app).context("the window system ended the program")?;
    app.failed.map_or(Ok(()), Err)
}
