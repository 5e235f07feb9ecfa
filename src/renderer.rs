//! The renderer: scene -> plan -> prepare (upload what changed) -> record (the passes, then the draw).
//!
//! `prepare` and `record` never wait for the GPU and never read anything back.

mod choose;
mod curve;
mod drawn;
mod grow;
mod inspect;
mod look;
mod place;
mod stand;
mod streaming;
mod upload;
mod wait;
mod watch;

pub use self::drawn::DrawnSurface;
pub use self::place::LEAST_WINDOW;
pub(crate) use self::place::windows_over_plane;
pub(crate) use self::stand::{PlaneStand, clip, fog_per_m, sun_direction};
pub use self::watch::Watched;

use std::sync::Arc;

use glam::{DMat4, DVec3};
use wgpu_profiler::{GpuProfiler, GpuProfilerSettings};

use crate::camera::{Camera, PoseError};
use crate::clipmap::{ChartWindows, ClipmapError, ClipmapShape, Rect, Windows};
use crate::gpu::passes::ComputePass;
use crate::gpu::passes::draw_bounds::DrawBounds;
use crate::gpu::passes::draw_terrain::{DrawTerrain, begin_pass};
use crate::gpu::passes::spec::{Dispatch, FrameWork, PASSES};
use crate::gpu::{Buffers, Capacity, GpuCurve, GpuError, GpuFrame, Variant};
use crate::measure::FrameUpload;
use crate::plan::Plan;
use crate::pyramid::SampleSource;
use crate::reference::{Frustum, Placement};
use crate::scene::{Scene, Terrain};

/// Why a renderer cannot be made or a frame not prepared.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// `n` or the level count does not suit the data.
    #[error(transparent)]
    Clipmap(#[from] ClipmapError),
    /// The GPU cannot do it.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The camera cannot be drawn with.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// All that one picture needs does not fit the tile cache at once.
    #[error("this view needs {needed} bytes of tiles at once and the cache has {limit}: raise --cache-mb")]
    CacheTooSmall {
        /// Bytes of all tiles.
        needed: u64,
        /// Bytes of the cache.
        limit: u64,
    },
}

/// Where a frame is drawn to; both views have the same size and one sample.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    /// Colour view, of the format the renderer was made for.
    pub color: &'a wgpu::TextureView,
    /// `Depth32Float` view; depth is reversed: clear to 0, nearer is greater.
    pub depth: &'a wgpu::TextureView,
    /// Clear both first, all of them; off draws into what is there.
    pub clear: bool,
    /// The part that is drawn into, pixels: left, top, width, height; `None` for all of it.
    pub area: Option<[u32; 4]>,
}

/// Draws one terrain with one scene into any target of the caller's device.
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    terrain: Terrain,
    scene: Scene,
    shape: ClipmapShape,
    plan: Plan,
    buffers: Buffers,
    passes: Vec<ComputePass>,
    draw: DrawTerrain,
    draw_bounds: Option<DrawBounds>,
    format: wgpu::TextureFormat,
    state: Option<State>,
    /// Origins of the windows whose samples lie on the GPU, by chart and level. A frame that is prepared
    /// but never recorded leaves nothing behind.
    resident: Vec<Vec<Option<[i32; 2]>>>,
    stream: streaming::StreamState,
    /// Levels that the last prepared frame could not draw yet.
    missing_levels: u32,
    work: FrameWork,
    /// Blocks of each lane whose deviations the last `prepare` left in their table, recorded or not.
    described: Vec<Rect>,
    staging: Vec<u32>,
    /// Curved surfaces only: what of them the GPU holds.
    curve: Option<curve::CurveState>,
    profiler: Option<GpuProfiler>,
    watch: Option<watch::Watch>,
    /// What windows, factors and culling follow instead of the camera that looks.
    frozen: Option<Camera>,
}

/// What the last `prepare` left on the GPU.
struct State {
    windows: ChartWindows,
    /// For the twins, which know planes only.
    placement: Option<Placement>,
    frustum: Frustum,
    anchor_m: DVec3,
    curve: Option<GpuCurve>,
    /// Clear and fog colour.
    background: [f32; 3],
}

impl Renderer {
    /// Compiles the passes and allocates the memory a scene needs. `format` is the colour target's.
    ///
    /// # Errors
    /// When the scene does not suit the terrain or the device.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
        terrain: &Terrain,
        scene: &Scene,
    ) -> Result<Self, RenderError> {
        let shape = scene.shape(terrain)?;
        let variant = crate::plan::variant(scene, terrain);
        let mut capacity = crate::plan::room(scene, shape, variant);
        if variant.by_error && !choose::measure(terrain) {
            capacity = Capacity::worst_case(shape, variant.charts);
        }
        Self::with_capacity(device, queue, format, terrain, scene, capacity)
    }

    /// As [`Renderer::new`], with room for `capacity` only; see [`Renderer::grow`].
    ///
    /// # Errors
    /// When the scene does not suit the terrain or the device.
    pub fn with_capacity(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
        terrain: &Terrain,
        scene: &Scene,
        capacity: Capacity,
    ) -> Result<Self, RenderError> {
        let variant = crate::plan::variant(scene, terrain);
        Self::with_variant(device, queue, format, terrain, scene, capacity, variant)
    }

    /// As [`Renderer::with_capacity`], with the given variant of the shaders rather than the one that suits
    /// the scene: how tests show that what is left out changes no picture.
    ///
    /// # Errors
    /// When the scene does not suit the terrain or the device.
    #[doc(hidden)]
    pub fn with_variant(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
        terrain: &Terrain,
        scene: &Scene,
        capacity: Capacity,
        variant: Variant,
    ) -> Result<Self, RenderError> {
        let shape = scene.shape(terrain)?;
        if variant.by_error {
            choose::measure(terrain);
        }
        let timestamps = device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let buffers = Buffers::new(device, shape, variant.extent(), capacity)?;
        let plan = Plan::of(variant, scene, terrain, shape, buffers.capacity, Some(timestamps));
        let compute = PASSES.iter().filter(|p| (p.needed)(variant) && !matches!(p.dispatch, Dispatch::Draw));
        let passes = compute.map(|spec| ComputePass::new(device, &buffers, spec, variant)).collect();
        let draw = DrawTerrain::new(device, &buffers, format, variant);
        let draw_bounds = variant.boxes.then(|| DrawBounds::new(device, &buffers, format, variant));
        let curve = terrain.curved.as_ref().map(|c| curve::CurveState::new(c, shape, variant.extent()));
        let made = Self {
            device: device.clone(),
            queue: queue.clone(),
            terrain: terrain.clone(),
            scene: scene.clone(),
            shape,
            plan,
            buffers,
            passes,
            draw,
            draw_bounds,
            format,
            state: None,
            resident: Vec::new(),
            stream: streaming::StreamState::default(),
            missing_levels: 0,
            work: FrameWork::default(),
            described: Vec::new(),
            staging: Vec::new(),
            curve,
            profiler: None,
            watch: None,
            frozen: None,
        };
        made.send_box_arguments();
        Ok(made)
    }

    /// Switches per-pass times on; they stay null where the device has no timestamp queries.
    pub fn time_passes(&mut self) {
        if self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            // Settings are the default ones, which the profiler always accepts.
            self.profiler = GpuProfiler::new(&self.device, GpuProfilerSettings::default()).ok();
        }
    }

    /// What the scene was turned into.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Window size and level count.
    #[must_use]
    pub fn shape(&self) -> ClipmapShape {
        self.shape
    }

    /// Patch slots of all levels of all charts: no frame draws more patches.
    #[must_use]
    pub fn patch_slots(&self) -> u32 {
        crate::quads::slots_per_level(self.shape) * self.lanes()
    }

    /// Names and bytes of the GPU buffers held.
    #[doc(hidden)]
    #[must_use]
    pub fn buffer_bytes(&self) -> Vec<(&'static str, u64)> {
        self.buffers.all().into_iter().map(|(name, b)| (name, b.size())).collect()
    }

    /// The GPU buffers.
    pub(crate) fn buffers(&self) -> &Buffers {
        &self.buffers
    }

    /// World position that the last prepared frame's vertices are relative to, metres.
    pub(crate) fn anchor_m(&self) -> Option<DVec3> {
        self.state.as_ref().map(|s| s.anchor_m)
    }

    /// Bytes of GPU buffers held.
    #[must_use]
    pub fn gpu_bytes(&self) -> u64 {
        self.buffers.bytes()
    }

    /// Windows, anchor and camera of the last prepared frame, as the CPU twins need them; they know
    /// planes only.
    #[must_use]
    pub fn placement(&self) -> Option<&Placement> {
        self.state.as_ref()?.placement.as_ref()
    }

    /// Windows of all charts of the last prepared frame.
    #[must_use]
    pub fn windows(&self) -> Option<&ChartWindows> {
        self.state.as_ref().map(|s| &s.windows)
    }

    /// The terrain drawn.
    #[must_use]
    pub fn terrain(&self) -> &Terrain {
        &self.terrain
    }

    /// Planes of the last prepared frame.
    #[must_use]
    pub fn frustum(&self) -> Option<&Frustum> {
        self.state.as_ref().map(|s| &s.frustum)
    }

    /// Height data of the terrain drawn.
    #[must_use]
    pub fn source(&self) -> &Arc<dyn SampleSource> {
        &self.terrain.source
    }

    /// Uploads what this camera needs and the GPU does not have yet. Call once before `record`.
    ///
    /// # Errors
    /// When the camera holds numbers that cannot be drawn with.
    pub fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        camera.validate()?;
        let mut upload = FrameUpload::default();
        let looks = *camera;
        let camera = &self.frozen.unwrap_or(looks);
        let windows = self.place(camera);
        let windows = self.follow_stream(windows, &mut upload);
        self.missing_levels = upload.levels_missing;
        let old = self.state.as_ref().map(|s| s.windows.clone());
        self.upload_control(old.as_ref(), &windows, &mut upload);
        self.upload_records(&windows, &mut upload);
        let shifted = self.upload_strips(&windows, &mut upload);
        self.upload_choice(&windows, size_px, &mut upload);
        self.upload_held_before(&windows, &mut upload);
        let mut state = self.state_for(camera, windows, size_px, &shifted);
        state.background = self.background(&looks);
        self.upload_frame([camera, &looks], &state, &shifted, size_px);
        upload.uniform_bytes +=
            (size_of::<GpuFrame>() + state.curve.map_or(0, |_| size_of::<GpuCurve>())) as u64;
        self.state = Some(state);
        Ok(upload)
    }

    fn state_for(
        &self,
        camera: &Camera,
        windows: ChartWindows,
        size_px: [u32; 2],
        shifted: &[(usize, u32)],
    ) -> State {
        if let Some(curve) = &self.curve {
            return self.curved_state(curve, camera, windows, size_px, shifted);
        }
        let all = windows;
        let windows: Windows = all.charts[0].clone();
        let PlaneStand { anchor, anchor_height_m, anchor_m, eye_samples } =
            PlaneStand::of(&self.terrain, camera);
        let clip = self.clip(camera, anchor_m, size_px);
        State {
            windows: all,
            curve: None,
            background: self.scene.background,
            placement: Some(Placement {
                windows,
                anchor,
                anchor_height_m,
                spacing_m: self.terrain.spacing_m.map(|v| v as f32),
                eye_samples,
                morph: self.scene.morph,
                fades: self.stream.fades,
            }),
            frustum: Frustum { planes: Camera::planes(&clip) },
            anchor_m,
        }
    }

    /// Clip space from metres relative to `anchor_m`, for a target of the given size.
    #[must_use]
    pub fn clip(&self, camera: &Camera, anchor_m: DVec3, size_px: [u32; 2]) -> DMat4 {
        stand::clip(&self.terrain, camera, anchor_m, size_px)
    }

    /// Records the prepared frame: the mesh, then the draw.
    pub fn record(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        self.record_mesh(encoder);
        if self.draw_bounds.is_some() {
            DrawBounds::count(encoder, &self.buffers);
        }
        let bounds = self.draw_bounds.as_ref();
        self.record_draw(encoder, target, |draw, pass, buffers| {
            draw.record(pass, buffers);
            if let Some(bounds) = bounds {
                bounds.record(pass, buffers);
            }
        });
        self.record_watch(encoder);
        if let Some(profiler) = &mut self.profiler {
            profiler.resolve_queries(encoder);
        }
    }

    /// Records the compute passes alone, in the order of the array.
    pub fn record_mesh(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.record_passes(encoder, |_| true);
    }

    /// Records the compute passes of the wanted stems: rivals that draw from the same windows leave some out.
    pub(crate) fn record_passes(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        wanted: impl Fn(&'static str) -> bool,
    ) {
        for pass in &self.passes {
            if !wanted(pass.stem) || !pass.has_work(self.shape, self.work) {
                continue;
            }
            let query = self.profiler.as_ref().map(|p| p.begin_pass_query(pass.stem, encoder));
            let mut recorded = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(pass.stem),
                timestamp_writes: query.as_ref().and_then(|q| q.compute_pass_timestamp_writes()),
            });
            pass.record(&mut recorded, self.shape, self.work, &self.buffers.counters);
            drop(recorded);
            if let (Some(profiler), Some(query)) = (&self.profiler, query) {
                profiler.end_query(encoder, query);
            }
        }
        // Recorded once: a second recording without `prepare` must not refill or grade again.
        self.work =
            FrameWork { lanes: self.work.lanes, bounds_side: self.work.bounds_side, ..FrameWork::default() };
        self.commit_windows();
    }

    /// What was just recorded lies on the GPU from now on.
    fn commit_windows(&mut self) {
        let Some(state) = &self.state else { return };
        let streamed = self.terrain.source.streaming().is_some();
        let levels = self.shape.levels();
        self.resident.resize(state.windows.charts.len(), vec![None; levels as usize]);
        for (held, windows) in self.resident.iter_mut().zip(&state.windows.charts) {
            for level in 0..levels {
                let asleep = windows.sleeps && level < windows.finest;
                // A streamed level that waits for samples keeps what it has: that need not be sent again.
                if !asleep {
                    held[level as usize] = Some(windows.origins[level as usize]);
                } else if !streamed {
                    held[level as usize] = None;
                }
            }
        }
        self.stream.commit();
    }

    fn record_draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: Target<'_>,
        draw: impl FnOnce(&DrawTerrain, &mut wgpu::RenderPass<'_>, &Buffers),
    ) {
        let background = self.state.as_ref().map_or(self.scene.background, |s| s.background);
        let query = self.profiler.as_ref().map(|p| p.begin_pass_query("draw_terrain", encoder));
        let timestamps = query.as_ref().and_then(|q| q.render_pass_timestamp_writes());
        let mut pass = begin_pass(encoder, target, background, timestamps);
        draw(&self.draw, &mut pass, &self.buffers);
        drop(pass);
        if let (Some(profiler), Some(query)) = (&self.profiler, query) {
            profiler.end_query(encoder, query);
        }
    }

    /// Draws the mesh of the frame before once more: what a frame costs without making its mesh.
    #[doc(hidden)]
    pub fn record_draw_again(&self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        self.record_draw(encoder, target, |draw, pass, buffers| draw.record(pass, buffers));
    }

    /// Draws a ready-made mesh with this renderer's pipeline: what a static mesh would cost.
    #[doc(hidden)]
    pub fn record_static(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: Target<'_>,
        vertices: &wgpu::Buffer,
        indices: &wgpu::Buffer,
        index_count: u32,
    ) {
        self.record_draw(encoder, target, |draw, pass, _| {
            draw.record_static(pass, vertices, indices, index_count)
        });
    }

    /// Ends a timed frame after its submission: milliseconds of each pass of the oldest finished frame,
    /// `None` where nothing is timed or finished yet.
    pub fn finished_pass_times(&mut self) -> Option<Vec<(String, f64)>> {
        let period = self.queue.get_timestamp_period();
        let profiler = self.profiler.as_mut()?;
        if let Err(error) = profiler.end_frame() {
            log::warn!("per-pass times of this frame are lost: {error}");
        }
        let results = profiler.process_finished_frame(period)?;
        Some(results.into_iter().filter_map(|r| r.time.map(|t| (r.label, (t.end - t.start) * 1e3))).collect())
    }
}
