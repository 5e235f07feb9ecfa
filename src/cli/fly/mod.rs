//! `tessclip fly`: a benchmark flight. Closed loop (each frame starts when the last is done), or open loop
//! (frames are due at a fixed rate, whatever became of those before).

mod cracks;
mod flight;
mod memory;
mod summary;

use std::path::PathBuf;

use tessclip::Terrain;
use tessclip::gpu::Gpu;

use super::Outcome;
use super::args::{LookArgs, ShapeArgs, TerrainArgs};
use super::paths::{Course, Tempo};
use super::scene_file::SceneFile;

pub use self::flight::{Flight, progress};
pub use self::summary::one_line;

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    tessclip fly procedural:mountains --path double-turn --frames 300 --report out\n  \
    tessclip fly terrain.zarr --path random-walk --speed 8 --hz 60 --frames 3000 --report out")]
pub struct Args {
    #[command(flatten)]
    terrain: TerrainArgs,
    #[command(flatten)]
    shape: ShapeArgs,
    #[command(flatten)]
    look: LookArgs,
    /// straight, double-turn, circle, random-walk, orbit-to-ground, follow (20 m above the ground),
    /// teleport (another place every second), spin (on the spot, a turn in 2 s), still, or a CSV file
    /// t,x,y,z,yaw,pitch
    #[arg(long, default_value = "double-turn")]
    path: String,
    /// Frames to measure
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Speed over the ground in windows of the finest level a second, 0.1 to 64: a frame is then 1/60 s of
    /// path time (1/H with --hz) and a path that is too short is flown back and forth; teleport moves so
    /// between its jumps, spin takes no notice. By default the whole path is spread over the frames
    #[arg(long, value_name = "W", value_parser = parse_speed)]
    speed: Option<f64>,
    /// Open loop: frame k is due k/H s after the start, 1 to 1000; late frames are counted, none is left out
    #[arg(long, value_name = "H", value_parser = clap::value_parser!(u32).range(1..=1000))]
    hz: Option<u32>,
    /// Streamed terrain: wait until the first view is complete; by default the flight starts with a cold
    /// cache
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    wait: Option<bool>,
    /// Look for cracks after K frames, evenly spaced: the picture (over magenta, without fog) and the mesh
    /// are read back outside the measured time; exit code 1 when there are any
    #[arg(long, value_name = "K", default_value_t = 0, conflicts_with = "hz")]
    cracks: u32,
    /// For tests: the device is lost before this frame
    #[arg(long, value_name = "FRAME", hide = true)]
    lose_device_at: Option<u32>,
    /// Directory for report.json, frames.csv and report.html
    #[arg(long, value_name = "DIR")]
    report: PathBuf,
    /// Print the runs of report.json
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, quiet: bool) -> anyhow::Result<Outcome> {
    let file = SceneFile::of(&args.terrain.terrain)?;
    let mut scene = args.look.apply(args.shape.scene(&file)?, &file);
    let terrain = args.terrain.over(&file).open()?;
    if args.cracks > 0 {
        scene.background = cracks::BACKGROUND;
        scene.fog = false;
    }
    let window_m = window_m(scene.shape(&terrain)?.n(), &terrain);
    let tempo = Tempo { frames: args.frames, hz: args.hz, speed_m_s: args.speed.map(|w| w * window_m) };
    let course = Course::open(&args.path, &terrain, tempo)?;
    course.at(0, args.look.fov(&file)).1.validate()?;
    let gpu = Gpu::new()?;
    let flight = Flight {
        name: &args.terrain.terrain,
        terrain: &terrain,
        scene,
        size: args.look.size(&file),
        fov_deg: args.look.fov(&file),
        course,
        wait: args.wait.unwrap_or(false),
        cracks: args.cracks,
        lose_device_at: args.lose_device_at,
    };
    let report = flight.fly(&gpu, &args.report, quiet)?;
    if args.json {
        super::print(&serde_json::to_string_pretty(&report.runs)?)?;
    } else {
        for run in &report.runs {
            super::print(&summary::one_line(run))?;
        }
        let report = args.report.display();
        super::print(&format!("wrote report.json, frames.csv and report.html to {report}"))?;
    }
    let whole = report.runs.iter().all(|r| r.valid && !r.cracks.is_some_and(|c| c.found()));
    Ok(if whole { Outcome::Done } else { Outcome::FellShort })
}

/// Side of the finest level's window, metres.
fn window_m(n: u32, terrain: &Terrain) -> f64 {
    f64::from(n - 1) * terrain.spacing_m[0].max(terrain.spacing_m[1])
}

fn parse_speed(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(speed) if (0.1..=64.0).contains(&speed) => Ok(speed),
        _ => Err("give 0.1 to 64 windows a second".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::parse_speed;

    #[test]
    fn speeds_out_of_range_are_refused() {
        assert_eq!(parse_speed("0.1"), Ok(0.1));
        assert_eq!(parse_speed("64"), Ok(64.0));
        for bad in ["0", "0.09", "64.1", "-1", "NaN", "inf", "fast", ""] {
            assert!(parse_speed(bad).is_err(), "{bad}");
        }
    }
}
