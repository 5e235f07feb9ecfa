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
    /// Where blocks have deviations only.
    pub deviations: Option<DeviationBuffers>,
    /// Where factors go by error only.
    pub by_error: Option<ByErrorBuffers>,
    /// Where what a frame refills is marked only.
    pub held_before: Option<wgpu::Buffer>,
    /// Where bounds are drawn only.
    pub box_arguments: Option<wgpu::Buffer>,
    /// While culling follows another camera than the one that looks only: the latter's frame.
    pub view_frame: Option<wgpu::Buffer>,
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

/// What errors on screen follow from.
#[derive(Debug)]
#[allow(missing_docs, reason = "named as the bindings, which the shaders document")]
pub struct DeviationBuffers {
    pub choice: wgpu::Buffer,
    pub deviations: wgpu::Buffer,
}

/// What factors by error need besides.
#[derive(Debug)]
#[allow(missing_docs, reason = "named as the bindings, which the shaders document")]
pub struct ByErrorBuffers {
    pub wishes: wgpu::Buffer,
    pub weights: wgpu::Buffer,
    pub grades: wgpu::Buffer,
    pub fresh: wgpu::Buffer,
    pub leaves: wgpu::Buffer,
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
        let deviations = match extent.deviations {
            false => None,
            true => Some(DeviationBuffers {
                choice: make("choice", U::UNIFORM | U::COPY_DST)?,
                deviations: make("deviations", host)?,
            }),
        };
        let held_before = extent.refill.then(|| make("held_before", U::UNIFORM | U::COPY_DST)).transpose()?;
        let box_arguments =
            extent.boxes.then(|| make("box_arguments", U::INDIRECT | U::COPY_DST)).transpose()?;
        let by_error = match extent.by_error {
            false => None,
            true => Some(ByErrorBuffers {
                wishes: make("wishes", U::STORAGE)?,
                weights: make("weights", U::STORAGE)?,
                grades: make("grades", U::STORAGE)?,
                fresh: make("fresh", host)?,
                leaves: make("leaves", U::STORAGE)?,
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
            deviations,
            by_error,
            held_before,
            box_arguments,
            view_frame: None,
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
        if let Some(b) = &self.deviations {
            all.extend([("choice", &b.choice), ("deviations", &b.deviations)]);
        }
        if let Some(b) = &self.by_error {
            all.extend([
                ("wishes", &b.wishes),
                ("weights", &b.weights),
                ("grades", &b.grades),
                ("fresh", &b.fresh),
                ("leaves", &b.leaves),
            ]);
        }
        all.extend(self.held_before.as_ref().map(|b| ("held_before", b)));
        all.extend(self.box_arguments.as_ref().map(|b| ("box_arguments", b)));
        all.extend(self.view_frame.as_ref().map(|b| ("view_frame", b)));
        all
    }

    /// Bytes of all buffers.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.all().iter().map(|(_, b)| b.size()).sum()
    }
}
