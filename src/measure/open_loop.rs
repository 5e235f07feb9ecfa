//! Frames against a schedule: frame k is due k / hz seconds after the start, whatever became of the frames
//! before it.
//!
//! In a closed loop a slow frame keeps the next ones waiting, and their waiting is measured nowhere
//! ("coordinated omission"). Timed from when it was due, a frame that had to wait counts as late as it is.
//! This is arithmetic only; the clock is the caller's.

use serde::Serialize;

use super::FrameStatistics;

/// Share of a period that must be left before the next frame is due for anything but drawing.
const SPARE_SHARE: f64 = 0.25;
/// A start this much after the frame was due is one the frames before are to blame for, not the sleep.
const LATE_START_S: f64 = 1e-3;

/// One frame, in seconds from the start of the flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTimes {
    /// When it should have begun: k / hz. Its camera is the one of this moment.
    pub due_s: f64,
    /// When it began: not before it was due.
    pub start_s: f64,
    /// When the GPU had drawn it.
    pub done_s: f64,
}

/// How late one frame was.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lateness {
    /// From due to done, milliseconds; best the time the frame takes by itself.
    pub response_ms: f64,
    /// Done after the deadline, which is one period after due, milliseconds; 0 in time.
    pub late_ms: f64,
}

/// What an open loop came to.
#[derive(Clone, Debug, Default, Serialize)]
pub struct OpenLoopReport {
    /// Frames due a second.
    pub hz: f64,
    /// Frames done later than one period after they were due; best 0, worst all.
    pub deadline_misses: u64,
    /// Frames begun over 1 ms after they were due, because the ones before were not done; best 0.
    pub late_starts: u64,
    /// From due to done of each frame, milliseconds: corrected for coordinated omission, never less than
    /// `frame_ms`.
    pub response_ms: FrameStatistics,
    /// Most that a frame was done after its deadline, milliseconds; best 0.
    pub worst_late_ms: f64,
}

/// A schedule, and what became of its frames.
#[derive(Clone, Debug)]
pub struct OpenLoop {
    hz: f64,
    responses_ms: Vec<f64>,
    deadline_misses: u64,
    late_starts: u64,
    worst_late_ms: f64,
}

impl OpenLoop {
    /// `hz` frames are due every second.
    #[must_use]
    pub fn new(hz: f64) -> Self {
        Self { hz, responses_ms: Vec::new(), deadline_misses: 0, late_starts: 0, worst_late_ms: 0.0 }
    }

    /// When a frame is due, seconds from the start.
    #[must_use]
    pub fn due_s(&self, frame: u32) -> f64 {
        f64::from(frame) / self.hz
    }

    /// How long to wait from `now_s` on until a frame is due, seconds; 0 when it is late already. Frames are
    /// never skipped.
    #[must_use]
    pub fn wait_s(&self, frame: u32, now_s: f64) -> f64 {
        (self.due_s(frame) - now_s).max(0.0)
    }

    /// Whether there is time to look at counters before the frame `next` is due.
    #[must_use]
    pub fn has_time_before(&self, next: u32, now_s: f64) -> bool {
        self.wait_s(next, now_s) * self.hz >= SPARE_SHARE
    }

    /// Adds a frame.
    pub fn add(&mut self, times: FrameTimes) -> Lateness {
        let late_s = times.done_s - times.due_s - 1.0 / self.hz;
        let lateness =
            Lateness { response_ms: (times.done_s - times.due_s) * 1e3, late_ms: late_s.max(0.0) * 1e3 };
        self.deadline_misses += u64::from(late_s > 0.0);
        self.late_starts += u64::from(times.start_s > times.due_s + LATE_START_S);
        self.worst_late_ms = self.worst_late_ms.max(lateness.late_ms);
        self.responses_ms.push(lateness.response_ms);
        lateness
    }

    /// What it came to so far.
    #[must_use]
    pub fn report(&self) -> OpenLoopReport {
        OpenLoopReport {
            hz: self.hz,
            deadline_misses: self.deadline_misses,
            late_starts: self.late_starts,
            response_ms: FrameStatistics::of(&self.responses_ms),
            worst_late_ms: self.worst_late_ms,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1/64 s: all sums below are exact.
    const PERIOD_S: f64 = 1.0 / 64.0;

    /// Frames that take so many periods, on a clock that only they move.
    fn flown(periods: &[f64]) -> (OpenLoop, Vec<Lateness>) {
        let mut schedule = OpenLoop::new(64.0);
        let mut now_s = 0.0;
        let mut lateness = Vec::new();
        for (frame, takes) in (0_u32..).zip(periods) {
            let start_s = now_s + schedule.wait_s(frame, now_s);
            now_s = start_s + takes * PERIOD_S;
            lateness.push(schedule.add(FrameTimes { due_s: schedule.due_s(frame), start_s, done_s: now_s }));
        }
        (schedule, lateness)
    }

    #[test]
    fn fast_frames_wait_until_they_are_due() {
        let (schedule, lateness) = flown(&[0.5; 100]);
        let report = schedule.report();
        assert_eq!((report.deadline_misses, report.late_starts), (0, 0));
        assert_eq!(report.worst_late_ms, 0.0);
        assert!(lateness.iter().all(|l| l.response_ms == 0.5 * 1e3 * PERIOD_S));
        assert_eq!(report.response_ms.p99, None, "p99 needs 1,000 frames");
    }

    #[test]
    fn one_slow_frame_makes_those_behind_it_late() {
        let mut takes = [0.5; 10];
        takes[2] = 4.0;
        let (schedule, lateness) = flown(&takes);
        let responses: Vec<f64> = lateness.iter().map(|l| l.response_ms / (1e3 * PERIOD_S)).collect();
        assert_eq!(responses, [0.5, 0.5, 4.0, 3.5, 3.0, 2.5, 2.0, 1.5, 1.0, 0.5]);
        let late: Vec<f64> = lateness.iter().map(|l| l.late_ms / (1e3 * PERIOD_S)).collect();
        assert_eq!(late, [0.0, 0.0, 3.0, 2.5, 2.0, 1.5, 1.0, 0.5, 0.0, 0.0]);
        let report = schedule.report();
        // A closed loop would have seen one.
        assert_eq!((report.deadline_misses, report.late_starts), (6, 6));
        assert_eq!(report.worst_late_ms, 3.0 * 1e3 * PERIOD_S);
        assert_eq!(report.response_ms.max, Some(4.0 * 1e3 * PERIOD_S));
    }

    #[test]
    fn frames_slower_than_the_rate_fall_behind_without_end() {
        let (schedule, lateness) = flown(&[2.0; 50]);
        assert_eq!(schedule.report().deadline_misses, 50);
        assert!(lateness.windows(2).all(|l| l[1].late_ms > l[0].late_ms));
    }

    #[test]
    fn there_is_time_only_well_before_the_next_frame() {
        let schedule = OpenLoop::new(64.0);
        assert!(schedule.has_time_before(1, 0.5 * PERIOD_S));
        assert!(schedule.has_time_before(1, 0.75 * PERIOD_S));
        assert!(!schedule.has_time_before(1, 0.875 * PERIOD_S));
        assert!(!schedule.has_time_before(1, 3.0 * PERIOD_S));
    }
}
