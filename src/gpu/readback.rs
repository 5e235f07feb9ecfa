//! Reading buffers back: for meshes, checks and reports, never inside a frame.

use super::device::GpuError;
use super::layouts::{Counters, PatchNodes, PatchRecord};
use crate::quads::Patch;
use crate::reference::Vertex;

/// The mesh exactly as the GPU made and drew it.
#[derive(Clone, Debug)]
pub struct GpuMesh {
    /// World position of the anchor in metres; add it to vertex positions in f64.
    pub anchor_m: [f64; 3],
    /// Expanded vertices, in metres from the anchor.
    pub vertices: Vec<Vertex>,
    /// Triangles in draw order; those over void samples are collapsed to one vertex.
    pub triangles: Vec<[u32; 3]>,
    /// Records of the visible patches, in draw order.
    pub patches: Vec<PatchRecord>,
    /// Which vertices they have, in the same order, where factors go by error; else none.
    pub nodes: Vec<PatchNodes>,
    /// Counters of the frame.
    pub counters: Counters,
}

impl GpuMesh {
    /// The visible patches with their factors, in draw order.
    #[must_use]
    pub fn drawn(&self) -> Vec<Patch> {
        if self.nodes.is_empty() {
            return self.patches.iter().map(PatchRecord::patch).collect();
        }
        self.nodes.iter().map(PatchNodes::patch).collect()
    }
}

/// Reads the first `count` elements of a buffer; waits for the GPU.
///
/// # Errors
/// When the device fails or is lost.
pub fn read_buffer<T: bytemuck::Pod>(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    buffer: &wgpu::Buffer,
    count: usize,
) -> Result<Vec<T>, GpuError> {
    let bytes = (count * size_of::<T>()) as u64;
    if bytes == 0 {
        return Ok(Vec::new());
    }
    let copy = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("readback"),
        size: bytes,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, bytes);
    queue.submit([encoder.finish()]);
    let data = mapped(device, &copy)?;
    Ok(bytemuck::pod_collect_to_vec(&data))
}

/// Bytes of a mappable buffer; waits for the GPU.
pub(crate) fn mapped(device: &wgpu::Device, buffer: &wgpu::Buffer) -> Result<Vec<u8>, GpuError> {
    let failed = |reason: String| GpuError::Readback { reason };
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
        // The receiver only goes away when this function has already failed.
        let _ = sender.send(result);
    });
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| failed(e.to_string()))?;
    receiver.recv().map_err(|e| failed(e.to_string()))?.map_err(|e| failed(e.to_string()))?;
    let view = buffer.slice(..).get_mapped_range().map_err(|e| failed(e.to_string()))?;
    let bytes = view.to_vec();
    drop(view);
    buffer.unmap();
    Ok(bytes)
}
