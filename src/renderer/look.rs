//! Changes to a renderer at work: what is looked at, how, and from where, without sending anything again.

use super::{RenderError, Renderer};
use crate::camera::Camera;
use crate::gpu::Variant;
use crate::gpu::passes::draw_bounds::DrawBounds;
use crate::gpu::passes::draw_terrain::DrawTerrain;
use crate::plan::Plan;
use crate::scene::Scene;

impl Renderer {
    /// Takes another scene where that changes nothing but how the mesh is drawn: colouring (but to and from
    /// error and refill, which the mesh carries), edges, fog, sun, background. Returns false, and changes
    /// nothing, where a new renderer is needed.
    pub fn restyle(&mut self, scene: &Scene) -> bool {
        let now = self.plan.variant;
        let wanted = crate::plan::variant(scene, &self.terrain);
        let drawn_alike = Variant { color: now.color, fog: now.fog, wireframe: now.wireframe, ..wanted };
        let marked = |v: Variant| (v.extent().deviations, v.extent().refill);
        let mesh = |s: &Scene| (s.n, s.levels, s.factors, s.drop_fine_levels);
        if drawn_alike != now || marked(wanted) != marked(now) || mesh(scene) != mesh(&self.scene) {
            return false;
        }
        self.scene = scene.clone();
        if wanted != now {
            let timestamps = self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
            let room = self.buffers.capacity;
            self.plan = Plan::of(wanted, scene, &self.terrain, self.shape, room, Some(timestamps));
            self.draw = DrawTerrain::new(&self.device, &self.buffers, self.format, wanted);
        }
        true
    }

    /// Windows, factors and culling follow this camera from the next `prepare` on, whatever camera that is given,
    /// which only looks; `None` lets them follow it again.
    ///
    /// # Errors
    /// When the camera holds numbers that cannot be drawn with.
    pub fn freeze(&mut self, camera: Option<Camera>) -> Result<(), RenderError> {
        camera.map_or(Ok(()), |c| c.validate())?;
        let was = self.frozen.is_some();
        self.frozen = camera;
        if camera.is_some() != was {
            self.make_view_frame();
            self.rebind_draws();
        }
        Ok(())
    }

    /// The camera that windows and culling stay with.
    #[must_use]
    pub fn frozen(&self) -> Option<&Camera> {
        self.frozen.as_ref()
    }

    /// A frame of its own for the camera that looks, while culling follows another one.
    pub(super) fn make_view_frame(&mut self) {
        self.buffers.view_frame = self.frozen.map(|_| {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("view_frame"),
                size: self.buffers.frame.size(),
                usage: wgpu::BufferUsages::UNIFORM
                    | wgpu::BufferUsages::COPY_DST
                    | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            })
        });
    }

    pub(super) fn rebind_draws(&mut self) {
        self.draw.rebind(&self.device, &self.buffers);
        if let Some(bounds) = &mut self.draw_bounds {
            bounds.rebind(&self.device, &self.buffers);
        }
    }

    /// What never changes of the arguments of the bounds' draw.
    pub(super) fn send_box_arguments(&self) {
        if let Some(arguments) = &self.buffers.box_arguments {
            self.queue.write_buffer(arguments, 0, bytemuck::cast_slice(&DrawBounds::arguments()));
        }
    }
}
