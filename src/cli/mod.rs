//! One file a subcommand. Exit codes: 0 done, 1 a check fell short, 2 unusable input or arguments.

pub(crate) mod args;
pub(crate) mod beside;
mod build;
mod check;
mod compare;
mod demo;
mod export;
pub(crate) mod factor_args;
mod film;
mod fly;
mod footprints;
mod info;
#[cfg(feature = "viewer")]
pub(crate) mod line;
mod mesh;
pub(crate) mod paths;
mod picture;
mod plan;
pub(crate) mod png_pose;
mod render;
mod scene_file;
#[cfg(feature = "viewer")]
pub(crate) mod scene_writer;
mod stores;
mod terrain_args;
mod verify;
#[cfg(feature = "viewer")]
pub(crate) mod view;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Very large terrain by geometry clipmaps whose mesh is made on the GPU.
#[derive(Parser)]
#[command(version, about, max_term_width = 100)]
struct Cli {
    /// More words about what happens; twice for the GPU library's own
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
    /// Errors only
    #[arg(short, long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// The main job with no data given: procedural terrain, a flight, pictures and a report
    Demo(demo::Args),
    /// What a DEM holds
    Info(info::Args),
    /// The tiled store: DEMs of any size, pyramid, checksums
    Build(build::Args),
    /// Is every byte of a store as it was written?
    Verify(verify::Args),
    /// One picture
    Render(render::Args),
    /// The window: fly over it, see what the method does, record what you saw
    #[cfg(feature = "viewer")]
    View(view::Args),
    /// The mesh as the GPU made it, read back, as binary PLY
    Mesh(mesh::Args),
    /// Vertices and bytes that reach the GPU, ours beside the classic footprints
    Footprints(footprints::Args),
    /// A benchmark flight
    Fly(fly::Args),
    /// Rival methods on the same data, path and device: upload, frame times, error against run time
    Compare(compare::Args),
    /// Invariants of the mesh: a table of figures against bounds
    Check(check::Args),
    /// What a scene is turned into: passes, memory, and what is left out and why
    Plan(plan::Args),
}

/// How a command ended without an error.
enum Outcome {
    Done,
    FellShort,
}

/// Runs the command line and gives its exit code.
pub fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    let level = match (cli.quiet, cli.verbose) {
        (true, _) => log::LevelFilter::Error,
        (false, 0) => log::LevelFilter::Warn,
        (false, 1) => log::LevelFilter::Info,
        (false, _) => log::LevelFilter::Debug,
    };
    // What the window library warns of at every start on a virtual screen concerns nobody.
    let windows = if cli.verbose == 0 { log::LevelFilter::Error } else { level };
    env_logger::Builder::new().filter_level(level).filter_module("winit", windows).init();
    let outcome = match &cli.command {
        Command::Demo(args) => demo::run(args, cli.quiet),
        Command::Info(args) => info::run(args),
        Command::Build(args) => build::run(args, cli.quiet),
        Command::Verify(args) => verify::run(args, cli.quiet),
        Command::Render(args) => render::run(args),
        #[cfg(feature = "viewer")]
        Command::View(args) => view::run(args),
        Command::Mesh(args) => mesh::run(args),
        Command::Footprints(args) => footprints::run(args),
        Command::Fly(args) => fly::run(args, cli.quiet),
        Command::Check(args) => check::run(args),
        Command::Compare(args) => compare::run(args, cli.quiet),
        Command::Plan(args) => plan::run(args),
    };
    match outcome {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::FellShort) => ExitCode::from(1),
        Err(error) => {
            // One line, whatever a library put into its own message.
            let line = format!("{error:#}").split_whitespace().collect::<Vec<_>>().join(" ");
            eprintln!("tessclip: error: {line}");
            ExitCode::from(2)
        }
    }
}

/// Help and version as they are; a mistake in one line.
fn usage(error: &clap::Error) -> ExitCode {
    use clap::error::ErrorKind as Kind;
    if matches!(
        error.kind(),
        Kind::DisplayHelp | Kind::DisplayVersion | Kind::DisplayHelpOnMissingArgumentOrSubcommand
    ) {
        // A closed pipe is no reason to complain.
        let _ = error.print();
        return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
    }
    let text = error.to_string();
    let what: Vec<&str> = text
        .lines()
        .map(str::trim)
        .take_while(|l| !l.starts_with("Usage:") && !l.starts_with("For more") && !l.starts_with("tip:"))
        .filter(|l| !l.is_empty())
        .collect();
    let what = what.join(" ");
    eprintln!("tessclip: {}; see --help", what.strip_suffix('.').unwrap_or(&what));
    ExitCode::from(2)
}

/// Prints to standard output; a closed pipe (`| head`) ends the program quietly.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    use std::io::Write as _;
    match writeln!(std::io::stdout(), "{text}") {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        other => Ok(other?),
    }
}
