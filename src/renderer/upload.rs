//! What `prepare` sends: control data, refill strips and the frame uniform, and what the ledger learns of it.

use glam::DVec3;

use super::{Renderer, State};
use crate::camera::Camera;
use crate::clipmap::{Refill, Windows, height_bound};
use crate::gpu::GpuFrame;
use crate::gpu::passes::FrameWork;
use crate::measure::FrameUpload;
use crate::quads::slots_per_level;

impl Renderer {
    /// Control data: everything once, then only the L's corners of levels whose L moved.
    pub(super) fn upload_control(&self, old: Option<&Windows>, new: &Windows, upload: &mut FrameUpload) {
        let Some(old) = old else {
            let points = crate::gpu::layouts::packed_points(new);
            let quads = crate::gpu::layouts::packed_quads(new);
            let corners: Vec<u32> =
                (0..self.shape.levels()).flat_map(|l| crate::gpu::layouts::packed_corners(new, l)).collect();
            self.queue.write_buffer(&self.buffers.control_points, 0, bytemuck::cast_slice(&points));
            self.queue.write_buffer(&self.buffers.control_quads, 0, bytemuck::cast_slice(&quads));
            self.queue.write_buffer(&self.buffers.quad_corners, 0, bytemuck::cast_slice(&corners));
            let bytes = size_of_val(&points[..]) + size_of_val(&quads[..]) + size_of_val(&corners[..]);
            upload.control_points = points.len() as u64;
            upload.control_bytes += bytes as u64;
            return;
        };
        for level in 1..self.shape.levels() {
            if old.l_position_of_data(level) == new.l_position_of_data(level) {
                continue;
            }
            let corners = crate::gpu::layouts::packed_l_corners(new, level);
            let first = level as usize * crate::quads::QUADS_PER_LEVEL + crate::quads::L_FIRST;
            self.queue.write_buffer(
                &self.buffers.quad_corners,
                (first * 4) as u64,
                bytemuck::cast_slice(&corners),
            );
            upload.control_bytes += size_of_val(&corners) as u64;
        }
    }

    /// The refill strips, all in one staging write: four words a strip (control data), then samples.
    pub(super) fn upload_strips(
        &mut self,
        old: Option<&Windows>,
        new: &Windows,
        refill: &Refill,
        upload: &mut FrameUpload,
    ) {
        self.work = FrameWork { shifted: !refill.shifted.is_empty(), ..FrameWork::default() };
        upload.shifts = refill.shifted.len() as u64;
        for &level in &refill.shifted {
            let moved = |a: usize| {
                old.map_or(i32::MAX, |o| new.origins[level as usize][a] - o.origins[level as usize][a])
            };
            upload.height_bound_samples += height_bound(self.shape.n(), moved(0), moved(1));
        }
        if refill.strips.is_empty() {
            return;
        }
        let mut heads: Vec<u32> = Vec::with_capacity(refill.strips.len() * 4);
        self.staging.clear();
        for strip in &refill.strips {
            let r = strip.rect;
            let size = [0, 1].map(|a| r.hi[a].abs_diff(r.lo[a]) + 1);
            heads.extend([
                strip.level,
                r.lo[0].cast_unsigned(),
                r.lo[1].cast_unsigned(),
                size[0] | size[1] << 16,
            ]);
            self.work.largest_strip = self.work.largest_strip.max(size[0] * size[1]);
            self.terrain.source.read(strip.level, r, &mut self.staging);
        }
        self.work.strips = u32::try_from(refill.strips.len()).unwrap_or(u32::MAX);
        let head_bytes = size_of_val(&heads[..]) as u64;
        self.queue.write_buffer(&self.buffers.staging, 0, bytemuck::cast_slice(&heads));
        self.queue.write_buffer(&self.buffers.staging, head_bytes, bytemuck::cast_slice(&self.staging));
        upload.control_bytes += head_bytes;
        upload.height_bytes += size_of_val(&self.staging[..]) as u64;
    }

    pub(super) fn upload_frame(&self, camera: &Camera, state: &State, refill: &Refill, size_px: [u32; 2]) {
        let p = &state.placement;
        let clip = self.clip(camera, state.anchor_m, size_px);
        let [azimuth, altitude] = self.scene.sun_deg.map(f64::to_radians);
        let sun = DVec3::new(azimuth.sin() * altitude.cos(), azimuth.cos() * altitude.cos(), altitude.sin());
        let [low, high] = self.terrain.extent_m();
        let diagonal = DVec3::new(high[0] - low[0], high[1] - low[1], 0.0).length();
        let mut origins = [[0; 4]; crate::clipmap::MAX_LEVELS as usize];
        for (slot, origin) in origins.iter_mut().zip(&p.windows.origins) {
            *slot = [origin[0], origin[1], 0, 0];
        }
        let frame = GpuFrame {
            clip_from_anchor: clip.as_mat4().to_cols_array_2d(),
            planes: state.frustum.planes,
            eye_from_anchor_m: (camera.eye_m - state.anchor_m).as_vec3().to_array(),
            fog_per_m: (0.6 / diagonal.max(1e-6)) as f32,
            sun_direction: sun.as_vec3().to_array(),
            ambient: 0.30,
            fog_color: self.scene.background,
            anchor_height_m: p.anchor_height_m,
            height_range_m: self.terrain.source.height_range().unwrap_or([0.0, 1.0]),
            viewport_px: size_px.map(|v| v as f32),
            spacing_m: p.spacing_m,
            eye_samples: p.eye_samples,
            anchor: p.anchor,
            last: p.windows.lattice.last,
            level_count: self.shape.levels(),
            finest: p.windows.finest,
            n: self.shape.n(),
            slots_per_level: slots_per_level(self.shape),
            cull: u32::from(self.scene.cull),
            vertex_capacity: self.buffers.capacity.vertices,
            index_capacity: self.buffers.capacity.indices,
            shifted_levels: refill.shifted.iter().fold(0, |bits, l| bits | 1 << l),
            origins,
        };
        self.queue.write_buffer(&self.buffers.frame, 0, bytemuck::bytes_of(&frame));
    }
}
