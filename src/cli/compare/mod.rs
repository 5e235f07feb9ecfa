//! `tessclip compare`: rivals on the same data, path and device; upload, frame times, and error against run
//! time.

mod errors;
mod flights;
mod settings;
mod study;
mod uploads;

use std::path::PathBuf;

use anyhow::bail;
use tessclip::ColorMode;
use tessclip::gpu::Gpu;
use tessclip::report::MethodRow;
use tessclip::rivals::Method;

use super::Outcome;
use super::args::{LookArgs, TerrainArgs};
use super::scene_file::SceneFile;

pub use self::settings::DetailArgs;
pub use self::study::{Extent, Study};

/// How much is measured.
#[derive(Clone, Debug, clap::Args)]
pub struct ExtentArgs {
    /// Frames of a flight
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(10..=100_000))]
    frames: Option<u32>,
    /// Flights of each method, in turn A B C, C B A, ...; fewer than 5 judge nothing
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u32).range(1..=100))]
    rounds: Option<u32>,
    /// Views along the path whose error is measured; 0 for none
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(0..=100))]
    views: Option<u32>,
    /// Fly several details of each method: its front of error against run time
    #[arg(long)]
    sweep: bool,
    /// A small picture, short flights, few views and a short sweep: minutes, not an hour
    #[arg(long)]
    quick: bool,
}

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    tessclip compare procedural:mountains --quick --report out\n  \
    tessclip compare dem.tif --methods tessellated,footprint,geomipmap --path double-turn,straight --sweep --report out")]
pub struct Args {
    #[command(flatten)]
    terrain: TerrainArgs,
    #[command(flatten)]
    look: LookArgs,
    #[command(flatten)]
    detail: DetailArgs,
    #[command(flatten)]
    extent: ExtentArgs,
    /// all, or a list of: brute-force, classic, footprint, geomipmap, chunked, roam, tessellated, tessellated-by-error,
    /// tessellated-vertex-stage, tessellated-all-patches; ours (tessellated) always flies along
    #[arg(long, value_delimiter = ',', default_value = "all", value_name = "LIST")]
    methods: Vec<String>,
    /// Paths as for fly, several with commas between
    #[arg(long, value_delimiter = ',', default_value = "double-turn", value_name = "LIST")]
    path: Vec<String>,
    /// Directory for report.html, report.json, the CSV files and pictures
    #[arg(long, value_name = "DIR")]
    report: PathBuf,
    /// Print the comparison of report.json
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, quiet: bool) -> anyhow::Result<Outcome> {
    let methods = methods(&args.methods)?;
    let file = SceneFile::of(&args.terrain.terrain)?;
    let scene = args.look.apply(args.detail.apply(tessclip::Scene::default(), &file), &file);
    if scene.wireframe {
        bail!("compare cannot draw wireframes: only ours has a pipeline for them; leave --wireframe out");
    }
    if scene.bounds || matches!(scene.color, ColorMode::Error | ColorMode::Refill) {
        bail!(
            "compare draws no bounds, errors or refills, which only ours knows of: leave --bounds out, take another --color"
        );
    }
    let mut paths: Vec<String> = Vec::new();
    for path in args.path.iter().map(|p| p.trim()) {
        if path.is_empty() {
            bail!("--path: an empty name; give paths with commas between");
        }
        if !paths.iter().any(|p| p == path) {
            paths.push(path.into());
        }
    }
    let (terrain, note) = args.terrain.over(&file).open_whole()?;
    let gpu = Gpu::new()?;
    let extent = Extent::of(&args.extent);
    let study = Study {
        name: &args.terrain.terrain,
        terrain: &terrain,
        scene,
        size: args.look.size_given(&file).unwrap_or(extent.size),
        fov_deg: args.look.fov(&file),
        paths: &paths,
        methods: &methods,
        detail: args.detail.detail(&file),
        extent,
        note,
    };
    let report = study.run(&gpu, &args.report, quiet)?;
    if args.json {
        super::print(&serde_json::to_string_pretty(&report.comparison)?)?;
    } else {
        for words in &report.comparison.words {
            super::print(words)?;
        }
        super::print(&format!(
            "wrote report.html, report.json, samples.csv, fronts.csv and uploads.csv to {}",
            args.report.display()
        ))?;
    }
    // A method whose figures may not be used, or that shows cracks.
    let mut rows = report.comparison.paths.iter().flat_map(|p| &p.methods);
    let whole = |row: &MethodRow| {
        row.invalid_because().is_empty() && row.error.as_ref().is_none_or(|e| e.crack_pixels == 0)
    };
    Ok(if rows.all(whole) { Outcome::Done } else { Outcome::FellShort })
}

/// The methods asked for, ours among them, in the order of reports.
fn methods(names: &[String]) -> anyhow::Result<Vec<Method>> {
    let mut chosen = vec![Method::Tessellated];
    for name in names.iter().map(|n| n.trim()) {
        if name == "all" {
            chosen.extend(Method::ALL);
            continue;
        }
        let Some(method) = Method::ALL.into_iter().find(|m| m.name() == name) else {
            let known = Method::ALL.map(Method::name).join(", ");
            bail!("--methods {name}: no such method; take all or some of: {known}");
        };
        chosen.push(method);
    }
    chosen.sort_unstable();
    chosen.dedup();
    Ok(chosen)
}

#[cfg(test)]
mod tests {
    use super::methods;

    #[test]
    fn ours_always_flies_along_and_unknown_methods_are_refused() {
        let of = |names: &[&str]| methods(&names.iter().map(ToString::to_string).collect::<Vec<_>>());
        let names = |chosen: Vec<tessclip::rivals::Method>| {
            chosen.into_iter().map(tessclip::rivals::Method::name).collect::<Vec<_>>()
        };
        assert_eq!(names(of(&["roam", "roam"]).unwrap()), ["roam", "tessellated"]);
        assert_eq!(of(&["all", "classic"]).unwrap().len(), tessclip::rivals::Method::ALL.len());
        assert!(of(&["raom"]).unwrap_err().to_string().contains("no such method"));
    }
}
