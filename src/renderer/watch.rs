//! Figures of frames while flying: read back later, never waited for.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use super::{DrawnSurface, Renderer};
use crate::gpu::{Counters, PatchNodes};

/// Frames that may be on their way back at once; while all are, frames go unwatched.
const IN_FLIGHT: usize = 3;

const FREE: u8 = 0;
const ON_ITS_WAY: u8 = 1;
const MAPPED: u8 = 2;
const FAILED: u8 = 3;

/// What came back of a frame.
#[derive(Clone)]
pub struct Watched {
    /// Its counters.
    pub counters: Counters,
    /// Its surface, as it was drawn.
    pub surface: Option<DrawnSurface>,
}

struct Slot {
    buffer: wgpu::Buffer,
    /// Number of the frame in it.
    frame: u64,
    state: Arc<AtomicU8>,
    surface: Option<DrawnSurface>,
}

/// Read-backs under way.
pub(super) struct Watch {
    slots: Vec<Slot>,
    /// Frames so far.
    recorded: u64,
    /// With its number.
    latest: Option<(u64, Watched)>,
}

/// Frees a slot whose commands were dropped and never submitted.
struct Hold(Arc<AtomicU8>);

impl Drop for Hold {
    fn drop(&mut self) {
        let _ = self.0.compare_exchange(ON_ITS_WAY, FREE, Ordering::AcqRel, Ordering::Acquire);
    }
}

impl Renderer {
    /// From the next recorded frame on, counters (and where factors go by error, the patches' nodes) are
    /// copied for [`Renderer::watched`].
    pub fn watch(&mut self) {
        let bytes = size_of::<Counters>() as u64 + self.watched_node_bytes();
        let slots = (0..IN_FLIGHT).map(|_| Slot {
            buffer: self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("watch"),
                size: bytes.next_multiple_of(8),
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            state: Arc::new(AtomicU8::new(FREE)),
            surface: None,
            frame: 0,
        });
        self.watch = Some(Watch { slots: slots.collect(), recorded: 0, latest: None });
    }

    /// The latest frame whose figures have come back since [`Renderer::watch`]; does not wait. A frame or two
    /// behind what was submitted.
    pub fn watched(&mut self) -> Option<&Watched> {
        // What fails here fails the next submission as well, where it is told.
        let _ = self.device.poll(wgpu::PollType::Poll);
        let watch = self.watch.as_mut()?;
        for slot in &mut watch.slots {
            match slot.state.load(Ordering::Acquire) {
                MAPPED => {}
                FAILED => {
                    slot.state.store(FREE, Ordering::Release);
                    continue;
                }
                _ => continue,
            }
            if let Ok(view) = slot.buffer.slice(..).get_mapped_range() {
                let head = size_of::<Counters>();
                let counters: Counters = bytemuck::pod_read_unaligned(&view[..head]);
                let whole = (view.len() - head) / size_of::<PatchNodes>() * size_of::<PatchNodes>();
                let nodes: Vec<PatchNodes> = bytemuck::pod_collect_to_vec(&view[head..head + whole]);
                let surface = slot.surface.take().map(|s| s.with_records(&nodes));
                // Two may be back at once, in any order.
                if watch.latest.as_ref().is_none_or(|(frame, _)| *frame < slot.frame) {
                    watch.latest = Some((slot.frame, Watched { counters, surface }));
                }
            }
            slot.buffer.unmap();
            slot.state.store(FREE, Ordering::Release);
        }
        watch.latest.as_ref().map(|(_, watched)| watched)
    }

    /// Bytes of patches' nodes that a watched frame brings: of all slots.
    fn watched_node_bytes(&self) -> u64 {
        let a_slot = if self.plan.variant.by_error { size_of::<PatchNodes>() as u64 } else { 0 };
        u64::from(self.patch_slots()) * a_slot
    }

    /// Records the copies of a frame whose passes were recorded before.
    pub(super) fn record_watch(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let node_bytes = self.watched_node_bytes();
        let surface = if self.watch.is_some() { self.drawn_by_windows() } else { return };
        let Some(watch) = &mut self.watch else { return };
        let Some(slot) = watch.slots.iter_mut().find(|s| s.state.load(Ordering::Acquire) == FREE) else {
            return;
        };
        let head = size_of::<Counters>() as u64;
        encoder.copy_buffer_to_buffer(&self.buffers.counters, 0, &slot.buffer, 0, head);
        if let Some(buffers) = &self.buffers.by_error {
            encoder.copy_buffer_to_buffer(&buffers.leaves, 0, &slot.buffer, head, node_bytes);
        }
        watch.recorded += 1;
        slot.frame = watch.recorded;
        slot.surface = surface;
        slot.state.store(ON_ITS_WAY, Ordering::Release);
        let hold = Hold(slot.state.clone());
        encoder.map_buffer_on_submit(&slot.buffer, wgpu::MapMode::Read, .., move |result| {
            hold.0.store(if result.is_ok() { MAPPED } else { FAILED }, Ordering::Release);
        });
    }
}
