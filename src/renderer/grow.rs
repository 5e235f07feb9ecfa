//! More room for the mesh, when a frame's counters say that it was short.

use super::{RenderError, Renderer};
use crate::gpu::{Buffers, Capacity, Counters, GpuError, most_bytes};

impl Renderer {
    /// Makes room for what a frame needed, when its counters say that patches were dropped. Returns
    /// whether it grew; the caller draws the frame again.
    ///
    /// # Errors
    /// When the device does not allow that much.
    pub fn grow(&mut self, counters: &Counters) -> Result<bool, RenderError> {
        if counters.patches_dropped == 0 {
            return Ok(false);
        }
        let wanted = Capacity { vertices: counters.vertices_needed, indices: counters.indices_needed };
        let buffers = Buffers::new(&self.device, self.shape, self.plan.variant.extent(), wanted)?;
        let got = buffers.capacity;
        if got.vertices < wanted.vertices || got.indices < wanted.indices {
            return Err(RenderError::Gpu(GpuError::TooLarge {
                what: "the visible mesh",
                bytes: (u64::from(wanted.vertices) * 16).max(u64::from(wanted.indices) * 4),
                most: most_bytes(&self.device.limits()),
            }));
        }
        self.buffers = buffers;
        self.plan.resize(self.shape, got);
        for pass in &mut self.passes {
            pass.rebind(&self.device, &self.buffers);
        }
        self.make_view_frame();
        self.rebind_draws();
        self.send_box_arguments();
        if self.watch.is_some() {
            self.watch();
        }
        // The new buffers are empty: everything is sent again with the next frame.
        self.forget_windows();
        Ok(true)
    }

    /// Nothing of any window lies on the GPU any more.
    pub(super) fn forget_windows(&mut self) {
        self.state = None;
        self.resident.clear();
        self.described.clear();
        self.stream.forget();
        if let Some(curve) = &mut self.curve {
            curve.forget();
        }
    }
}
