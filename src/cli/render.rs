//! `tessclip render`: one picture.

use std::path::PathBuf;

use anyhow::{Context as _, bail};
use tessclip::gpu::Gpu;
use tessclip::rivals::Method;
use tessclip::{Camera, ColorMode, Scene};

use super::Outcome;
use super::args::{LookArgs, ShapeArgs, TerrainArgs, WaitArgs, camera_at, check_writable, pose_words};
use super::beside::parse_method;
use super::film::{self, Film};
use super::picture::{Shot, shoot};
use super::png_pose::{CAMERA, RENDER, SOFTWARE, TERRAIN, own_line, write_png_with};
use super::scene_file::SceneFile;

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    tessclip render procedural:mountains --camera 15000,2000,3500,0,-15 -o view.png\n  \
    tessclip render procedural:mountains --beside geomipmap --wireframe --n 63 -o beside.png\n  \
    tessclip render procedural:mountains --path circle --frames 48 --size 480x270 -o film.gif")]
pub struct Args {
    #[command(flatten)]
    terrain: TerrainArgs,
    #[command(flatten)]
    shape: ShapeArgs,
    #[command(flatten)]
    look: LookArgs,
    #[command(flatten)]
    stand: StandArgs,
    /// With --color refill: the frame before was drawn from here, and what this frame refilled is coloured; by
    /// default there is none before, and all is
    #[arg(long, value_name = "POSE", allow_hyphen_values = true)]
    from: Option<String>,
    /// Film a path, a name or a CSV file as for fly, into a GIF
    #[arg(long, value_name = "P", conflicts_with_all = ["camera", "freeze", "beside", "from", "metadata"])]
    path: Option<String>,
    /// Frames of the film
    #[arg(long, value_name = "K", default_value_t = 24, requires = "path",
        value_parser = clap::value_parser!(u32).range(film::FRAMES[0]..=film::FRAMES[1]))]
    frames: u32,
    #[command(flatten)]
    wait: WaitArgs,
    /// Write terrain and command line into the picture, beside its pose; without it equal pictures are equal files
    #[arg(long)]
    metadata: bool,
    /// PNG to write, with --path a GIF
    #[arg(short, long, value_name = "P.png")]
    output: PathBuf,
}

/// Where it is seen from, and what is drawn beside it.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct StandArgs {
    /// x,y,z,yaw,pitch in the terrain's own units; by default all of it from the south
    #[arg(long, value_name = "POSE", allow_hyphen_values = true)]
    camera: Option<String>,
    /// Windows, factors and culling stay with this pose; the picture is drawn from --camera
    #[arg(long, value_name = "POSE", allow_hyphen_values = true)]
    freeze: Option<String>,
    /// A rival in the right half, at the detail of --n and --levels, and ours in the left one: a method as for compare;
    /// it follows --camera also with --freeze, and only ours has edges and bounds
    #[arg(long, value_name = "METHOD", value_parser = parse_method)]
    beside: Option<Method>,
}

/// What a command line asks for together with the scene file that TERRAIN may name.
pub struct Asked {
    /// The terrain itself, never a scene file.
    pub terrain: TerrainArgs,
    /// How it is drawn.
    pub scene: Scene,
    /// Vertical field of view, degrees.
    pub fov_deg: f64,
    /// Pose in the terrain's own units, where one is given.
    pub pose: Option<[f64; 5]>,
    /// Pose that windows, factors and culling stay with.
    pub frozen: Option<[f64; 5]>,
    /// Rival in the right half.
    pub beside: Option<Method>,
    /// Width and height in pixels.
    pub size: [u32; 2],
}

impl Asked {
    /// Puts the wishes together; the terrain is not opened.
    pub fn of(
        terrain: &TerrainArgs,
        shape: &ShapeArgs,
        look: &LookArgs,
        stand: &StandArgs,
    ) -> anyhow::Result<Self> {
        let file = SceneFile::of(&terrain.terrain)?;
        let pose = stand.camera.as_deref().or(file.pose.as_deref());
        let frozen = stand.freeze.as_deref().or(file.freeze.as_deref());
        let asked = Self {
            scene: look.apply(shape.scene(&file)?, &file),
            terrain: terrain.over(&file),
            fov_deg: look.fov(&file),
            pose: pose.map(Camera::parse_pose).transpose()?,
            frozen: frozen.map(Camera::parse_pose).transpose().context("freeze")?,
            beside: stand.beside.or(file.beside),
            size: look.size(&file),
        };
        if asked.beside.is_some() && asked.size[0] < 2 {
            bail!("--beside needs a picture that is at least 2 pixels wide");
        }
        Ok(asked)
    }
}

impl Args {
    /// What this command line asks for.
    pub fn asked(&self) -> anyhow::Result<Asked> {
        Asked::of(&self.terrain, &self.shape, &self.look, &self.stand)
    }
}

pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    check_writable(&args.output)?;
    let asked = args.asked()?;
    let before = args.from.as_deref().map(Camera::parse_pose).transpose().context("--from")?;
    if before.is_some() && asked.scene.color != ColorMode::Refill {
        bail!("--from has no meaning without --color refill; leave it out");
    }
    if args.path.is_some() {
        film::check_name(&args.output)?;
        if asked.frozen.is_some() || asked.beside.is_some() {
            bail!(
                "--path films neither camera.freeze nor look.beside of the scene file: take them out of it"
            );
        }
    }
    let terrain = asked.terrain.open()?;
    if let Some(path) = &args.path {
        asked.scene.shape(&terrain)?;
        let film = Film {
            terrain: &terrain,
            scene: &asked.scene,
            path,
            frames: args.frames,
            fov_deg: asked.fov_deg,
            size: asked.size,
            wait: args.wait.wait,
        };
        film.shoot(&Gpu::new()?, &args.output)?;
        return Ok(Outcome::Done);
    }
    let at = |pose: Option<[f64; 5]>| camera_at(&terrain, pose, asked.fov_deg);
    let camera = at(asked.pose)?;
    let shot = Shot {
        scene: &asked.scene,
        camera,
        size: asked.size,
        wait: args.wait.wait,
        frozen: asked.frozen.map(|pose| at(Some(pose))).transpose().context("freeze")?,
        beside: asked.beside,
        before: before.map(|pose| at(Some(pose))).transpose().context("--from")?,
    };
    asked.scene.shape(&terrain)?;
    let gpu = Gpu::new()?;
    log::info!("adapter: {}", gpu.describe());
    let rgba = shoot(&gpu, &terrain, &shot)?;
    let pose = pose_words(asked.pose.unwrap_or_else(|| terrain.pose(&camera)));
    let line = own_line();
    let mut text = vec![SOFTWARE, (CAMERA, pose.as_str())];
    if args.metadata {
        text.extend([(TERRAIN, args.terrain.terrain.as_str()), (RENDER, line.as_str())]);
    }
    write_png_with(&args.output, &rgba, asked.size, &text)?;
    Ok(Outcome::Done)
}
