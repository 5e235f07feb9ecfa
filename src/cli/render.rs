//! `tessclip render`: one picture.

use std::path::PathBuf;

use tessclip::gpu::Gpu;

use super::Outcome;
use super::args::{LookArgs, ShapeArgs, TerrainArgs, WaitArgs, camera, check_writable};
use super::picture::{picture, write_png};
use super::scene_file::SceneFile;

#[derive(clap::Args)]
#[command(
    after_help = "Example: tessclip render procedural:mountains --camera 15000,2000,3500,0,-15 -o view.png"
)]
pub struct Args {
    #[command(flatten)]
    terrain: TerrainArgs,
    #[command(flatten)]
    shape: ShapeArgs,
    #[command(flatten)]
    look: LookArgs,
    /// x,y,z,yaw,pitch in the terrain's own units; by default all of it from the south
    #[arg(long, value_name = "POSE", allow_hyphen_values = true)]
    camera: Option<String>,
    #[command(flatten)]
    wait: WaitArgs,
    /// PNG to write
    #[arg(short, long, value_name = "P.png")]
    output: PathBuf,
}

pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    check_writable(&args.output)?;
    let file = SceneFile::of(&args.terrain.terrain)?;
    let scene = args.look.apply(args.shape.scene(&file)?, &file);
    let terrain = args.terrain.over(&file).open()?;
    let pose = args.camera.as_deref().or(file.pose.as_deref());
    let camera = camera(&terrain, pose, args.look.fov(&file))?;
    scene.shape(&terrain)?;
    let gpu = Gpu::new()?;
    log::info!("adapter: {}", gpu.describe());
    let size = args.look.size(&file);
    let rgba = picture(&gpu, &terrain, &scene, &camera, size, args.wait.wait)?;
    write_png(&args.output, &rgba, size)?;
    Ok(Outcome::Done)
}
