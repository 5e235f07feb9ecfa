//! Which levels are drawn while samples are still on their way.
//!
//! A level is drawn when every sample of its window is there; from the first one that is not, finer levels
//! are left out and the coarser one fills their place, so every mesh conforms. The coarsest level is always
//! drawn. With the same samples there, the same camera gives the same mesh, as everywhere.

use std::time::Instant;

use super::Renderer;
use crate::clipmap::{ChartWindows, MAX_LEVELS, Rect, stale};
use crate::measure::FrameUpload;
use crate::pyramid::LevelWish;

/// Frames over which a level that returns grows out of the coarser one's surface, where geomorph is on.
const FADE_FRAMES: f32 = 16.0;
/// Seconds of motion for which tiles are asked for ahead.
const AHEAD_S: f64 = 1.0;
/// A camera that moves further than this in one frame was put elsewhere: windows of the finest level.
const JUMP_WINDOWS: f64 = 8.0;

/// What streaming remembers from frame to frame.
#[derive(Default)]
pub(super) struct StreamState {
    /// How much of the coarser surface each level still shows, 1 to 0.
    pub fades: [f32; MAX_LEVELS as usize],
    /// Windows of the last frame, as drawn.
    before: Option<ChartWindows>,
    /// Since when each level is wanted and not drawn.
    waits: [Option<Instant>; MAX_LEVELS as usize],
    need_to_drawn_ms: Vec<f64>,
    /// True when the coarsest level on the GPU holds stand-ins for samples that were not there.
    provisional: bool,
    /// The same for the frame that is prepared.
    next_provisional: bool,
    /// The coarsest level is sent again in this frame, because what stood in has arrived.
    pub refreshes: bool,
    place: Option<([f64; 2], Instant)>,
    /// Base samples a second, smoothed.
    velocity: [f64; 2],
}

impl StreamState {
    /// The frame was recorded: what it uploaded is there.
    pub fn commit(&mut self) {
        self.provisional = self.next_provisional;
    }

    /// Nothing is on the GPU any more.
    pub fn forget(&mut self) {
        *self = Self { need_to_drawn_ms: std::mem::take(&mut self.need_to_drawn_ms), ..Self::default() };
    }

    pub fn take_need_to_drawn_ms(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.need_to_drawn_ms)
    }

    /// True while any level still grows out of the coarser one.
    pub fn is_fading(&self) -> bool {
        self.fades.iter().any(|f| *f > 0.0)
    }

    /// Follows the camera: its velocity, and whether it jumped.
    fn follow(&mut self, centre: [f64; 2], window: f64, now: Instant) {
        let mut velocity = [0.0; 2];
        if let Some((before, then)) = self.place {
            let seconds = now.duration_since(then).as_secs_f64();
            let moved = [0, 1].map(|a| centre[a] - before[a]);
            if seconds <= 0.0 {
                return;
            }
            if moved[0].hypot(moved[1]) >= JUMP_WINDOWS * window {
                // What was awaited elsewhere is not wanted any more.
                self.waits = Default::default();
            } else {
                // One slow frame should not send the loaders far ahead.
                velocity = [0, 1].map(|a| 0.7 * self.velocity[a] + 0.3 * moved[a] / seconds.max(1e-3));
            }
        }
        self.velocity = velocity;
        self.place = Some((centre, now));
    }
}

impl Renderer {
    /// Asks for what the windows need and lets go of the levels that are not there yet. Planes only: other
    /// bases have all samples in memory.
    pub(super) fn follow_stream(
        &mut self,
        mut target: ChartWindows,
        upload: &mut FrameUpload,
    ) -> ChartWindows {
        let levels = self.shape.levels();
        let Some(source) = self.terrain.source.streaming().map(|_| self.terrain.source.clone()) else {
            upload.levels_drawn = target.charts.iter().map(|c| levels - c.finest).max().unwrap_or(0);
            return target;
        };
        let Some(streaming) = source.streaming() else { return target };
        let now = Instant::now();
        self.stream.follow(target.centres[0], f64::from(self.shape.cells()), now);
        target.charts[0].sleeps = true;
        let own = &target.charts[0];
        streaming.wish(&self.wishes(&target));

        // From the coarsest on, as far as samples and the upload budget of this frame reach.
        let sample_bytes = self.plan.variant.extent().staged_bytes();
        let window_bytes = (u64::from(self.shape.cells()) + 1).pow(2) * sample_bytes;
        let budget = streaming.upload_bytes_per_frame().max(2 * window_bytes);
        let mut spent = 0;
        let mut finest = levels;
        let mut refresh = false;
        self.stream.next_provisional = self.stream.provisional;
        for level in (own.finest..levels).rev() {
            let held = self.held_window(0, level);
            let rects = stale(held, own, level);
            let bytes = rects.iter().map(|r| r.count()).sum::<u64>() * sample_bytes;
            if level + 1 == levels {
                spent += bytes;
                let whole = streaming.is_ready(level, &[own.loaded(level)]);
                if self.stream.provisional && whole {
                    refresh = true;
                    spent += window_bytes;
                }
                let stands_in = !whole && (self.stream.provisional || !streaming.is_ready(level, &rects));
                self.stream.next_provisional = stands_in;
                finest = level;
                continue;
            }
            // Levels grow out of each other one after the other: two at once would show neither.
            let coarser_grows = self.scene.morph && self.stream.fades[level as usize + 1] > 0.0;
            if coarser_grows || spent + bytes > budget || !streaming.is_ready(level, &rects) {
                break;
            }
            spent += bytes;
            finest = level;
            if self.scene.morph && self.begins_to_grow(level, &target) {
                self.stream.fades[level as usize] = 1.0;
                break;
            }
        }
        self.stream.refreshes = refresh;
        if refresh && let Some(held) = self.resident.get_mut(0) {
            held[levels as usize - 1] = None;
        }
        self.settle(finest, target.charts[0].finest, now);
        upload.levels_missing = finest - target.charts[0].finest + u32::from(self.stream.next_provisional);
        upload.levels_drawn = levels - finest;
        target.charts[0].finest = finest;
        self.stream.before = Some(target.clone());
        target
    }

    /// The window whose samples a level holds on the GPU.
    pub(super) fn held_window(&self, chart: usize, level: u32) -> Option<Rect> {
        let lo = (*self.resident.get(chart)?.get(level as usize)?)?;
        let side = i32::try_from(self.shape.cells()).unwrap_or(i32::MAX);
        Some(Rect { lo, hi: [lo[0] + side, lo[1] + side] })
    }

    /// All that a camera needs of a streamed source: the drawn levels, and the next finer one as near.
    pub(super) fn wishes(&self, target: &ChartWindows) -> Vec<LevelWish> {
        let own = &target.charts[0];
        let from = own.finest.saturating_sub(1);
        (from..self.shape.levels())
            .map(|level| LevelWish {
                level,
                needed: own.loaded(level),
                ahead: self.stream.velocity.map(|v| v * AHEAD_S / f64::from(1_u32 << level)),
                now: level >= own.finest,
            })
            .collect()
    }

    /// True when a level was not drawn in the last frame, although the ground it covers was.
    fn begins_to_grow(&self, level: u32, target: &ChartWindows) -> bool {
        let Some(before) = self.stream.before.as_ref() else { return false };
        let (was, is) = (&before.charts[0], &target.charts[0]);
        // Where the last picture showed other ground, there is nothing to grow out of.
        let seen = was.loaded(was.finest).intersect(is.loaded(was.finest));
        level < was.finest && !seen.is_empty()
    }

    /// Lets levels grow on, and counts how long those waited that are drawn now.
    fn settle(&mut self, finest: u32, wanted: u32, now: Instant) {
        let was = self.stream.before.as_ref().map(|b| b.charts[0].finest);
        for level in 0..self.shape.levels() {
            let ix = level as usize;
            if level < finest {
                self.stream.fades[ix] = 0.0;
            } else if was.is_some_and(|was| level >= was) {
                self.stream.fades[ix] = (self.stream.fades[ix] - 1.0 / FADE_FRAMES).max(0.0);
            }
            if level < wanted {
                self.stream.waits[ix] = None;
            } else if level < finest {
                self.stream.waits[ix].get_or_insert(now);
            } else if let Some(since) = self.stream.waits[ix].take() {
                self.stream.need_to_drawn_ms.push(now.duration_since(since).as_secs_f64() * 1e3);
            }
        }
    }
}
