//! Time: frames, what was sent by seconds, and how old the input is that a frame shows.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::facts::KEPT_FRAMES;

/// Over which rates are told.
const RATE_OVER: Duration = Duration::from_secs(1);
/// Frames drawn after everything came to rest, so that the figures of the last moving one come back.
const SETTLING: u32 = 4;

/// Sums over the last second.
#[derive(Default)]
pub struct Rate {
    recent: VecDeque<(Instant, u64)>,
}

impl Rate {
    /// Adds an amount and gives how much came in a second.
    pub fn add(&mut self, now: Instant, amount: u64) -> f64 {
        self.recent.push_back((now, amount));
        while self.recent.front().is_some_and(|(at, _)| now.duration_since(*at) > RATE_OVER) {
            self.recent.pop_front();
        }
        let sum: u64 = self.recent.iter().map(|(_, amount)| amount).sum();
        sum as f64 / RATE_OVER.as_secs_f64()
    }
}

/// A submitted frame that may not be done yet.
struct InFlight {
    submission: wgpu::SubmissionIndex,
    /// The oldest input that it shows.
    input: Option<Instant>,
}

/// The clock of the window.
pub struct Pace {
    epoch: Instant,
    /// Of frames drawn one after another, oldest first, milliseconds.
    pub frame_ms: VecDeque<f32>,
    /// Frames presented.
    pub frames: u64,
    last: Option<Instant>,
    in_flight: Option<InFlight>,
    oldest_input: Option<Instant>,
    /// From the oldest input to the end of the frame that shows it, milliseconds: of the last one, and the most
    /// since this was last told.
    pub input_ms: [f64; 2],
    settling: u32,
    /// What the panels took of the last frames, CPU and GPU, milliseconds.
    panels_ms: VecDeque<f64>,
}

impl Pace {
    pub fn new() -> Self {
        Self {
            epoch: Instant::now(),
            frame_ms: VecDeque::with_capacity(KEPT_FRAMES),
            frames: 0,
            last: None,
            in_flight: None,
            oldest_input: None,
            input_ms: [0.0; 2],
            settling: SETTLING,
            panels_ms: VecDeque::with_capacity(KEPT_FRAMES),
        }
    }

    /// What the panels took of a frame, milliseconds.
    pub fn panels(&mut self, ms: f64) {
        if self.panels_ms.len() == KEPT_FRAMES {
            self.panels_ms.pop_front();
        }
        self.panels_ms.push_back(ms);
    }

    /// The mean of that: only some frames lay panels out. None where they were not shown.
    pub fn panels_ms(&self) -> Option<f64> {
        let count = self.panels_ms.len() as f64;
        (count > 0.0).then(|| self.panels_ms.iter().sum::<f64>() / count)
    }

    /// Mean time of the same frames, milliseconds.
    pub fn mean_ms(&self) -> Option<f64> {
        let count = self.frame_ms.len() as f64;
        (count > 0.0).then(|| self.frame_ms.iter().map(|ms| f64::from(*ms)).sum::<f64>() / count)
    }

    /// Seconds since the window was opened.
    pub fn now_s(&self) -> f64 {
        self.epoch.elapsed().as_secs_f64()
    }

    /// Something happened that the next frame shows.
    pub fn input(&mut self) {
        self.oldest_input.get_or_insert_with(Instant::now);
        self.stir();
    }

    /// Something changed: frames are drawn until it has settled.
    pub fn stir(&mut self) {
        self.settling = SETTLING;
    }

    /// Waits until the frame before is done: what is drawn next is never more than one frame ahead of what is
    /// seen, however fast frames could be queued.
    pub fn wait(&mut self, device: &wgpu::Device) -> Result<(), wgpu::PollError> {
        let Some(InFlight { submission, input }) = self.in_flight.take() else { return Ok(()) };
        device.poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: None })?;
        if let Some(at) = input {
            let ms = at.elapsed().as_secs_f64() * 1e3;
            self.input_ms = [ms, self.input_ms[1].max(ms)];
        }
        Ok(())
    }

    /// The device that the last frame went to is gone.
    pub fn forget_submission(&mut self) {
        self.in_flight = None;
        self.stir();
    }

    /// Begins a frame; seconds since the one before, 0 after a rest.
    pub fn begin(&mut self) -> f64 {
        let now = Instant::now();
        let since = self.last.replace(now).map(|last| now.duration_since(last).as_secs_f64());
        if let Some(s) = since {
            if self.frame_ms.len() == KEPT_FRAMES {
                self.frame_ms.pop_front();
            }
            self.frame_ms.push_back((s * 1e3) as f32);
        }
        since.unwrap_or(0.0)
    }

    /// True when the frame that begins is the last one unless something moves.
    pub fn is_last(&self) -> bool {
        self.settling <= 1
    }

    /// Ends a frame that was submitted. `goes_on` when something still moves; true when another frame follows.
    pub fn end(&mut self, submission: wgpu::SubmissionIndex, goes_on: bool) -> bool {
        self.in_flight = Some(InFlight { submission, input: self.oldest_input.take() });
        self.frames += 1;
        self.settling = if goes_on { SETTLING } else { self.settling.saturating_sub(1) };
        let more = self.settling > 0;
        if !more {
            // The time until something moves again is no frame.
            self.last = None;
        }
        more
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_forget_what_is_older_than_a_second() {
        let mut rate = Rate::default();
        let t = Instant::now();
        assert_eq!(rate.add(t, 100), 100.0);
        assert_eq!(rate.add(t + Duration::from_millis(900), 50), 150.0);
        assert_eq!(rate.add(t + Duration::from_millis(1100), 1), 51.0);
        assert_eq!(rate.add(t + Duration::from_secs(9), 0), 0.0);
    }

    #[test]
    fn a_rest_is_no_frame() {
        let mut pace = Pace::new();
        assert_eq!(pace.begin(), 0.0);
        std::thread::sleep(Duration::from_millis(3));
        assert!(pace.begin() >= 0.003);
        assert_eq!(pace.frame_ms.len(), 1);
        pace.last = None;
        assert_eq!(pace.begin(), 0.0);
        assert_eq!(pace.frame_ms.len(), 1);
        for _ in 0..2 * KEPT_FRAMES {
            pace.begin();
        }
        assert_eq!(pace.frame_ms.len(), KEPT_FRAMES);
    }
}
