//! All GPU memory of a renderer, allocated once; only a reported overflow makes it grow.

use super::device::GpuError;
use super::shaders::Ground;
use super::sizes::{Capacity, Extent, buffer_sizes};
use crate::clipmap::ClipmapShape;

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
    /// Only where patches are culled or voids may fill one.
    pub block_bounds: Option<wgpu::Buffer>,
    pub patches: wgpu::Buffer,
    pub visible_slots: wgpu::Buffer,
    pub counters: wgpu::Buffer,
    pub vertices: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    /// Curved surfaces only.
    pub curved: Option<CurvedBuffers>,
    /// Where factors go by error only.
    pub by_error: Option<ByErrorBuffers>,
    pub capacity: Capacity,
}

/// Bytes of the largest buffer a device with these limits lets a shader bind.
pub(crate) fn most_bytes(limits: &wgpu::Limits) -> u64 {
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

/// What curved surfaces need besides.
#[derive(Debug)]
#[allow(missing_docs, reason = "named as the bindings, which the shaders document")]
pub struct CurvedBuffers {
    pub curve: wgpu::Buffer,
    pub charts: wgpu::Buffer,
    /// Heights on an analytic surface only.
    pub records: Option<wgpu::Buffer>,
    pub anchors: wgpu::Buffer,
    pub shades: wgpu::Buffer,
}

/// What factors by error need besides.
#[derive(Debug)]
#[allow(missing_docs, reason = "named as the bindings, which the shaders document")]
pub struct ByErrorBuffers {
    pub choice: wgpu::Buffer,
    pub deviations: wgpu::Buffer,
    pub wishes: wgpu::Buffer,
    pub weights: wgpu::Buffer,
}

impl Buffers {
    /// Allocates everything for a shape.
    ///
    /// # Errors
    /// When a buffer exceeds what the device allows.
    pub fn new(
        device: &wgpu::Device,
        shape: ClipmapShape,
        extent: Extent,
        capacity: Capacity,
    ) -> Result<Self, GpuError> {
        use wgpu::BufferUsages as U;
        let most = most_bytes(&device.limits());
        let capacity = capacity.fitted(most);
        let sizes = buffer_sizes(shape, extent, capacity);
        let make = |label: &'static str, usage: U| {
            let bytes = sizes.iter().find(|s| s.name == label).map_or(0, |s| s.bytes);
            if bytes > most {
                return Err(GpuError::TooLarge { what: label, bytes, most });
            }
            Ok(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage: usage | U::COPY_SRC,
                mapped_at_creation: false,
            }))
        };
        let host = U::STORAGE | U::COPY_DST;
        let curved = match extent.ground {
            Ground::Plane => None,
            Ground::Curved | Ground::Points => Some(CurvedBuffers {
                curve: make("curve", U::UNIFORM | U::COPY_DST)?,
                charts: make("charts", host)?,
                records: (extent.ground == Ground::Curved).then(|| make("records", host)).transpose()?,
                anchors: make("anchors", host)?,
                shades: make("shades", U::STORAGE | U::VERTEX)?,
            }),
        };
        let by_error = match extent.by_error {
            false => None,
            true => Some(ByErrorBuffers {
                choice: make("choice", U::UNIFORM | U::COPY_DST)?,
                deviations: make("deviations", host)?,
                wishes: make("wishes", U::STORAGE)?,
                weights: make("weights", U::STORAGE)?,
            }),
        };
        Ok(Self {
            frame: make("frame", U::UNIFORM | U::COPY_DST)?,
            control_points: make("control_points", host)?,
            control_quads: make("control_quads", host)?,
            quad_corners: make("quad_corners", host)?,
            staging: make("staging", host)?,
            samples: make("samples", U::STORAGE)?,
            block_bounds: extent.bounds.then(|| make("block_bounds", U::STORAGE)).transpose()?,
            patches: make("patches", host)?,
            visible_slots: make("visible_slots", host)?,
            counters: make("counters", host | U::INDIRECT)?,
            vertices: make("vertices", U::STORAGE | U::VERTEX)?,
            indices: make("indices", U::STORAGE | U::INDEX)?,
            curved,
            by_error,
            capacity,
        })
    }

    /// All buffers with their names.
    #[must_use]
    pub fn all(&self) -> Vec<(&'static str, &wgpu::Buffer)> {
        let mut all = vec![
            ("frame", &self.frame),
            ("control_points", &self.control_points),
            ("control_quads", &self.control_quads),
            ("quad_corners", &self.quad_corners),
            ("staging", &self.staging),
            ("samples", &self.samples),
            ("patches", &self.patches),
            ("visible_slots", &self.visible_slots),
            ("counters", &self.counters),
            ("vertices", &self.vertices),
            ("indices", &self.indices),
        ];
        all.extend(self.block_bounds.as_ref().map(|b| ("block_bounds", b)));
        if let Some(c) = &self.curved {
            all.extend([
                ("curve", &c.curve),
                ("charts", &c.charts),
                ("anchors", &c.anchors),
                ("shades", &c.shades),
            ]);
            all.extend(c.records.as_ref().map(|b| ("records", b)));
        }
        if let Some(b) = &self.by_error {
            all.extend([
                ("choice", &b.choice),
                ("deviations", &b.deviations),
                ("wishes", &b.wishes),
                ("weights", &b.weights),
            ]);
        }
        all
    }

    /// Bytes of all buffers.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.all().iter().map(|(_, b)| b.size()).sum()
    }
}
