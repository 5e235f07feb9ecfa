//! `tessclip verify`: is every byte of a store as it was written?

use anyhow::bail;

use super::Outcome;
use super::fly::progress;
use super::stores::open_store;

#[derive(clap::Args)]
#[command(after_help = "Example: tessclip verify T.zarr")]
pub struct Args {
    /// The store
    store: String,
    /// Machine-readable
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, quiet: bool) -> anyhow::Result<Outcome> {
    let Some(store) = open_store(&args.store)? else {
        bail!("{}: not a tessclip store; make one with tessclip build", args.store);
    };
    let bar = progress(1, quiet);
    let cores = std::thread::available_parallelism().map_or(1, Into::into);
    let report = store.verify(cores, &|done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    if args.json {
        super::print(&serde_json::to_string_pretty(&report)?)?;
    } else {
        for damage in &report.damage {
            let tile = damage.tile.as_ref().map_or(String::new(), |t| format!(", {t}"));
            let offset = damage.offset.map_or(String::new(), |o| format!(", byte {o}"));
            super::print(&format!("damaged: {}{tile}{offset}: {}", damage.file, damage.reason))?;
        }
        for file in &report.strangers {
            super::print(&format!("not of this store: {file}"))?;
        }
        super::print(&format!(
            "{}: {} tiles in {} shards, {:.1} MB read, {} damaged",
            args.store,
            report.tiles,
            report.shards,
            report.bytes as f64 / 1e6,
            report.damage.len()
        ))?;
    }
    Ok(if report.whole() { Outcome::Done } else { Outcome::FellShort })
}
