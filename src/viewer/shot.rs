//! Screenshots: the frame once more into a picture of our own.

use serde_json::json;
use tessclip::gpu::Offscreen;

use super::host::Host;
use super::recorder::write_new;
use crate::cli::args::pose_words;
use crate::cli::png_pose::{CAMERA, RENDER, SOFTWARE, TERRAIN, write_png_with};

impl Host {
    /// Writes the frame that was just drawn, with the panels or without, and tells where.
    pub(super) fn shoot(&mut self, with_panels: bool, size: [u32; 2]) -> anyhow::Result<()> {
        let gpu = self.screen.gpu.clone();
        let plain = Some(self.screen.plain).filter(|plain| *plain != self.screen.format);
        let target = Offscreen::with_format(&gpu.device, size, self.screen.format, plain)?;
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.world.record(&mut encoder, [&target.color, &target.depth], size);
        if with_panels {
            self.panels.put(&mut encoder, target.texture(), &target.seen_as(self.screen.plain));
        }
        gpu.queue.submit([encoder.finish()]);
        let rgba = target.read_rgba(&gpu.device, &gpu.queue)?;
        let (pose, line) = (pose_words(self.flyer.pose()), self.line("view.png"));
        let terrain = &self.start.terrain_args.terrain;
        let text = [SOFTWARE, (CAMERA, pose.as_str()), (TERRAIN, terrain.as_str()), (RENDER, line.as_str())];
        let write = |path: &std::path::Path| write_png_with(path, &rgba, size, &text);
        let path = write_new(&self.start.out, "tessclip", "png", write)?;
        self.tell("screenshot", json!({ "path": path, "size": size }));
        self.say(format!("saved {}", path.display()));
        Ok(())
    }
}
