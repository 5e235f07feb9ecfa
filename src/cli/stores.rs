//! Stores on the command line: opening one, and how it is streamed.

use std::path::Path;

#[cfg(not(feature = "remote"))]
use anyhow::bail;
use tessclip::pyramid::store::Store;
use tessclip::stream::StreamOptions;

/// A store in a folder, or behind an address where the program was built for that.
pub fn open_store(terrain: &str) -> anyhow::Result<Option<Store>> {
    if terrain.contains("://") {
        #[cfg(feature = "remote")]
        return Ok(Some(tessclip::pyramid::store::Remote::open(terrain)?));
        #[cfg(not(feature = "remote"))]
        bail!("{terrain}: this program was built without remote stores: cargo build --features remote");
    }
    let path = Path::new(terrain);
    Ok(if Store::is_store(path) { Some(Store::open(path)?) } else { None })
}

/// How a store is streamed.
#[derive(Clone, Debug, clap::Args)]
pub struct StreamArgs {
    /// Megabytes (10^6) of decoded tiles held of a store, held exactly; by default 256
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    cache_mb: Option<u32>,
    /// Threads that load tiles; by default 4
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    loaders: Option<u16>,
    /// Megabytes (10^6) of samples sent to the GPU in one frame, at most; by default 8, never under two windows
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    upload_mb: Option<u32>,
}

impl StreamArgs {
    /// With the usual values where nothing is said.
    pub fn options(&self) -> StreamOptions {
        let usual = StreamOptions::default();
        let bytes = |mb: u32| u64::from(mb) * 1_000_000;
        StreamOptions {
            cache_bytes: self.cache_mb.map_or(usual.cache_bytes, bytes),
            loaders: self.loaders.map_or(usual.loaders, usize::from),
            upload_bytes_per_frame: self.upload_mb.map_or(usual.upload_bytes_per_frame, bytes),
        }
    }
}
