//! `tessclip build`: DEMs into a tiled store, or a store into a format of older tools.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use tessclip::heights::{HeightError, Mosaic, RasterSource, ReadOptions, open_raster};
use tessclip::pyramid::store::{self, BuildOptions, Codec, Progress, StoreRaster};

use super::Outcome;
use super::args::{Filter, ReadArgs};
use super::stores::open_store;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum CodecArg {
    /// Readable by every Zarr reader and by GDAL from 3.13 on
    Blosc,
    /// A fifth to a quarter smaller; not for GDAL
    Pcodec,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum To {
    /// The tiled store
    Zarr,
    /// A Cloud Optimized GeoTIFF, through GDAL's gdal_translate
    Cog,
}

#[derive(clap::Args)]
#[command(after_help = "Examples: tessclip build N46E008.hgt N46E009.hgt -o alps.zarr
          tessclip build procedural:mountains?size=16385 -o big.zarr --codec pcodec
          tessclip build alps.zarr --to cog -o alps.tif")]
pub struct Args {
    /// DEM files of one lattice (tiles of a survey join at their shared rows and columns), or one procedural:NAME
    #[arg(required = true)]
    dems: Vec<String>,
    /// Folder T.zarr (or file, with --to cog) to write
    #[arg(short, long, value_name = "T.zarr")]
    output: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
    /// Compression
    #[arg(long, value_enum, default_value = "blosc")]
    codec: CodecArg,
    /// Most that a height may differ from the source, metres; 0 is lossless
    #[arg(long, value_name = "M", default_value_t = 0.0, allow_negative_numbers = true)]
    max_error: f64,
    /// How coarser levels are made
    #[arg(long, value_enum, default_value = "subsample")]
    prefilter: Filter,
    /// What to write
    #[arg(long, value_enum, default_value = "zarr")]
    to: To,
    /// Replace a store that is already there, at once when the new one is whole
    #[arg(long)]
    overwrite: bool,
    /// Threads; by default one a core, at most 8
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=8))]
    threads: Option<u16>,
    /// Print what was built as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, quiet: bool) -> anyhow::Result<Outcome> {
    if args.to == To::Cog {
        return super::export::to_cog(&args.dems, &args.output, &args.read, args.overwrite);
    }
    let options = args.read.options();
    let inside = args.dems.iter().any(|d| same_place(Path::new(d), &args.output));
    anyhow::ensure!(!inside, "{}: is one of the sources; give another name", args.output.display());
    let source = open_sources(&args.dems, &options)?;
    let header = source.header();
    let samples = header.width * header.height;
    let build = BuildOptions {
        codec: match args.codec {
            CodecArg::Blosc => Codec::Blosc,
            CodecArg::Pcodec => Codec::Pcodec,
        },
        max_error_m: args.max_error,
        prefilter: args.prefilter.into(),
        overwrite: args.overwrite,
        threads: args.threads.map(usize::from),
        sources: args.dems.clone(),
    };
    let begin = Instant::now();
    let progress = Arc::new(Progress::default());
    let stop = progress.clone();
    // Ctrl-C ends the build in order: what was begun is removed.
    if let Err(e) = ctrlc::set_handler(move || stop.stop.store(true, std::sync::atomic::Ordering::Relaxed)) {
        log::warn!("Ctrl-C will leave files of an unfinished build behind: {e}");
    }
    let summary =
        watched(&progress, quiet, || store::build(source.as_ref(), &args.output, &build, &progress))?;
    let seconds = begin.elapsed().as_secs_f64();
    let manifest = &summary.manifest;
    let raw = samples * manifest.dtype.bytes() as u64;
    if args.json {
        super::print(&serde_json::to_string_pretty(&serde_json::json!({
            "store": args.output.display().to_string(), "width": header.width, "height": header.height,
            "dtype": manifest.dtype.name(), "codec": manifest.codec.to_string(), "levels": manifest.levels.len(),
            "bytes": summary.bytes, "shard_bytes": summary.shard_bytes, "raw_bytes": raw, "seconds": seconds,
            "samples_per_s": samples as f64 / seconds, "max_error_m": manifest.max_error_m,
            "voids": manifest.levels.first().map_or(0, |l| l.voids),
        }))?)?;
        return Ok(Outcome::Done);
    }
    if !quiet {
        super::print(&format!(
            "{}: {} x {} {} samples, {} levels, {:.1} MB ({:.2} of the raw samples), {:.1} s, {:.1} million samples/s",
            args.output.display(),
            header.width,
            header.height,
            manifest.dtype.name(),
            manifest.levels.len(),
            summary.bytes as f64 / 1e6,
            summary.bytes as f64 / raw as f64,
            seconds,
            samples as f64 / seconds / 1e6,
        ))?;
        if matches!(manifest.source_dtype.as_str(), "float64" | "int32" | "uint32" | "int64" | "uint64") {
            super::print("note: heights are kept as float32, as everywhere in tessclip")?;
        }
    }
    Ok(Outcome::Done)
}

fn same_place(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}

/// One source, or several as a mosaic; stores are sources, too.
pub fn open_sources(dems: &[String], options: &ReadOptions) -> anyhow::Result<Box<dyn RasterSource>> {
    if let [one] = dems {
        return Ok(open_source(one, options)?);
    }
    let options = ReadOptions { block_cache_bytes: MOSAIC_CACHE_BYTES, ..options.clone() };
    Ok(Box::new(Mosaic::new(dems, Box::new(move |dem| open_source(dem, &options)))?))
}

/// Decoded blocks that each open part of a mosaic keeps.
const MOSAIC_CACHE_BYTES: u64 = 16 << 20;

fn open_source(dem: &str, options: &ReadOptions) -> Result<Box<dyn RasterSource>, HeightError> {
    match open_store(dem) {
        Ok(None) => open_raster(dem, options),
        Ok(Some(store)) => Ok(Box::new(StoreRaster::new(store))),
        Err(e) => Err(HeightError::Malformed {
            path: dem.into(),
            format: "tessclip store",
            detail: format!("{e:#}"),
        }),
    }
}

/// Shows how far a build is while it runs: a bar on a terminal, a line every 5 s elsewhere.
fn watched<T: Send>(progress: &Progress, quiet: bool, work: impl FnOnce() -> T + Send) -> T {
    use std::io::IsTerminal as _;
    use std::sync::atomic::Ordering::Relaxed;
    let terminal = std::io::stderr().is_terminal();
    let bar = if quiet || !terminal { ProgressBar::hidden() } else { ProgressBar::new(1) };
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} %  {rate}, {eta} left") {
        let rate = |state: &indicatif::ProgressState, out: &mut dyn std::fmt::Write| {
            // Each sample counts when it is written and when it is measured.
            let _ = write!(out, "{:.1} million samples/s", state.per_sec() / 2e6);
        };
        bar.set_style(style.with_key("rate", rate));
    }
    std::thread::scope(|scope| {
        let worker = scope.spawn(work);
        let begin = Instant::now();
        let mut told = Instant::now();
        while !worker.is_finished() {
            let (done, all) = (progress.samples.load(Relaxed), progress.total.load(Relaxed).max(1));
            // For what lasts over a second only.
            if begin.elapsed() > Duration::from_secs(1) {
                bar.set_length(all);
                bar.set_position(done);
                if !quiet && !terminal && told.elapsed() > Duration::from_secs(5) {
                    told = Instant::now();
                    eprintln!("{} %, {:.0} s", done * 100 / all, begin.elapsed().as_secs_f64());
                }
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        bar.finish_and_clear();
        worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}
