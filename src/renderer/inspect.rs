//! Looking at what the GPU did: counters, meshes and buffers read back. Never part of a frame.

use super::Renderer;
use crate::gpu::{Counters, GpuError, GpuMesh, PatchNodes, PatchRecord, read_buffer};
use crate::quads::Patch;
use crate::reference::Vertex;

impl Renderer {
    /// Counters of the last submitted frame; waits for the GPU.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read_counters(&self) -> Result<Counters, GpuError> {
        let all: Vec<Counters> = read_buffer(&self.device, &self.queue, &self.buffers.counters, 1)?;
        all.first().copied().ok_or_else(|| GpuError::Readback { reason: "no counters".into() })
    }

    /// The mesh of the last submitted frame; waits for the GPU.
    ///
    /// # Errors
    /// When the device fails or no frame was prepared.
    pub fn read_mesh(&self) -> Result<GpuMesh, GpuError> {
        let state =
            self.state.as_ref().ok_or_else(|| GpuError::Readback { reason: "no frame was drawn".into() })?;
        let counters = self.read_counters()?;
        let indices: Vec<u32> =
            read_buffer(&self.device, &self.queue, &self.buffers.indices, counters.index_count as usize)?;
        let mut mesh = GpuMesh {
            anchor_m: state.anchor_m.to_array(),
            vertices: Vec::new(),
            triangles: indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            patches: self.read_visible_patches()?,
            nodes: self.read_visible_nodes()?,
            counters,
        };
        let count: u32 = mesh.drawn().iter().map(Patch::vertex_count).sum();
        mesh.vertices = read_buffer(&self.device, &self.queue, &self.buffers.vertices, count as usize)?;
        Ok(mesh)
    }

    /// Records of the visible patches of the last submitted frame, in draw order; waits for the GPU.
    pub(crate) fn read_visible_patches(&self) -> Result<Vec<PatchRecord>, GpuError> {
        self.read_visible(&self.buffers.patches)
    }

    /// Which vertices they have, where factors go by error; else none.
    fn read_visible_nodes(&self) -> Result<Vec<PatchNodes>, GpuError> {
        self.buffers.by_error.as_ref().map_or(Ok(Vec::new()), |buffers| self.read_visible(&buffers.leaves))
    }

    /// What a buffer that begins with one element a patch slot holds of the visible ones.
    fn read_visible<T: bytemuck::Pod>(&self, buffer: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
        let count = self.read_counters()?.expand_x as usize;
        let all: Vec<T> = read_buffer(&self.device, &self.queue, buffer, self.patch_slots() as usize)?;
        let visible: Vec<u32> = read_buffer(&self.device, &self.queue, &self.buffers.visible_slots, count)?;
        Ok(visible.iter().filter_map(|ix| all.get(*ix as usize)).copied().collect())
    }

    /// Runs the expansion of uniform factors alone on the given records, whose first vertices and indices must
    /// be set, and reads the result back: how tests try factors that no camera asks for yet.
    ///
    /// # Errors
    /// When the device fails or no frame was prepared and recorded before.
    #[doc(hidden)]
    pub fn expand_only(&self, records: &[PatchRecord]) -> Result<(Vec<Vertex>, Vec<u32>), GpuError> {
        let slots: Vec<u32> = (0..u32::try_from(records.len()).unwrap_or(u32::MAX)).collect();
        let groups = [slots.len() as u32, 1, 1];
        let offset = std::mem::offset_of!(Counters, expand_x) as u64;
        self.queue.write_buffer(&self.buffers.patches, 0, bytemuck::cast_slice(records));
        self.queue.write_buffer(&self.buffers.visible_slots, 0, bytemuck::cast_slice(&slots));
        self.queue.write_buffer(&self.buffers.counters, offset, bytemuck::cast_slice(&groups));
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        if let Some(expand) = self.passes.iter().find(|p| p.stem == "expand_patches") {
            expand.record(&mut pass, self.shape, self.work, &self.buffers.counters);
        }
        drop(pass);
        self.queue.submit([encoder.finish()]);
        let ends = records.iter().map(|r| {
            let p = r.patch();
            (r.first_vertex + p.vertex_count(), r.first_index + 3 * p.triangle_count())
        });
        let (vertices, indices) = ends.fold((0, 0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
        Ok((
            read_buffer(&self.device, &self.queue, &self.buffers.vertices, vertices as usize)?,
            read_buffer(&self.device, &self.queue, &self.buffers.indices, indices as usize)?,
        ))
    }

    /// All samples of all windows as they lie on the GPU, `(n + 1)^2` a level; for tests.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read_samples(&self) -> Result<Vec<f32>, GpuError> {
        let count = self.buffers.samples.size() / 4;
        let samples: Vec<f32> = read_buffer(
            &self.device,
            &self.queue,
            &self.buffers.samples,
            usize::try_from(count).unwrap_or(0),
        )?;
        Ok(samples)
    }

    /// Lowest and highest height of every block of 16 x 16 cells as the GPU keeps them,
    /// `((n + 1) / 8)^2` a level, toroidal; none where the plan leaves bounds out. For tests.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read_block_bounds(&self) -> Result<Vec<[f32; 2]>, GpuError> {
        let Some(bounds) = &self.buffers.block_bounds else { return Ok(Vec::new()) };
        let count = usize::try_from(bounds.size() / 8).unwrap_or(0);
        read_buffer(&self.device, &self.queue, bounds, count)
    }

    /// Grades of all blocks' nodes as they lie on the GPU, 98 words a block of the toroidal tables; none where
    /// factors are uniform. For tests.
    ///
    /// # Errors
    /// When the device fails.
    #[doc(hidden)]
    pub fn read_grades(&self) -> Result<Vec<u32>, GpuError> {
        let Some(buffers) = &self.buffers.by_error else { return Ok(Vec::new()) };
        let count = usize::try_from(buffers.grades.size() / 4).unwrap_or(0);
        read_buffer(&self.device, &self.queue, &buffers.grades, count)
    }
}
