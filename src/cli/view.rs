//! `tessclip view`: a window to fly through a terrain. Here is what it is asked for; the viewer does the rest.

use std::path::PathBuf;

use anyhow::{Context as _, bail};
use clap::ValueEnum;
use tessclip::Terrain;

use super::Outcome;
use super::args::{LookArgs, ShapeArgs, TerrainArgs, camera_at};
use super::paths::{CameraPath, Tempo};
use super::render::{Asked, StandArgs};
use super::scene_file::SceneFile;
use crate::viewer::Start;
use crate::viewer::look::Look;

/// How frames keep to the screen's rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Vsync {
    /// As fifo, but a late frame is shown at once where the screen can
    Auto,
    /// Each frame waits for the screen
    Fifo,
    /// The screen takes the newest frame
    Mailbox,
    /// Frames are shown at once and may tear
    Immediate,
}

impl Vsync {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Fifo => "fifo",
            Self::Mailbox => "mailbox",
            Self::Immediate => "immediate",
        }
    }
}

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    tessclip view procedural:mountains\n  \
    tessclip view dem.tif --pixel-error 1 --camera=-70.5,-32.9,6000,30,-10 --path circle")]
pub struct Args {
    #[command(flatten)]
    terrain: TerrainArgs,
    #[command(flatten)]
    shape: ShapeArgs,
    #[command(flatten)]
    look: LookArgs,
    #[command(flatten)]
    stand: StandArgs,
    /// Play this path from the start: a name or a CSV file, as for fly
    #[arg(long, value_name = "P")]
    path: Option<String>,
    /// How frames keep to the screen's rate
    #[arg(long, value_enum, value_name = "KIND", default_value = "auto")]
    vsync: Vsync,
    /// Print one line of JSON to standard output whenever something happens that a script may wait for
    #[arg(long)]
    state: bool,
    /// Without panels; F3 shows them
    #[arg(long)]
    no_hud: bool,
    /// For tests: quit after so many frames
    #[arg(long, value_name = "N", hide = true, value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    /// For tests: the device is lost before this frame
    #[arg(long, value_name = "FRAME", hide = true)]
    lose_device_at: Option<u32>,
    /// Directory for screenshots, recorded paths and saved scenes
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> anyhow::Result<Outcome> {
    if !args.out.is_dir() {
        bail!("{}: no such directory; make it first", args.out.display());
    }
    let asked = Asked::of(&args.terrain, &args.shape, &args.look, &args.stand)?;
    let terrain = open(&asked)?;
    if let Some(path) = &args.path {
        // Before a window is opened for nothing.
        let tempo = Tempo { frames: 2, hz: None, speed_m_s: None };
        CameraPath::open(path, &terrain, &tempo)?;
    }
    crate::viewer::run(Start {
        look: look_of(&asked),
        terrain_args: asked.terrain,
        terrain,
        pose: asked.pose,
        path: args.path.clone(),
        vsync: args.vsync,
        state: args.state,
        frames: args.frames,
        out: args.out.clone(),
        size: asked.size,
        lose_device_at: args.lose_device_at,
        no_hud: args.no_hud,
    })?;
    Ok(Outcome::Done)
}

/// A terrain that was named while the viewer runs.
pub struct Opened {
    /// How it was named and read.
    pub terrain_args: TerrainArgs,
    /// The terrain, its heights as they were read: the look has the factor.
    pub terrain: Terrain,
    /// That of a scene file; nothing else brings one.
    pub look: Option<Look>,
    /// Pose in the terrain's own units, where a scene file has one.
    pub pose: Option<[f64; 5]>,
}

/// Opens a DEM, a store or a scene file by its name. Of what was said for the terrain before only how stores are
/// streamed is kept: the rest was about that one.
pub fn reopen(terrain: &str, args: &TerrainArgs) -> anyhow::Result<Opened> {
    let (shape, look, stand) = (ShapeArgs::default(), LookArgs::default(), StandArgs::default());
    let asked = Asked::of(&args.another(terrain), &shape, &look, &stand)?;
    Ok(Opened {
        terrain: open(&asked)?,
        look: SceneFile::is_one(terrain).then(|| look_of(&asked)),
        pose: asked.pose,
        terrain_args: asked.terrain,
    })
}

/// Opens the terrain with its heights as they were read, and makes sure that what is asked for can be drawn of it.
fn open(asked: &Asked) -> anyhow::Result<Terrain> {
    let terrain = asked.terrain.open_plain()?;
    let drawn = asked.terrain.exaggerated(terrain.clone(), asked.terrain.factor())?;
    camera_at(&drawn, asked.pose, asked.fov_deg)?;
    if asked.frozen.is_some() {
        camera_at(&drawn, asked.frozen, asked.fov_deg).context("freeze")?;
    }
    asked.scene.shape(&drawn)?;
    Ok(terrain)
}

fn look_of(asked: &Asked) -> Look {
    Look {
        scene: asked.scene.clone(),
        exaggeration: asked.terrain.factor(),
        fov_deg: asked.fov_deg,
        frozen: asked.frozen,
        beside: asked.beside,
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use tessclip::surface::Base;

    use super::*;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    fn args(given: &[&str]) -> Args {
        Line::try_parse_from([&["view"], given].concat()).unwrap_or_else(|e| panic!("{e}")).args
    }

    #[test]
    fn kinds_of_vsync_have_the_names_of_the_command_line() {
        for kind in Vsync::value_variants() {
            assert_eq!(args(&["procedural:plain", "--vsync", kind.name()]).vsync, *kind);
        }
        assert_eq!(args(&["procedural:plain"]).vsync, Vsync::Auto);
    }

    #[test]
    fn another_terrain_keeps_nothing_but_the_streaming() {
        let said = ["procedural:plain", "--base=torus:9000,2000", "--exaggeration=3", "--cache-mb=64"];
        let opened = reopen("procedural:dunes?size=65", &args(&said).terrain).expect("a terrain");
        assert_eq!(opened.terrain_args.options(), ["--cache-mb=64"]);
        assert_eq!((opened.terrain_args.factor(), opened.terrain.base()), (1.0, Base::Plane));
        assert_eq!((opened.look, opened.pose), (None, None));
        assert!(reopen("/no/such/dem.tif", &args(&said).terrain).is_err());
    }

    #[test]
    fn a_scene_file_brings_its_look_and_pose_and_heights_stay_as_read() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let at = folder.path().join("scene.toml");
        let text = "[terrain]\nsource = 'procedural:mountains?size=65'\nexaggeration = 2.5\n\
                    [look]\ncolor = 'slope'\nbeside = 'roam'\n\
                    [camera]\npose = [1, 2, 300, 4, 5]\nfreeze = [6, 7, 800, 9, 10]\nfov = 45\n";
        std::fs::write(&at, text).expect("written");
        let opened =
            reopen(at.to_str().expect("text"), &args(&["procedural:plain"]).terrain).expect("a scene");
        let look = opened.look.expect("a look");
        assert_eq!((look.exaggeration, look.fov_deg), (2.5, 45.0));
        assert_eq!(look.frozen, Some([6.0, 7.0, 800.0, 9.0, 10.0]));
        assert_eq!(look.beside, Some(tessclip::rivals::Method::Roam));
        assert_eq!(look.scene.color, tessclip::ColorMode::Slope);
        assert_eq!(opened.pose, Some([1.0, 2.0, 300.0, 4.0, 5.0]));
        let plain = reopen("procedural:mountains?size=65", &opened.terrain_args).expect("a terrain").terrain;
        assert_eq!(opened.terrain.source.height_range(), plain.source.height_range());
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_before_a_window_opens() {
        let plain = "procedural:plain?size=65";
        for (given, words) in [
            ([plain, "--n", "100"], "100"),
            ([plain, "--fov", "180"], "180"),
            ([plain, "--exaggeration", "1e7"], "1e6"),
            (["procedural:planet?size=257", "--freeze", "0,100,1,0,0"], "freeze"),
            ([plain, "--out", "/no/such/folder"], "/no/such/folder"),
        ] {
            let error = run(&args(&given)).err().map(|e| format!("{e:#}"));
            assert!(error.as_ref().is_some_and(|e| e.contains(words)), "{given:?}: {error:?}");
        }
    }
}
