//! All GPU memory of a renderer, allocated once; only a reported overflow makes it grow.

use super::curve::{GpuChart, GpuCurve};
use super::device::GpuError;
use super::layouts::{Counters, GpuControlQuad, GpuFrame, PatchRecord};
use super::shaders::Ground;
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
    /// Room for every patch of every level at once: nothing can be dropped on one chart. Of glued charts,
    /// the one under the camera draws whole windows and those around it no more than halves: three times
    /// one chart's room is ample, and a reported overflow makes it grow all the same.
    #[must_use]
    pub fn worst_case(shape: ClipmapShape, charts: u32) -> Self {
        let cells = u64::from(shape.n() - 1).pow(2);
        let ring = cells - u64::from(2 * shape.m() + 1).pow(2);
        let all = cells + ring * u64::from(shape.levels() - 1);
        let slots = u64::from(slots_per_level(shape) * shape.levels());
        // A patch adds one row and column of vertices and at most one doubled cell a side: 4 x 16.
        let per_patch = u64::from(4 * PATCH_CELLS + 1 + 2 * PATCH_CELLS);
        let clamp = |v: u64| u32::try_from(v).unwrap_or(u32::MAX);
        Self {
            vertices: clamp((all + slots * per_patch) * u64::from(charts.min(3))),
            indices: clamp(
                3 * (2 * all + u64::from(8 * shape.n()) * u64::from(shape.levels()))
                    * u64::from(charts.min(3)),
            ),
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

/// What the sizes of buffers follow from, besides the clipmap's shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// What samples are.
    pub ground: Ground,
    /// Charts of the base surface.
    pub charts: u32,
    /// Samples travel as two bytes.
    pub short: bool,
}

impl Extent {
    /// A plane with samples of four bytes.
    pub const PLANE: Self = Self { ground: Ground::Plane, charts: 1, short: false };

    /// Bytes of a sample in a window.
    #[must_use]
    pub fn sample_bytes(self) -> u64 {
        if self.ground == Ground::Plane { 4 } else { 16 }
    }

    /// Bytes of a sample on its way there.
    #[must_use]
    pub fn staged_bytes(self) -> u64 {
        match (self.ground, self.short) {
            (Ground::Points, _) => 12,
            (_, true) => 2,
            (_, false) => 4,
        }
    }

    /// Blocks a side of a lane's toroidal table of records: 16 in a window, and both ragged ends. Positions
    /// need none.
    #[must_use]
    pub(crate) fn record_side(self) -> u32 {
        if self.ground == Ground::Curved { 19 } else { 0 }
    }
}

/// Blocks a side of a lane's toroidal table of anchors: enough for the windows', and a power of two, because
/// every vertex looks its anchor up.
pub(crate) const ANCHOR_SIDE: u32 = 32;

/// Blocks of bounds a side of a lane: of 16 cells on a plane, of 4 elsewhere, and twice the window's
/// width, so that both ragged ends fit.
pub(crate) fn bounds_side(shape: ClipmapShape, ground: Ground) -> u32 {
    2 * (shape.n() + 1) / if ground == Ground::Plane { 16 } else { 4 }
}

/// Cells of a block of the base surface: a sixteenth of the window.
pub(crate) fn block_cells(shape: ClipmapShape) -> u32 {
    (shape.n() + 1) / 16
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
    /// Curved surfaces only, as all below.
    pub curved: Option<CurvedBuffers>,
    pub capacity: Capacity,
}

/// What curved surfaces need besides.
#[derive(Debug)]
#[allow(missing_docs, reason = "named as the bindings, which the shaders document")]
pub struct CurvedBuffers {
    pub curve: wgpu::Buffer,
    pub charts: wgpu::Buffer,
    pub records: wgpu::Buffer,
    pub anchors: wgpu::Buffer,
    pub shades: wgpu::Buffer,
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
        let lanes = u64::from(shape.levels()) * u64::from(extent.charts);
        let side = u64::from(shape.n()) + 1;
        let slots = u64::from(slots_per_level(shape)) * lanes;
        let host = U::STORAGE | U::COPY_DST;
        let bounds_bytes = if extent.ground == Ground::Plane { 8 } else { 32 };
        let bounds_blocks = u64::from(bounds_side(shape, extent.ground)).pow(2);
        let vertices = u64::from(capacity.vertices);
        let curved = match extent.ground {
            Ground::Plane => None,
            Ground::Curved | Ground::Points => Some(CurvedBuffers {
                curve: make("curve", size_of::<GpuCurve>() as u64, U::UNIFORM | U::COPY_DST)?,
                charts: make("charts", u64::from(extent.charts) * size_of::<GpuChart>() as u64, host)?,
                records: make(
                    "records",
                    lanes * u64::from(extent.record_side()).pow(2) * crate::surface::RECORD_WORDS as u64 * 16,
                    host,
                )?,
                anchors: make(
                    "anchors",
                    lanes * u64::from(ANCHOR_SIDE).pow(2) * crate::surface::ANCHOR_WORDS as u64 * 16,
                    host,
                )?,
                shades: make("shades", vertices * 4, U::STORAGE | U::VERTEX)?,
            }),
        };
        Ok(Self {
            frame: make("frame", size_of::<GpuFrame>() as u64, U::UNIFORM | U::COPY_DST)?,
            control_points: make("control_points", lanes * CONTROL_POINTS as u64 * 4, host)?,
            control_quads: make(
                "control_quads",
                (QUADS_PER_LEVEL * size_of::<GpuControlQuad>()) as u64,
                host,
            )?,
            quad_corners: make("quad_corners", lanes * QUADS_PER_LEVEL as u64 * 4, host)?,
            staging: make("staging", lanes * (side * side * extent.staged_bytes() + 40), host)?,
            samples: make("samples", lanes * side * side * extent.sample_bytes(), U::STORAGE)?,
            block_bounds: make("block_bounds", lanes * bounds_blocks * bounds_bytes, U::STORAGE)?,
            patches: make("patches", slots * size_of::<PatchRecord>() as u64, host)?,
            visible_slots: make("visible_slots", slots * 4, host)?,
            counters: make("counters", size_of::<Counters>() as u64, host | U::INDIRECT)?,
            vertices: make("vertices", vertices * 16, U::STORAGE | U::VERTEX)?,
            indices: make("indices", u64::from(capacity.indices) * 4, U::STORAGE | U::INDEX)?,
            curved,
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
            ("block_bounds", &self.block_bounds),
            ("patches", &self.patches),
            ("visible_slots", &self.visible_slots),
            ("counters", &self.counters),
            ("vertices", &self.vertices),
            ("indices", &self.indices),
        ];
        if let Some(c) = &self.curved {
            all.extend([
                ("curve", &c.curve),
                ("charts", &c.charts),
                ("records", &c.records),
                ("anchors", &c.anchors),
                ("shades", &c.shades),
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
