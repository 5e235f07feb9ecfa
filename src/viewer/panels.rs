//! egui in our window: input to it, its shapes to the GPU.

use std::time::{Duration, Instant};

use egui_wgpu::ScreenDescriptor;
use wgpu_profiler::{GpuProfiler, GpuProfilerSettings};
use winit::event::WindowEvent;
use winit::window::Window;

use super::hud;
use super::overlay::Overlay;

/// Panels are laid out so often, whatever else happens.
const PERIOD: Duration = Duration::from_millis(200);

/// egui with its state, and what it wants painted.
pub struct Panels {
    pub context: egui::Context,
    state: egui_winit::State,
    renderer: egui_wgpu::Renderer,
    jobs: Vec<egui::ClippedPrimitive>,
    textures: egui::TexturesDelta,
    screen: ScreenDescriptor,
    profiler: Option<GpuProfiler>,
    /// Milliseconds that the GPU took to paint them, told in the frame after; 0 where they were not painted.
    pub gpu_ms: f64,
    format: wgpu::TextureFormat,
    /// Where the pointer is, pixels.
    pointer: Option<egui::Pos2>,
    /// Frames take copies.
    copies: bool,
    overlay: Overlay,
    /// Their painting was timed in this frame.
    timed: bool,
    /// Where panels are, pixels.
    places: Vec<egui::Rect>,
    /// To be laid out, and to be painted.
    dirty: bool,
    stale: bool,
    next: Instant,
    repaint_in: Duration,
}

impl Panels {
    pub fn new(window: &Window, device: &wgpu::Device, format: wgpu::TextureFormat, copies: bool) -> Self {
        let context = egui::Context::default();
        hud::style(&context);
        let side = usize::try_from(device.limits().max_texture_dimension_2d).ok();
        let scale = window.scale_factor() as f32;
        let state = egui_winit::State::new(
            context.clone(),
            egui::ViewportId::ROOT,
            window,
            Some(scale),
            window.theme(),
            side,
        );
        Self {
            context,
            state,
            renderer: Self::renderer(device, format),
            jobs: Vec::new(),
            textures: egui::TexturesDelta::default(),
            screen: ScreenDescriptor { size_in_pixels: [1, 1], pixels_per_point: scale },
            profiler: device
                .features()
                .contains(wgpu::Features::TIMESTAMP_QUERY)
                .then(|| GpuProfiler::new(device, GpuProfilerSettings::default()).ok())
                .flatten(),
            gpu_ms: 0.0,
            format,
            copies,
            timed: false,
            pointer: None,
            overlay: Overlay::new(device, format, [1, 1], copies),
            places: Vec::new(),
            dirty: true,
            stale: false,
            next: Instant::now(),
            repaint_in: Duration::ZERO,
        }
    }

    fn renderer(device: &wgpu::Device, format: wgpu::TextureFormat) -> egui_wgpu::Renderer {
        let options = egui_wgpu::RendererOptions { dithering: false, ..Default::default() };
        egui_wgpu::Renderer::new(device, format, options)
    }

    /// Tells egui of an event.
    pub fn event(&mut self, window: &Window, event: &WindowEvent) -> egui_winit::EventResponse {
        let before = self.pointer.is_some_and(|p| self.holds(p));
        match event {
            WindowEvent::CursorMoved { position, .. } => {
                self.pointer = Some(egui::pos2(position.x as f32, position.y as f32));
            }
            WindowEvent::CursorLeft { .. } => self.pointer = None,
            _ => {}
        }
        let pointed = self.pointer.is_some_and(|p| self.holds(p));
        if matches!(event, WindowEvent::CursorMoved { .. }) {
            // One that moves over the terrain changes nothing that could not wait.
            self.dirty |= before || pointed;
        }
        let mut response = self.state.on_window_event(window, event);
        // Panels are not laid out at every event: of the pointer more is known here.
        if matches!(event, WindowEvent::MouseInput { .. } | WindowEvent::MouseWheel { .. }) {
            response.consumed = pointed || self.context.egui_is_using_pointer();
        }
        self.dirty |= response.repaint && response.consumed;
        response
    }

    /// The pointer is not theirs: it was taken to look around.
    pub fn lose_pointer(&mut self) {
        self.state.egui_input_mut().events.push(egui::Event::PointerGone);
        self.pointer = None;
        self.dirty = true;
    }

    /// True for a pixel that a panel covers, or while one is being dragged.
    fn holds(&self, pixel: egui::Pos2) -> bool {
        self.places.iter().any(|r| r.contains(pixel)) || self.context.egui_is_using_pointer()
    }

    /// Lays the panels out where that is due: after input to them, and a few times a second; returns when they want
    /// to be drawn again at the latest.
    pub fn run(&mut self, window: &Window, size: [u32; 2], draw: impl FnMut(&mut egui::Ui)) -> Duration {
        let now = Instant::now();
        let due = self.dirty || self.overlay.size() != size;
        if let Some(left) = self.next.checked_duration_since(now).filter(|_| !due) {
            return self.repaint_in.max(left);
        }
        let input = self.state.take_egui_input(window);
        let output = self.context.run_ui(input, draw);
        self.state.handle_platform_output(window, output.platform_output);
        self.textures.append(output.textures_delta);
        let scale = output.pixels_per_point;
        self.places = places(&self.context, &output.shapes).into_iter().map(|r| r * scale).collect();
        self.jobs = self.context.tessellate(output.shapes, scale);
        self.screen = ScreenDescriptor { size_in_pixels: size, pixels_per_point: scale };
        let root = output.viewport_output.get(&egui::ViewportId::ROOT);
        self.repaint_in = root.map_or(Duration::MAX, |v| v.repaint_delay);
        self.dirty = self.repaint_in.is_zero();
        self.next = now + PERIOD;
        self.stale = true;
        self.repaint_in
    }

    /// They are laid out anew with the next frame.
    pub fn stir(&mut self) {
        self.dirty = true;
    }

    /// Paints them into their own picture, where they were laid out since.
    pub fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder) {
        if !std::mem::take(&mut self.stale) {
            return;
        }
        for (id, deltas) in self.textures.set.drain() {
            for delta in deltas {
                self.renderer.update_texture(device, queue, id, &delta);
            }
        }
        // Without paint callbacks there are no command buffers of their own.
        drop(self.renderer.update_buffers(device, queue, encoder, &self.jobs, &self.screen));
        if self.overlay.size() != self.screen.size_in_pixels {
            self.overlay = Overlay::new(device, self.format, self.screen.size_in_pixels, self.copies);
        }
        self.overlay.cover(&self.places);
        let (renderer, jobs, screen) = (&self.renderer, &self.jobs, &self.screen);
        let query = self.profiler.as_ref().map(|p| p.begin_pass_query("panels", encoder));
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("panels"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: self.overlay.view(),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: self.overlay.clear(), store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: None,
            timestamp_writes: query.as_ref().and_then(|q| q.render_pass_timestamp_writes()),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        renderer.render(&mut pass.forget_lifetime(), jobs, screen);
        if let (Some(profiler), Some(query)) = (&mut self.profiler, query) {
            profiler.end_query(encoder, query);
            profiler.resolve_queries(encoder);
        }
        self.timed = true;
    }

    /// Puts their picture over a frame; `seen` is its view in the panels' format.
    pub fn put(&self, encoder: &mut wgpu::CommandEncoder, frame: &wgpu::Texture, seen: &wgpu::TextureView) {
        self.overlay.put(encoder, frame, seen);
    }

    /// Ends a frame that was submitted: frees textures that nothing needs any more, and asks how long they took.
    pub fn finish(&mut self, queue: &wgpu::Queue) {
        self.gpu_ms = 0.0;
        if let Some(profiler) = self.profiler.as_mut().filter(|_| std::mem::take(&mut self.timed)) {
            if let Err(error) = profiler.end_frame() {
                log::debug!("the panels' time of this frame is lost: {error}");
            }
            let found = profiler.process_finished_frame(queue.get_timestamp_period());
            if let Some(found) = found {
                self.gpu_ms =
                    found.iter().filter_map(|r| r.time.as_ref()).map(|t| (t.end - t.start) * 1e3).sum();
            }
        }
        for id in self.textures.free.drain() {
            self.renderer.free_texture(&id);
        }
    }
}

impl Drop for Panels {
    fn drop(&mut self) {
        // egui takes textures that were asked for and never made for a mistake.
        self.textures.clear();
    }
}

/// Where panels are, points: their areas, and whatever was painted outside of all.
fn places(context: &egui::Context, shapes: &[egui::epaint::ClippedShape]) -> Vec<egui::Rect> {
    let mut out: Vec<egui::Rect> = context.memory(|memory| {
        let layers = memory.areas().visible_layer_ids();
        // The layer that all stand on is as large as the window.
        let own = layers.into_iter().filter(|layer| layer.order != egui::Order::Background);
        own.filter_map(|layer| memory.area_rect(layer.id)).collect()
    });
    for clipped in shapes {
        let rect = clipped.shape.visual_bounding_rect().intersect(clipped.clip_rect);
        if rect.is_positive() && !out.iter().any(|r| r.contains_rect(rect)) {
            out.push(rect);
        }
    }
    out
}
