//! One flight of one method: made anew, warmed up, timed frame by frame; looked at between the frames.

use std::time::Instant;

use anyhow::{Context as _, bail};
use tessclip::gpu::{Gpu, Offscreen};
use tessclip::measure::UploadLedger;
use tessclip::rivals::{Lab, Rival};
use tessclip::{Camera, Target};

use super::super::paths::Course;
use super::settings::Setting;

/// Frames drawn before the first measured one, to compile pipelines and touch memory.
const WARM_UP: u32 = 3;
/// Fewest frames of a flight all the same.
const FEWEST_FRAMES: u32 = 8;

/// A measured frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Number on the path.
    pub number: u32,
    pub frame_ms: f64,
    pub cpu_ms: f64,
    pub control_bytes: u64,
    pub height_bytes: u64,
    pub vertex_bytes: u64,
    pub index_bytes: u64,
    pub triangles: u64,
    pub draw_calls: u64,
}

/// A measured flight.
pub struct FlightLog {
    pub frames: Vec<Frame>,
    pub ledger: UploadLedger,
    /// Flew every k-th frame.
    pub every: u32,
    pub gpu_bytes: u64,
    pub cpu_bytes: u64,
}

/// Where flights take place.
pub struct Range<'a> {
    pub gpu: &'a Gpu,
    pub lab: &'a Lab,
    pub target: &'a Offscreen,
    pub fov_deg: f64,
    /// A flight that would take longer flies every k-th frame only: brute force over large data.
    pub longest_flight_ms: f64,
}

impl Range<'_> {
    /// Flies a course with a method made for it: every k-th frame, where that is known from a flight before.
    pub fn fly(&self, setting: &Setting, course: &Course, every: Option<u32>) -> anyhow::Result<FlightLog> {
        let mut rival = self.make(setting)?;
        let (_, start) = course.at(0, self.fov_deg);
        let mut ledger = UploadLedger::default();
        let mut last_ms = 0.0;
        for k in 0..WARM_UP {
            let begin = Instant::now();
            let upload = self.draw(rival.as_mut(), &start)?.0;
            last_ms = ms(begin);
            if k == 0 {
                ledger.add(&upload);
            }
        }
        let frames = course.tempo.frames;
        let every = every.unwrap_or_else(|| stride(last_ms, frames, self.longest_flight_ms));
        let mut log = FlightLog { frames: Vec::new(), ledger, every, gpu_bytes: 0, cpu_bytes: 0 };
        for number in (0..frames).step_by(every as usize) {
            let (_, camera) = course.at(number, self.fov_deg);
            let begin = Instant::now();
            let (upload, cpu_ms) = self.draw(rival.as_mut(), &camera)?;
            let frame_ms = ms(begin);
            if self.gpu.is_lost() {
                bail!("the GPU device was lost");
            }
            let count = rival.count()?;
            log.ledger.add(&upload);
            log.gpu_bytes = log.gpu_bytes.max(rival.gpu_bytes());
            log.frames.push(Frame {
                number,
                frame_ms,
                cpu_ms,
                control_bytes: upload.control_bytes,
                height_bytes: upload.height_bytes,
                vertex_bytes: upload.vertex_bytes,
                index_bytes: upload.index_bytes,
                triangles: count.triangles,
                draw_calls: count.draw_calls,
            });
        }
        log.cpu_bytes = rival.cpu_bytes();
        Ok(log)
    }

    /// The method, ready to draw.
    pub fn make(&self, setting: &Setting) -> anyhow::Result<Box<dyn Rival>> {
        let made = self.lab.make(setting.method, &setting.detail);
        made.with_context(|| setting.method.name())
    }

    /// Draws a frame and waits for it; what was sent, and the CPU's milliseconds until it was submitted.
    pub fn draw(
        &self,
        rival: &mut dyn Rival,
        camera: &Camera,
    ) -> anyhow::Result<(tessclip::measure::FrameUpload, f64)> {
        let begin = Instant::now();
        let upload = rival.prepare(camera, self.target.size)?;
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let (color, depth) = (&self.target.color, &self.target.depth);
        rival.record(&mut encoder, Target { color, depth, clear: true, area: None });
        self.gpu.queue.submit([encoder.finish()]);
        let cpu_ms = ms(begin);
        self.gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok((upload, cpu_ms))
    }
}

/// Every how many frames a method flies, by the time a frame took it.
fn stride(frame_ms: f64, frames: u32, longest_ms: f64) -> u32 {
    let most = (frames / FEWEST_FRAMES).max(1);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let k = (frame_ms * f64::from(frames) / longest_ms).ceil().clamp(1.0, f64::from(most)) as u32;
    k
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::stride;

    #[test]
    fn slow_methods_fly_fewer_frames_and_never_too_few() {
        assert_eq!(stride(10.0, 200, 2e4), 1);
        assert_eq!(stride(500.0, 200, 2e4), 5);
        assert_eq!(stride(1e9, 200, 2e4), 25);
        assert_eq!(stride(1e9, 10, 2e4), 1);
    }
}
