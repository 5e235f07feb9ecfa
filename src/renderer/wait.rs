//! Streamed sources seen from outside: waiting until all is there, counters, starting over.

use std::time::{Duration, Instant};

use super::{RenderError, Renderer};
use crate::camera::Camera;
use crate::clipmap::ChartWindows;
use crate::pyramid::StreamCounters;

impl Renderer {
    /// Asks for all that a camera needs and waits until it is there; for pictures, never in a frame.
    /// `false` when the time is up first. Returns at once where nothing is streamed.
    ///
    /// # Errors
    /// When the camera cannot be drawn with, or the cache cannot hold what it needs.
    pub fn wait_complete(&mut self, camera: &Camera, timeout: Duration) -> Result<bool, RenderError> {
        camera.validate()?;
        let source = self.terrain.source.clone();
        let Some(streaming) = source.streaming() else { return Ok(true) };
        let begin = Instant::now();
        loop {
            let target = self.place(camera);
            let wishes = self.wishes(&target);
            let needed = streaming.needs_bytes(&wishes);
            let limit = streaming.counters().limit_bytes;
            if needed > limit {
                return Err(RenderError::CacheTooSmall { needed, limit });
            }
            streaming.wish(&wishes);
            let ready = |target: &ChartWindows| {
                let own = &target.charts[0];
                (own.finest..self.shape.levels()).all(|l| streaming.is_ready(l, &[own.loaded(l)]))
            };
            if ready(&target) {
                return Ok(true);
            }
            if begin.elapsed() > timeout {
                return Ok(false);
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// True when the last prepared frame draws all that its camera wants, nothing standing in for anything.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let streamed = self.terrain.source.streaming().is_some();
        self.state.is_some() && (!streamed || (self.missing_levels == 0 && !self.stream.is_fading()))
    }

    /// What streaming did so far; `None` where nothing is streamed.
    #[must_use]
    pub fn stream_counters(&self) -> Option<StreamCounters> {
        self.terrain.source.streaming().map(|s| s.counters())
    }

    /// How long levels were wanted before they were drawn, milliseconds, since this was last asked.
    pub fn take_need_to_drawn_ms(&mut self) -> Vec<f64> {
        self.stream.take_need_to_drawn_ms()
    }

    /// Empties the tile cache and everything the GPU holds of the terrain: the next frame starts cold.
    pub fn forget_stream(&mut self) {
        if let Some(streaming) = self.terrain.source.clone().streaming() {
            streaming.forget();
            self.forget_windows();
            self.stream.take_need_to_drawn_ms();
        }
    }
}
