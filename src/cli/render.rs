//! `tessclip render`: one picture.

use std::path::PathBuf;

use tessclip::gpu::Gpu;

use super::Outcome;
use super::args::{LookArgs, ShapeArgs, TerrainArgs, camera, check_writable};
use super::picture::{picture, write_png};

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
    /// PNG to write
    #[arg(short, long, value_name = "P.png")]
    output: PathBuf,
}

pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    check_writable(&args.output)?;
    let terrain = args.terrain.open()?;
    let camera = camera(&terrain, args.camera.as_deref(), args.look.fov)?;
    let scene = args.look.apply(args.shape.scene());
    scene.shape(&terrain)?;
    let gpu = Gpu::new()?;
    log::info!("adapter: {}", gpu.describe());
    let rgba = picture(&gpu, &terrain, &scene, &camera, args.look.size)?;
    write_png(&args.output, &rgba, args.look.size)?;
    Ok(Outcome::Done)
}
