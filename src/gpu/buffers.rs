//! All GPU memory of a renderer, allocated once; only a reported overflow makes it grow.

use super::device::GpuError;
use super::layouts::{Counters, GpuControlQuad, GpuFrame, PatchRecord};
use crate::clipmap::ClipmapShape;
use crate::quads::{CONTROL_POINTS, PATCH_CELLS, QUADS_PER_LEVEL, slots_per_level};

/// Room for expanded vertices and indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// Vertices, 16 bytes each.
    pub vertices: u32,
    /// Indices, 4 bytes each.
    pub indices: u32,
}

impl Capacity {
    /// Room for every patch of every level at once: nothing can be dropped.
    #[must_use]
    pub fn worst_case(shape: ClipmapShape) -> Self {
        let cells = u64::from(shape.n() - 1).pow(2);
        let ring = cells - u64::from(2 * shape.m() + 1).pow(2);
        let all = cells + ring * u64::from(shape.levels() - 1);
        let slots = u64::from(slots_per_level(shape) * shape.levels());
        // A patch adds one row and column of vertices and at most one doubled cell a side: 4 x 16.
        let per_patch = u64::from(4 * PATCH_CELLS + 1 + 2 * PATCH_CELLS);
        let clamp = |v: u64| u32::try_from(v).unwrap_or(u32::MAX);
        Self {
            vertices: clamp(all + slots * per_patch),
            indices: clamp(3 * (2 * all + u64::from(8 * shape.n()) * u64::from(shape.levels()))),
        }
    }

    fn fitted(self, limits: &wgpu::Limits) -> Self {
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let clamp = |v: u64| u32::try_from(v).unwrap_or(u32::MAX);
        Self {
            vertices: self.vertices.min(clamp(most / 16)).max(1),
            indices: self.indices.min(clamp(most / 4)).max(3),
        }
    }
}

/// The buffers, named as in the shaders.
#[derive(Debug)]
#[allow(missing_docs, reason = "named as the bindings, which the shaders document")]
pub struct Buffers {
    pub frame: wgpu::Buffer,
    pub control_points: wgpu::Buffer,
    pub control_quads: wgpu::Buffer,
    pub quad_corners: wgpu::Buffer,
    pub staging: wgpu::Buffer,
    pub samples: wgpu::Buffer,
    pub block_bounds: wgpu::Buffer,
    pub patches: wgpu::Buffer,
    pub visible_slots: wgpu::Buffer,
    pub counters: wgpu::Buffer,
    pub vertices: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    pub capacity: Capacity,
}

impl Buffers {
    /// Allocates everything for a shape.
    ///
    /// # Errors
    /// When a buffer exceeds what the device allows.
    pub fn new(device: &wgpu::Device, shape: ClipmapShape, capacity: Capacity) -> Result<Self, GpuError> {
        use wgpu::BufferUsages as U;
        let limits = device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let capacity = capacity.fitted(&limits);
        let make = |label: &'static str, bytes: u64, usage: U| {
            if bytes > most {
                return Err(GpuError::TooLarge { what: label, bytes, most });
            }
            Ok(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes.max(16),
                usage: usage | U::COPY_SRC,
                mapped_at_creation: false,
            }))
        };
        let levels = u64::from(shape.levels());
        let side = u64::from(shape.n()) + 1;
        let slots = u64::from(slots_per_level(shape)) * levels;
        let host = U::STORAGE | U::COPY_DST;
        Ok(Self {
            frame: make("frame", size_of::<GpuFrame>() as u64, U::UNIFORM | U::COPY_DST)?,
            control_points: make("control_points", levels * CONTROL_POINTS as u64 * 4, host)?,
            control_quads: make(
                "control_quads",
                (QUADS_PER_LEVEL * size_of::<GpuControlQuad>()) as u64,
                host,
            )?,
            quad_corners: make("quad_corners", levels * QUADS_PER_LEVEL as u64 * 4, host)?,
            staging: make("staging", levels * side * side * 4 + levels * 32, host)?,
            samples: make("samples", levels * side * side * 4, U::STORAGE)?,
            block_bounds: make("block_bounds", levels * (side / 8).pow(2) * 8, U::STORAGE)?,
            patches: make("patches", slots * size_of::<PatchRecord>() as u64, host)?,
            visible_slots: make("visible_slots", slots * 4, host)?,
            counters: make("counters", size_of::<Counters>() as u64, host | U::INDIRECT)?,
            vertices: make("vertices", u64::from(capacity.vertices) * 16, U::STORAGE | U::VERTEX)?,
            indices: make("indices", u64::from(capacity.indices) * 4, U::STORAGE | U::INDEX)?,
            capacity,
        })
    }

    /// Buffer bound at `binding` in every shader; one number a buffer throughout.
    #[must_use]
    pub fn all(&self) -> [&wgpu::Buffer; 12] {
        [
            &self.frame,
            &self.control_points,
            &self.control_quads,
            &self.quad_corners,
            &self.staging,
            &self.samples,
            &self.block_bounds,
            &self.patches,
            &self.visible_slots,
            &self.counters,
            &self.vertices,
            &self.indices,
        ]
    }

    /// Bytes of all buffers.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.all().iter().map(|b| b.size()).sum()
    }
}
