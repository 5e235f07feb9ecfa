//! `tessclip info`: what a DEM holds.

use serde::Serialize;
use tessclip::clipmap::{ClipmapShape, Lattice};
use tessclip::pyramid::store::Store;

use super::Outcome;
use super::args::ReadArgs;
use super::stores::open_store;

#[derive(clap::Args)]
#[command(after_help = "Example: tessclip info dem.tif --json")]
pub struct Args {
    /// A DEM file, a store T.zarr, a scene file NAME.toml or procedural:NAME
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
    if let Some(store) = open_store(&args.terrain)? {
        return of_store(&store, args.json);
    }
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
    print_info(&info, args.json, grid.georeference.pixel_is_point)
}

fn print_info(info: &Info, json: bool, pixel_is_point: bool) -> anyhow::Result<Outcome> {
    if json {
        super::print(&serde_json::to_string_pretty(info)?)?;
        return Ok(Outcome::Done);
    }
    let registration = if pixel_is_point { "pixel is point" } else { "pixel is area" };
    super::print(&format!("format     {} {}", info.format, info.dtype))?;
    super::print(&format!("size       {} x {} samples", info.width, info.height))?;
    match info.min.zip(info.max).zip(info.mean) {
        Some(((min, max), mean)) => super::print(&format!("heights    {min} .. {max} m, mean {mean:.3}"))?,
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

/// A store says all of it in its manifest: nothing else is read.
fn of_store(store: &Store, json: bool) -> anyhow::Result<Outcome> {
    let manifest = store.manifest();
    let last = store.lattice().last;
    let [width, height] = last.map(|v| v.unsigned_abs() as usize + 1);
    let place = &manifest.place;
    let (origin, step) = match place.degrees {
        Some([west, south, sx, sy, ..]) => ([west, south], [sx, sy]),
        None => (place.origin_m, place.spacing_m),
    };
    let end = [0, 1].map(|a| origin[a] + f64::from(last[a]) * step[a]);
    let bytes: u64 = manifest.files.values().map(|f| f.bytes).sum();
    let mut notes = vec![format!(
        "{} levels of {} x {} tiles, {} codec, {}, {:.1} MB in {} files",
        manifest.levels.len(),
        manifest.tile,
        manifest.tile,
        manifest.codec,
        if manifest.max_error_m > 0.0 {
            format!("heights within {} m of the source", manifest.max_error_m)
        } else {
            "lossless".into()
        },
        bytes as f64 / 1e6,
        manifest.files.len()
    )];
    if !store.has_deviations() {
        notes.push(
            "made before deviations of these meshes were stored: build it again for factors by error".into(),
        );
    }
    if !manifest.sources.is_empty() {
        notes.push(format!("made from {} by {}", manifest.sources.join(", "), manifest.made_by));
    }
    if !store.missing().is_empty() {
        notes.push(format!("{} shards are missing or cut short: run tessclip verify", store.missing().len()));
    }
    let info = Info {
        format: "tessclip store",
        width,
        height,
        dtype: manifest.dtype.name(),
        min: manifest.range_m.map(|r| r[0]),
        max: manifest.range_m.map(|r| r[1]),
        mean: manifest.mean_m,
        void_count: store.void_count(),
        spacing_m: place.spacing_m,
        crs: place.crs.clone(),
        unit: if place.degrees.is_some() { "degree" } else { "metre" },
        bounds: [origin[0], origin[1], end[0], end[1]],
        levels: ClipmapShape::covering(255, store.lattice())?.levels(),
        notes,
    };
    print_info(&info, json, place.pixel_is_point)
}
