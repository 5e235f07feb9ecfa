//! What all rivals share: device, frame uniform, colours, and the draw of ready-made meshes.

use std::collections::HashMap;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use super::{DrawCount, DrawnMesh, Ground};
use crate::camera::Camera;
use crate::gpu::passes::create_module;
use crate::gpu::passes::draw_terrain::{Drawing, SPEC, begin_pass, terrain_pipeline};
use crate::gpu::{GpuError, GpuFrame, Ground as Samples, read_buffer, shaders};
use crate::plan::variant;
use crate::reference::Frustum;
use crate::renderer::{PlaneStand, Target, clip, fog_per_m, sun_direction};
use crate::scene::{ColorMode, Scene, Terrain};

/// A vertex of a grid of samples (`vs_patch`): its place follows from its number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct GridVertex {
    /// Metres.
    pub height: f32,
    /// Packed normal; level bits 0.
    pub normal: u32,
}

/// A grid of samples as it is drawn (`vs_patch`), one instance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct GridInstance {
    /// Low corner, base samples.
    pub lo: [i32; 2],
    /// Base samples between vertices.
    pub step: u32,
    /// Vertices a row.
    pub side: u32,
    /// Number of its first vertex in the vertex buffer.
    pub first: u32,
    /// Level << 24, for colours.
    pub tag: u32,
}

/// A vertex anywhere (`vs_mesh`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MeshVertex {
    /// Base sample.
    pub base: [i32; 2],
    /// Metres.
    pub height: f32,
    /// Packed normal | level << 24.
    pub packed: u32,
}

/// How a camera sees the ground this frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stand {
    /// What positions are relative to.
    pub plane: PlaneStand,
    /// Camera in the terrain's frame: metres east and north of base sample 0, and height.
    pub eye: DVec3,
    /// Planes in metres from the anchor.
    pub frustum: Frustum,
    /// Pixels that one metre at one metre's distance takes: height / (2 tan(fov / 2)).
    pub pixels: f64,
    /// Metres between samples.
    pub spacing_m: [f64; 2],
}

impl Stand {
    /// True when a box of base samples `lo..=hi` and heights `range_m` may be seen.
    pub fn sees(&self, lo: [i32; 2], hi: [i32; 2], range_m: [f32; 2]) -> bool {
        let at = |p: [i32; 2], h: f32| {
            let place = |a: usize| (f64::from(p[a] - self.plane.anchor[a]) * self.spacing_m[a]) as f32;
            Vec3::new(place(0), place(1), h - self.plane.anchor_height_m)
        };
        let (low, high) = (at(lo, range_m[0]), at(hi, range_m[1]));
        self.frustum.planes.iter().all(|p| {
            let n = Vec3::new(p[0], p[1], p[2]);
            let far = Vec3::select(n.cmpge(Vec3::ZERO), high, low);
            n.dot(far) + p[3] >= 0.0
        })
    }

    /// Distance of the camera from the nearest point of such a box, metres; 0 inside.
    pub fn distance_m(&self, lo: [i32; 2], hi: [i32; 2], range_m: [f32; 2]) -> f64 {
        let low = DVec3::new(
            f64::from(lo[0]) * self.spacing_m[0],
            f64::from(lo[1]) * self.spacing_m[1],
            range_m[0].into(),
        );
        let high = DVec3::new(
            f64::from(hi[0]) * self.spacing_m[0],
            f64::from(hi[1]) * self.spacing_m[1],
            range_m[1].into(),
        );
        self.eye.distance(self.eye.clamp(low, high))
    }

    /// Size on screen of a vertical error at a distance, pixels: as if seen from the side, the most it can be.
    pub fn error_px(&self, error_m: f32, distance_m: f64) -> f64 {
        f64::from(error_m) * self.pixels / distance_m.max(1e-3)
    }
}

/// The parts of a rival that are the same for all.
pub(crate) struct Stage {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub terrain: Terrain,
    pub scene: Scene,
    pub ground: Arc<Ground>,
    pub stand: Option<Stand>,
    frame: wgpu::Buffer,
    format: wgpu::TextureFormat,
}

/// Pipeline and frame binding of one vertex stage.
pub(crate) struct MeshPipeline {
    pub pipeline: wgpu::RenderPipeline,
    pub bind_group: wgpu::BindGroup,
}

impl Stage {
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
        terrain: &Terrain,
        scene: &Scene,
        ground: &Arc<Ground>,
    ) -> Self {
        let frame = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame"),
            size: size_of::<GpuFrame>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self {
            device: device.clone(),
            queue: queue.clone(),
            terrain: terrain.clone(),
            scene: scene.clone(),
            ground: ground.clone(),
            stand: None,
            frame,
            format,
        }
    }

    /// Takes a camera's place and writes the frame uniform; its bytes belong in the ledger.
    pub fn look(&mut self, camera: &Camera, size_px: [u32; 2]) -> (Stand, u64) {
        let plane = PlaneStand::of(&self.terrain, camera);
        let near = (camera.eye_m - plane.anchor_m).as_vec3();
        let of_anchor = clip(&self.terrain, camera, plane.anchor_m, size_px);
        let of_near = clip(&self.terrain, camera, plane.anchor_m + near.as_dvec3(), size_px);
        let frustum = Frustum { planes: Camera::planes(&of_anchor) };
        let frame = GpuFrame {
            clip_from_near: of_near.as_mat4().to_cols_array_2d(),
            planes: frustum.planes,
            eye_from_anchor_m: near.to_array(),
            fog_per_m: if self.scene.fog { fog_per_m(&self.terrain) as f32 } else { 0.0 },
            sun_direction: (camera.axes * sun_direction(&self.scene)).as_vec3().to_array(),
            ambient: 0.30,
            fog_color: self.scene.background,
            anchor_height_m: plane.anchor_height_m,
            height_range_m: self.ground.range_m,
            sample_step_m: 1.0,
            spacing_m: self.terrain.spacing_m.map(|v| v as f32),
            eye_samples: plane.eye_samples,
            anchor: plane.anchor,
            last: self.ground.last(),
            n: self.scene.n,
            window_cells: self.scene.n - 1,
            ..GpuFrame::zeroed()
        };
        self.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame));
        let [x, y] = self.terrain.samples_from_world(camera.eye_m);
        let spacing_m = self.terrain.spacing_m;
        let stand = Stand {
            plane,
            eye: DVec3::new(x * spacing_m[0], y * spacing_m[1], camera.eye_m.z),
            frustum,
            pixels: f64::from(size_px[1]) / (2.0 * (camera.fov_deg.to_radians() * 0.5).tan()),
            spacing_m,
        };
        self.stand = Some(stand);
        (stand, size_of::<GpuFrame>() as u64)
    }

    /// A buffer that can be written, drawn from and read back.
    pub fn buffer(
        &self,
        label: &'static str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, GpuError> {
        let most = self.device.limits().max_buffer_size;
        if bytes > most {
            return Err(GpuError::TooLarge { what: label, bytes, most });
        }
        Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes.max(16).next_multiple_of(4),
            usage: usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        }))
    }

    /// `vs_patch`: grids of [`GridVertex`] with a [`GridInstance`] each.
    pub fn grid_pipeline(&self) -> MeshPipeline {
        let vertex = wgpu::VertexBufferLayout {
            array_stride: size_of::<GridVertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32, 1 => Uint32],
        };
        let instance = wgpu::VertexBufferLayout {
            array_stride: size_of::<GridInstance>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &wgpu::vertex_attr_array![2 => Sint32x2, 3 => Uint32x4],
        };
        self.pipeline("vs_patch", shaders::RIVAL_MESH, &[Some(vertex), Some(instance)], false)
    }

    /// `vs_clip`: strips over the vertices of a classic clipmap, 20 bytes each.
    pub fn clip_pipeline(&self) -> MeshPipeline {
        let vertex = wgpu::VertexBufferLayout {
            array_stride: 20,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Sint32x2, 1 => Float32x2, 2 => Uint32],
        };
        self.pipeline("vs_clip", shaders::RIVAL_CLIPMAPS, &[Some(vertex)], true)
    }

    /// `vs_mesh`: any [`MeshVertex`].
    pub fn mesh_pipeline(&self) -> MeshPipeline {
        let vertex = wgpu::VertexBufferLayout {
            array_stride: size_of::<MeshVertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Sint32x2, 1 => Float32, 2 => Uint32],
        };
        self.pipeline("vs_mesh", shaders::RIVAL_MESH, &[Some(vertex)], false)
    }

    fn pipeline(
        &self,
        entry: &str,
        source: shaders::ShaderModuleSource,
        buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
        strips: bool,
    ) -> MeshPipeline {
        // Marks of errors and refills are ours alone: the others show their levels instead.
        let color = match self.scene.color {
            ColorMode::Error | ColorMode::Refill => ColorMode::Levels,
            color => color,
        };
        let scene = Scene { color, ..self.scene.clone() };
        let constants = (SPEC.constants)(variant(&scene, &self.terrain));
        let drawing = Drawing { vertex: entry, buffers, constants: &constants, strips, ..Drawing::default() };
        let module = create_module(&self.device, source, Samples::Plane);
        let pipeline = terrain_pipeline(&self.device, self.format, &module, &drawing);
        let bind_group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(entry),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: self.frame.as_entire_binding() }],
        });
        MeshPipeline { pipeline, bind_group }
    }

    /// Begins the draw: clears as the renderer of ours does.
    pub fn begin<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        target: Target<'_>,
    ) -> wgpu::RenderPass<'e> {
        begin_pass(encoder, target, self.scene.background, None)
    }
}

/// One draw of a grid: a range of the index buffer over one instance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GridDraw {
    /// Which of the vertex buffers.
    pub pool: usize,
    /// First index and count.
    pub indices: [u32; 2],
    /// The instance; `first` is the base vertex as well.
    pub instance: GridInstance,
}

/// This frame's draws of grids: filled by the method, uploaded, drawn and read back here.
#[derive(Default)]
pub(crate) struct GridDraws {
    pub draws: Vec<GridDraw>,
    instances: Option<wgpu::Buffer>,
}

impl GridDraws {
    /// The given draws, not uploaded yet.
    pub fn of(draws: Vec<GridDraw>) -> Self {
        Self { draws, instances: None }
    }

    /// Uploads the instances; their bytes (control data) belong in the ledger.
    ///
    /// # Errors
    /// When there are too many for a buffer.
    pub fn upload(&mut self, stage: &Stage) -> Result<u64, GpuError> {
        let all: Vec<GridInstance> = self.draws.iter().map(|d| d.instance).collect();
        let bytes = size_of_val(&all[..]) as u64;
        if self.instances.as_ref().is_none_or(|b| b.size() < bytes) {
            let room = bytes.next_power_of_two().max(4_096);
            self.instances = Some(stage.buffer("instances", room, wgpu::BufferUsages::VERTEX)?);
        }
        if let Some(buffer) = &self.instances {
            stage.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&all));
        }
        Ok(bytes)
    }

    /// Records all draws.
    pub fn record(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &MeshPipeline,
        pools: &[wgpu::Buffer],
        indices: &wgpu::Buffer,
        format: wgpu::IndexFormat,
    ) {
        let Some(instances) = &self.instances else { return };
        pass.set_pipeline(&pipeline.pipeline);
        pass.set_bind_group(0, &pipeline.bind_group, &[]);
        pass.set_vertex_buffer(1, instances.slice(..));
        pass.set_index_buffer(indices.slice(..), format);
        let mut bound = usize::MAX;
        for (k, draw) in (0_u32..).zip(&self.draws) {
            if draw.pool != bound {
                pass.set_vertex_buffer(0, pools[draw.pool].slice(..));
                bound = draw.pool;
            }
            let [first, count] = draw.indices;
            pass.draw_indexed(first..first + count, draw.instance.first.cast_signed(), k..k + 1);
        }
    }

    /// What they draw.
    pub fn count(&self) -> DrawCount {
        let indices: u64 = self.draws.iter().map(|d| u64::from(d.indices[1])).sum();
        DrawCount { triangles: indices / 3, draw_calls: self.draws.len() as u64 }
    }

    /// GPU bytes of the instances.
    pub fn gpu_bytes(&self) -> u64 {
        self.instances.as_ref().map_or(0, wgpu::Buffer::size)
    }

    /// The triangles as they lie in the buffers on the GPU.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read_mesh(
        &self,
        stage: &Stage,
        pools: &[wgpu::Buffer],
        indices: &wgpu::Buffer,
        format: wgpu::IndexFormat,
    ) -> Result<DrawnMesh, GpuError> {
        let (device, queue) = (&stage.device, &stage.queue);
        let nothing = || GpuError::Readback { reason: "no frame was drawn".into() };
        let stand = stage.stand.ok_or_else(nothing)?;
        let buffer = self.instances.as_ref().ok_or_else(nothing)?;
        let instances: Vec<GridInstance> = read_buffer(device, queue, buffer, self.draws.len())?;
        let numbers: Vec<u32> = match format {
            wgpu::IndexFormat::Uint16 => {
                let all: Vec<u16> = read_buffer(device, queue, indices, (indices.size() / 2) as usize)?;
                all.into_iter().map(u32::from).collect()
            }
            wgpu::IndexFormat::Uint32 => read_buffer(device, queue, indices, (indices.size() / 4) as usize)?,
        };
        let mut heights: Vec<Vec<GridVertex>> = Vec::new();
        for pool in pools {
            heights.push(read_buffer(device, queue, pool, (pool.size() / 8) as usize)?);
        }
        let mut mesh = DrawnMesh { anchor_m: stand.plane.anchor_m.to_array(), ..DrawnMesh::default() };
        let last = stage.ground.last();
        // Patterns are shared by many draws, and may use few of the vertices they span.
        let mut patterns: HashMap<[u32; 2], Pattern> = HashMap::new();
        for (draw, instance) in self.draws.iter().zip(&instances) {
            let [first, count] = draw.indices.map(|v| v as usize);
            let pattern =
                patterns.entry(draw.indices).or_insert_with(|| Pattern::of(&numbers[first..first + count]));
            let start = mesh.positions.len() as u32;
            for &local in &pattern.vertices {
                let (x, y) = (local % instance.side, local / instance.side);
                let base = [0, 1].map(|a| {
                    let along = if a == 0 { x } else { y };
                    (instance.lo[a] + (along * instance.step).cast_signed()).min(last[a])
                });
                let height = heights[draw.pool][(instance.first + local) as usize].height;
                mesh.positions.push(place(&stand, base, height));
            }
            mesh.triangles.extend(pattern.triangles.iter().map(|t| t.map(|ix| start + ix)));
        }
        Ok(mesh)
    }
}

/// An index pattern over the vertices that it uses.
struct Pattern {
    vertices: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

impl Pattern {
    fn of(indices: &[u32]) -> Self {
        let mut vertices = indices.to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let place = |ix: u32| vertices.binary_search(&ix).unwrap_or_default() as u32;
        let triangles = indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(place)).collect();
        Self { vertices, triangles }
    }
}

/// Position of a vertex from the anchor, with the operations of rivals/mesh.wgsl.
pub(crate) fn place(stand: &Stand, base: [i32; 2], height: f32) -> [f32; 3] {
    let along = |a: usize| (base[a] - stand.plane.anchor[a]) as f32 * stand.spacing_m[a] as f32;
    [along(0), along(1), height - stand.plane.anchor_height_m]
}
