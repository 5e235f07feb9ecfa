//! What `prepare` sends: control data, refill strips and the frame uniform, and what the ledger learns of it.

use bytemuck::Zeroable as _;

use super::{Renderer, State};
use crate::camera::Camera;
use crate::clipmap::{ChartWindows, Strip, height_bound, refill_from};
use crate::gpu::passes::spec::FrameWork;
use crate::gpu::{GpuFrame, Ground, packed_charts};
use crate::measure::FrameUpload;
use crate::pyramid::VOID;
use crate::quads::slots_per_level;

impl Renderer {
    /// Levels of all charts.
    pub(super) fn lanes(&self) -> u32 {
        self.shape.levels() * self.plan.variant.charts
    }

    /// Control data: everything once, then only the L's corners of levels whose L moved, and where the
    /// windows of glued charts stand.
    pub(super) fn upload_control(
        &self,
        old: Option<&ChartWindows>,
        new: &ChartWindows,
        upload: &mut FrameUpload,
    ) {
        use crate::gpu::layouts::{packed_corners, packed_l_corners, packed_points, packed_quads};
        let levels = self.shape.levels();
        if let Some(curved) = &self.buffers.curved {
            let now = packed_charts(new);
            let before = old.map(packed_charts);
            for (k, chart) in now.iter().enumerate() {
                if before.as_ref().is_none_or(|b| b[k] != *chart) {
                    let at = k * size_of_val(chart);
                    self.queue.write_buffer(&curved.charts, at as u64, bytemuck::bytes_of(chart));
                    upload.uniform_bytes += size_of_val(chart) as u64;
                }
            }
        }
        let Some(old) = old else {
            let points = packed_points(&new.charts[0], self.lanes() as usize);
            let quads = packed_quads(&new.charts[0]);
            let corners: Vec<u32> =
                new.charts.iter().flat_map(|w| (0..levels).flat_map(|l| packed_corners(w, l))).collect();
            self.queue.write_buffer(&self.buffers.control_points, 0, bytemuck::cast_slice(&points));
            self.queue.write_buffer(&self.buffers.control_quads, 0, bytemuck::cast_slice(&quads));
            self.queue.write_buffer(&self.buffers.quad_corners, 0, bytemuck::cast_slice(&corners));
            let bytes = size_of_val(&points[..]) + size_of_val(&quads[..]) + size_of_val(&corners[..]);
            upload.control_points = points.len() as u64;
            upload.control_bytes += bytes as u64;
            return;
        };
        for (chart, (was, is)) in (0_u32..).zip(old.charts.iter().zip(&new.charts)) {
            for level in 1..levels {
                if was.l_position_of_data(level) == is.l_position_of_data(level) {
                    continue;
                }
                let corners = packed_l_corners(is, level);
                let lane = (chart * levels + level) as usize;
                let first = lane * crate::quads::QUADS_PER_LEVEL + crate::quads::L_FIRST;
                self.queue.write_buffer(
                    &self.buffers.quad_corners,
                    (first * 4) as u64,
                    bytemuck::cast_slice(&corners),
                );
                upload.control_bytes += size_of_val(&corners) as u64;
            }
        }
    }

    /// The refill strips, all in one staging write: four words a strip (control data), then samples.
    /// Returns the levels of charts that moved.
    pub(super) fn upload_strips(
        &mut self,
        new: &ChartWindows,
        upload: &mut FrameUpload,
    ) -> Vec<(usize, u32)> {
        let mut strips: Vec<(usize, Strip)> = Vec::new();
        let mut shifted = Vec::new();
        for (chart, windows) in new.charts.iter().enumerate() {
            let refill = refill_from(|level| self.held_window(chart, level), windows);
            for &level in &refill.shifted {
                let held = self.held_window(chart, level);
                let moved = |a: usize| {
                    held.map_or(i32::MAX, |h| windows.origins[level as usize][a].saturating_sub(h.lo[a]))
                };
                // What is sent twice because it came late is not the shift's doing.
                if !(self.stream.refreshes && level + 1 == self.shape.levels()) {
                    upload.height_bound_samples += height_bound(self.shape.cells() + 1, moved(0), moved(1));
                }
                shifted.push((chart, level));
            }
            strips.extend(refill.strips.into_iter().map(|s| (chart, s)));
        }
        let bounds_side = crate::gpu::bounds_side(self.shape, self.plan.variant.ground);
        let shifts = !shifted.is_empty();
        self.work = FrameWork { shifted: shifts, lanes: self.lanes(), bounds_side, ..FrameWork::default() };
        upload.shifts = shifted.len() as u64;
        upload.sample_bytes = self.plan.variant.extent().staged_bytes();
        if strips.is_empty() {
            return shifted;
        }
        let mut heads: Vec<u32> = Vec::with_capacity(strips.len() * 4);
        self.staging.clear();
        let mut staged_bytes = 0;
        for (chart, strip) in &strips {
            let r = strip.rect;
            let size = [0, 1].map(|a| r.hi[a].abs_diff(r.lo[a]) + 1);
            heads.extend([
                u32::try_from(*chart).unwrap_or_default() * self.shape.levels() + strip.level,
                r.lo[0].cast_unsigned(),
                r.lo[1].cast_unsigned(),
                size[0] | size[1] << 16,
            ]);
            let samples = size[0] * size[1];
            self.work.largest_strip = self.work.largest_strip.max(samples);
            self.stage(*chart, *strip);
            staged_bytes += u64::from(samples) * self.plan.variant.extent().staged_bytes();
        }
        self.work.strips = u32::try_from(strips.len()).unwrap_or(u32::MAX);
        let head_bytes = size_of_val(&heads[..]) as u64;
        self.queue.write_buffer(&self.buffers.staging, 0, bytemuck::cast_slice(&heads));
        self.queue.write_buffer(&self.buffers.staging, head_bytes, bytemuck::cast_slice(&self.staging));
        upload.control_bytes += head_bytes;
        upload.strip_bytes += head_bytes;
        upload.height_bytes += staged_bytes;
        shifted
    }

    /// Appends a strip's samples to the staging words.
    fn stage(&mut self, chart: usize, strip: Strip) {
        if self.plan.variant.ground == Ground::Points {
            self.stage_points(chart, strip);
            return;
        }
        let source = match &self.terrain.curved {
            Some(curved) => curved.sources[chart].clone(),
            None => self.terrain.source.clone(),
        };
        let mut samples = Vec::new();
        source.read(strip.level, strip.rect, &mut samples);
        match source.step_m().filter(|_| self.plan.variant.short) {
            None => self.staging.extend(samples.iter().map(|h| h.to_bits())),
            Some(step) => self.staging.extend(samples.chunks(2).map(|pair| {
                let short = |h: f32| {
                    #[expect(clippy::cast_possible_truncation, reason = "the source says that it fits")]
                    let whole = if h == VOID { i16::MIN } else { (h / step).round() as i16 };
                    u32::from(whole.cast_unsigned())
                };
                short(pair[0]) | pair.get(1).map_or(0, |h| short(*h)) << 16
            })),
        }
    }

    pub(super) fn upload_frame(
        &self,
        [camera, looks]: [&Camera; 2],
        state: &State,
        shifted: &[(usize, u32)],
        size_px: [u32; 2],
    ) {
        let first = &state.windows.charts[0];
        let mut origins = [[0; 4]; crate::clipmap::MAX_LEVELS as usize];
        for (slot, origin) in origins.iter_mut().zip(&first.origins) {
            *slot = [origin[0], origin[1], 0, 0];
        }
        for (slot, fade) in origins.iter_mut().zip(self.stream.fades) {
            slot[2] = fade.to_bits().cast_signed();
        }
        let plane = state.placement.as_ref();
        let range = match &self.terrain.curved {
            Some(curved) => curved.height_range(),
            None => self.terrain.source.height_range(),
        };
        let followed = self.seen_by(camera, state, size_px);
        let frame = GpuFrame {
            planes: state.frustum.planes,
            ambient: 0.30,
            anchor_height_m: plane.map_or(0.0, |p| p.anchor_height_m),
            height_range_m: range.unwrap_or([0.0, 1.0]),
            sample_step_m: self.terrain.source.step_m().unwrap_or(1.0),
            sea_level: self.sea_level(range),
            spacing_m: plane.map_or([1.0; 2], |p| p.spacing_m),
            eye_samples: plane.map_or([0.0; 2], |p| p.eye_samples),
            anchor: plane.map_or([0; 2], |p| p.anchor),
            last: first.lattice.last,
            level_count: self.shape.levels(),
            finest: first.finest,
            n: self.shape.n(),
            slots_per_level: slots_per_level(self.shape),
            window_cells: self.shape.cells(),
            vertex_capacity: self.buffers.capacity.vertices,
            index_capacity: self.buffers.capacity.indices,
            shifted_levels: shifted.iter().filter(|(c, _)| *c == 0).fold(0, |bits, (_, l)| bits | 1 << l),
            origins,
            ..followed
        };
        self.queue.write_buffer(&self.buffers.frame, 0, bytemuck::bytes_of(&frame));
        if let Some(view) = &self.buffers.view_frame {
            let seen = self.seen_by(looks, state, size_px);
            let frame = GpuFrame {
                clip_from_near: seen.clip_from_near,
                eye_from_anchor_m: seen.eye_from_anchor_m,
                fog_per_m: seen.fog_per_m,
                sun_direction: seen.sun_direction,
                fog_color: seen.fog_color,
                ..frame
            };
            self.queue.write_buffer(view, 0, bytemuck::bytes_of(&frame));
        }
        if let (Some(curved), Some(curve)) = (&self.buffers.curved, &state.curve) {
            self.queue.write_buffer(&curved.curve, 0, bytemuck::bytes_of(curve));
        }
    }

    /// What of a frame follows from a camera alone; the rest is zero.
    fn seen_by(&self, camera: &Camera, state: &State, size_px: [u32; 2]) -> GpuFrame {
        // Exact in f32, and what it leaves is the matrix' translation: see shading.wgsl.
        let near = (camera.eye_m - state.anchor_m).as_vec3();
        let clip = self.clip(camera, state.anchor_m + near.as_dvec3(), size_px);
        GpuFrame {
            clip_from_near: clip.as_mat4().to_cols_array_2d(),
            eye_from_anchor_m: near.to_array(),
            fog_per_m: if self.scene.fog { self.fog_per_m(camera) as f32 } else { 0.0 },
            sun_direction: (camera.axes * super::sun_direction(&self.scene)).as_vec3().to_array(),
            fog_color: self.background(camera),
            ..GpuFrame::zeroed()
        }
    }

    /// What the windows held before this frame, by lane: where the colouring shows what it refills.
    pub(super) fn upload_held_before(&self, new: &ChartWindows, upload: &mut FrameUpload) {
        let Some(buffer) = &self.buffers.held_before else { return };
        let levels = self.shape.levels();
        let mut all = [[0, 0, -1, -1]; crate::gpu::MAX_LANES];
        for chart in 0..new.charts.len() {
            for level in 0..levels {
                if let Some(held) = self.held_window(chart, level) {
                    all[chart * levels as usize + level as usize] =
                        [held.lo[0], held.lo[1], held.hi[0], held.hi[1]];
                }
            }
        }
        self.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&all));
        upload.uniform_bytes += size_of_val(&all) as u64;
    }

    /// Where height 0 lies in the range of a globe's heights, when some of it lies under water.
    fn sea_level(&self, range: Option<[f32; 2]>) -> f32 {
        let globe = self.terrain.curved.as_ref().is_some_and(|c| c.globe.is_some());
        match range {
            Some([low, high]) if globe && low < 0.0 && high > 0.0 => -low / (high - low),
            _ => 0.0,
        }
    }

    /// The scene's own colour; over a globe the default sky gives way to black with height.
    pub(super) fn background(&self, camera: &Camera) -> [f32; 3] {
        let background = self.scene.background;
        let Some(curved) = self.terrain.curved.as_ref().filter(|c| c.globe.is_some()) else {
            return background;
        };
        if background != crate::scene::Scene::default().background {
            return background;
        }
        let height = curved.surface.foot(camera.eye_m).height_m.max(0.0);
        background.map(|c| c * (-height / 60e3).exp() as f32 + 0.002)
    }

    /// Fog on a globe is the air's: it thins out upwards and hides no more than the limb from orbit.
    fn fog_per_m(&self, camera: &Camera) -> f64 {
        let Some(curved) = &self.terrain.curved else {
            return super::fog_per_m(&self.terrain);
        };
        if curved.globe.is_some() {
            let height = curved.surface.foot(camera.eye_m).height_m.max(0.0);
            return 2.5e-6 * (-height / 20e3).exp();
        }
        0.15 / self.curve.as_ref().map_or(1.0, |c| c.span_m)
    }
}
