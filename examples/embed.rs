//! Terrain in your own engine: your device, your encoder, your target, an f64 camera.
//!
//! `cargo run --release --example embed` writes embed.png.

use glam::DVec3;
use tessclip::gpu::Gpu;
use tessclip::heights::ReadOptions;
use tessclip::{Camera, Prefilter, Renderer, Scene, Target, Terrain, open_terrain};

const SIZE: [u32; 2] = [1024, 576];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // What an engine has already: a device, a queue and textures. (`Gpu` is only a short way to get one.)
    let Gpu { device, queue, .. } = Gpu::new()?;
    let texture = |format, usage| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: Some("the engine's own target"),
            size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
            view_formats: &[],
        })
    };
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    let color = texture(format, wgpu::TextureUsages::COPY_SRC);
    let depth = texture(wgpu::TextureFormat::Depth32Float, wgpu::TextureUsages::empty());
    let view = |t: &wgpu::Texture| t.create_view(&wgpu::TextureViewDescriptor::default());
    let (color_view, depth_view) = (view(&color), view(&depth));

    // The terrain and its renderer: once.
    let grid = open_terrain("procedural:mountains?seed=5&size=1025", &ReadOptions::default())?;
    let terrain = Terrain::new(&grid, Prefilter::default());
    let mut renderer =
        Renderer::new(&device, &queue, format, &terrain, &Scene { n: 127, ..Scene::default() })?;

    // A frame: prepare uploads what the camera needs, record adds the passes to your encoder.
    let ground = terrain.ground_height_m(15_000.0, 3_000.0).map_or(0.0, f64::from);
    let eye_m = DVec3::new(15_000.0, 3_000.0, ground + 900.0);
    let camera = Camera { eye_m, yaw_deg: 0.0, pitch_deg: -12.0, fov_deg: 60.0, ..Camera::default() };
    let upload = renderer.prepare(&camera, SIZE)?;
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    renderer.record(&mut encoder, Target { color: &color_view, depth: &depth_view, clear: true, area: None });
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("picture"),
        size: u64::from(SIZE[0] * SIZE[1] * 4),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    // 1024 pixels of 4 bytes: rows need no padding.
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(SIZE[0] * 4), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        color.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
        color.size(),
    );
    queue.submit([encoder.finish()]);
    println!(
        "first frame: {} bytes of control data, {} bytes of heights",
        upload.control_bytes, upload.height_bytes
    );

    // The next frame of a camera that stands still sends nothing but its uniform.
    let again = renderer.prepare(&camera, SIZE)?;
    println!(
        "standing still: {} bytes of control data, {} of heights",
        again.control_bytes, again.height_bytes
    );

    buffer.slice(..).map_async(wgpu::MapMode::Read, |_| ());
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let pixels = buffer.slice(..).get_mapped_range()?.to_vec();
    image::save_buffer("embed.png", &pixels, SIZE[0], SIZE[1], image::ColorType::Rgba8)?;
    Ok(())
}
