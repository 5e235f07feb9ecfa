//! `tessclip check`: the invariants, tried.

use tessclip::gpu::Gpu;
use tessclip::heights::{HeightGrid, ReadOptions, open_terrain};
use tessclip::measure::invariants::{CheckRow, Effort, check_gpu, check_twin};
use tessclip::{Prefilter, Terrain};

use super::Outcome;
use super::args::ReadArgs;

/// An odd size, so that no level but the finest divides the data evenly.
const DEFAULT: &str = "procedural:mountains?width=763&height=582";

#[derive(clap::Args)]
#[command(after_help = "Example: tessclip check procedural:cliff --json")]
pub struct Args {
    /// A DEM file, a scene file NAME.toml or procedural:NAME; by default procedural mountains of an awkward size
    terrain: Option<String>,
    #[command(flatten)]
    read: ReadArgs,
    /// Fewer cases, in seconds
    #[arg(long)]
    brief: bool,
    /// Machine-readable
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    let grid = args.read.read(args.terrain.as_deref().unwrap_or(DEFAULT))?;
    let effort = if args.brief { Effort::Brief } else { Effort::Full };
    let gpu = Gpu::new()?;
    let rows = rows(&gpu, &grid, effort)?;
    let pass = rows.iter().all(|r| r.pass);
    if args.json {
        super::print(&serde_json::to_string_pretty(&serde_json::json!({ "rows": rows, "pass": pass }))?)?;
    } else {
        print_rows(&rows)?;
        super::print(&format!("{} on {}", if pass { "all hold" } else { "FAILED" }, gpu.describe()))?;
    }
    Ok(if pass { Outcome::Done } else { Outcome::FellShort })
}

/// All rows: the twin on a small terrain of odd size, the GPU on the terrain asked for.
pub fn rows(gpu: &Gpu, grid: &HeightGrid, effort: Effort) -> anyhow::Result<Vec<CheckRow>> {
    // The twin is slow by intent; layout faults show on a small terrain as well.
    let small = open_terrain("procedural:mountains?width=203&height=150", &ReadOptions::default())?;
    let mut rows = check_twin(&Terrain::new(&small, Prefilter::Subsample), effort);
    rows.extend(check_gpu(gpu, grid, effort)?);
    Ok(rows)
}

/// Prints the table.
pub fn print_rows(rows: &[CheckRow]) -> anyhow::Result<()> {
    super::print(&format!(
        "{:<58} {:>6} {:>7} {:>12} {:>8}  verdict",
        "check", "tried", "failed", "worst", "bound"
    ))?;
    for r in rows {
        super::print(&format!(
            "{:<58} {:>6} {:>7} {:>12} {:>8}  {}",
            r.name,
            r.tried,
            r.failed,
            format!("{} {}", r.worst, r.unit),
            r.bound,
            if r.pass { "holds" } else { "FAILS" }
        ))?;
    }
    Ok(())
}
