//! `tessclip info`: what a DEM holds.

use serde::Serialize;
use tessclip::clipmap::{ClipmapShape, Lattice};

use super::Outcome;
use super::args::ReadArgs;

#[derive(clap::Args)]
#[command(after_help = "Example: tessclip info dem.tif --json")]
pub struct Args {
    /// A DEM file, a scene file NAME.toml or procedural:NAME
    terrain: String,
    #[command(flatten)]
    read: ReadArgs,
    /// Machine-readable
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Info {
    format: &'static str,
    width: usize,
    height: usize,
    dtype: &'static str,
    min: Option<f32>,
    max: Option<f32>,
    mean: Option<f64>,
    void_count: u64,
    spacing_m: [f64; 2],
    crs: Option<String>,
    unit: &'static str,
    bounds: [f64; 4],
    levels: u32,
    notes: Vec<String>,
}

pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    let grid = args.read.read(&args.terrain)?;
    let stats = grid.min_max_mean();
    let lattice =
        Lattice { last: [grid.width, grid.height].map(|s| i32::try_from(s - 1).unwrap_or(i32::MAX)) };
    let levels = ClipmapShape::covering(255, lattice)?.levels();
    let mut notes = Vec::new();
    if let Some(d) = grid.georeference.degrees {
        notes.push(format!(
            "in degrees: drawn on WGS84; with --base plane, {:.3} metres a degree east and {:.3} north, constant",
            d.metres_per_degree[0], d.metres_per_degree[1]
        ));
    }
    if !grid.georeference.georeferenced && grid.format != "procedural" && !args.read.has_spacing() {
        notes.push(
            "no georeference: the south-west sample is the origin; --spacing gives metres between samples"
                .into(),
        );
    }
    let info = Info {
        format: grid.format,
        width: grid.width,
        height: grid.height,
        dtype: grid.dtype,
        min: stats.map(|s| s.0),
        max: stats.map(|s| s.1),
        mean: stats.map(|s| s.2),
        void_count: grid.void_count(),
        spacing_m: grid.spacing_m,
        crs: grid.georeference.crs.clone(),
        unit: grid.georeference.unit,
        bounds: grid.bounds(),
        levels,
        notes,
    };
    if args.json {
        super::print(&serde_json::to_string_pretty(&info)?)?;
        return Ok(Outcome::Done);
    }
    let registration = if grid.georeference.pixel_is_point { "pixel is point" } else { "pixel is area" };
    super::print(&format!("format     {} {}", info.format, info.dtype))?;
    super::print(&format!("size       {} x {} samples", info.width, info.height))?;
    match stats {
        Some((min, max, mean)) => super::print(&format!("heights    {min} .. {max} m, mean {mean:.3}"))?,
        None => super::print("heights    none: every sample is void")?,
    }
    super::print(&format!("voids      {}", info.void_count))?;
    super::print(&format!("spacing    {} x {} m", info.spacing_m[0], info.spacing_m[1]))?;
    super::print(&format!("crs        {} ({registration})", info.crs.as_deref().unwrap_or("none")))?;
    let b = info.bounds;
    super::print(&format!("bounds     {} {} .. {} {} {}", b[0], b[1], b[2], b[3], info.unit))?;
    super::print(&format!("levels     {} with n = 255", info.levels))?;
    for note in &info.notes {
        super::print(&format!("note       {note}"))?;
    }
    Ok(Outcome::Done)
}
