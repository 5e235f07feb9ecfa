//! `tessclip mesh`: the GPU's own mesh as binary PLY.

use std::path::PathBuf;

use tessclip::Renderer;
use tessclip::gpu::{Gpu, Offscreen};
use tessclip::measure::Mesh;

use super::Outcome;
use super::args::{FOV_DEG, SIZE, ShapeArgs, TerrainArgs, WaitArgs, camera, check_writable, write_whole};
use super::picture::draw_complete;
use super::scene_file::SceneFile;

#[derive(clap::Args)]
#[command(after_help = "Example: tessclip mesh procedural:mountains --no-cull -o mesh.ply")]
pub struct Args {
    #[command(flatten)]
    terrain: TerrainArgs,
    #[command(flatten)]
    shape: ShapeArgs,
    /// x,y,z,yaw,pitch in the terrain's own units; by default all of it from the south
    #[arg(long, value_name = "POSE", allow_hyphen_values = true)]
    camera: Option<String>,
    /// Vertical field of view in degrees (what is culled depends on it); by default 60
    #[arg(long)]
    fov: Option<f64>,
    /// Picture size the mesh is made for (what is culled depends on its aspect); by default 1280x720
    #[arg(long, value_name = "WxH", value_parser = super::args::parse_size)]
    size: Option<[u32; 2]>,
    #[command(flatten)]
    wait: WaitArgs,
    /// PLY to write
    #[arg(short, long, value_name = "M.ply")]
    output: PathBuf,
}

pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    check_writable(&args.output)?;
    let file = SceneFile::of(&args.terrain.terrain)?;
    let scene = args.shape.scene(&file)?;
    let terrain = args.terrain.over(&file).open()?;
    let pose = args.camera.as_deref().or(file.pose.as_deref());
    let camera = camera(&terrain, pose, args.fov.or(file.fov).unwrap_or(FOV_DEG))?;
    scene.shape(&terrain)?;
    let gpu = Gpu::new()?;
    let target = Offscreen::new(&gpu.device, args.size.or(file.size).unwrap_or(SIZE))?;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, Offscreen::FORMAT, &terrain, &scene)?;
    draw_complete(&gpu, &mut renderer, &target, &camera, args.wait.wait)?;
    let mesh = Mesh::from_gpu(&renderer.read_mesh()?);
    write_whole(
        &args.output,
        &ply(&mesh, matches!(terrain.base(), tessclip::surface::Base::Ellipsoid { .. })),
    )?;
    super::print(&format!(
        "{}: {} vertices, {} triangles",
        args.output.display(),
        mesh.vertices.len(),
        mesh.triangles.len()
    ))?;
    Ok(Outcome::Done)
}

/// Binary little-endian PLY: double x, y, z (world metres), uchar level; triangles counter-clockwise
/// from above.
fn ply(mesh: &Mesh, globe: bool) -> Vec<u8> {
    let axes = if globe { "Earth-centred, Earth-fixed" } else { "x east, y north, z up" };
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\ncomment tessclip {}: world metres, {}\n\
         element vertex {}\nproperty double x\nproperty double y\nproperty double z\nproperty uchar level\n\
         element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        env!("CARGO_PKG_VERSION"),
        axes,
        mesh.vertices.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for (p, level) in mesh.vertices.iter().zip(&mesh.levels) {
        out.extend(p.iter().flat_map(|v| v.to_le_bytes()));
        out.push(u8::try_from(*level).unwrap_or(u8::MAX));
    }
    for t in &mesh.triangles {
        out.push(3);
        out.extend(t.iter().flat_map(|ix| ix.to_le_bytes()));
    }
    out
}
