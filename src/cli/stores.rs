//! Files and stores on the command line: how elevation is read, opening a store, and how it is streamed.

use std::path::Path;

use anyhow::bail;
use tessclip::heights::{HeightGrid, PositionGrid, ReadOptions, is_position_file, open_terrain};
use tessclip::pyramid::store::Store;
use tessclip::stream::StreamOptions;

use super::scene_file::SceneFile;

/// How elevation is read.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct ReadArgs {
    /// Metres between samples, for files without georeference
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub(super) spacing: Option<f64>,
    /// Metres a unit, for raw values
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub(super) z_scale: Option<f64>,
    /// Metres added after scaling
    #[arg(long, value_name = "O", allow_negative_numbers = true)]
    pub(super) z_offset: Option<f64>,
}

impl ReadArgs {
    /// True when --spacing was given.
    pub fn has_spacing(&self) -> bool {
        self.spacing.is_some()
    }

    /// Reads the terrain, or the one a scene file names, as it is, voids and all.
    pub fn read(&self, terrain: &str) -> anyhow::Result<HeightGrid> {
        let file = SceneFile::of(terrain)?;
        let read = self.over(&file);
        let source = file.source.as_deref().unwrap_or(terrain);
        let recipe = source.strip_prefix("procedural:");
        if recipe.is_some_and(PositionGrid::is_named)
            || (recipe.is_none() && is_position_file(Path::new(source)))
        {
            bail!("{source}: holds positions, not heights; render, mesh, fly and plan take them");
        }
        if let Some(store) = open_store(source)? {
            read.refuse_for_store(source)?;
            return Ok(store.to_grid(ReadOptions::default().max_samples)?);
        }
        Ok(open_terrain(source, &read.options())?)
    }

    /// These wishes, for the readers.
    pub fn options(&self) -> ReadOptions {
        ReadOptions {
            spacing_m: self.spacing,
            z_scale: self.z_scale,
            z_offset: self.z_offset,
            ..ReadOptions::default()
        }
    }

    /// What is settled when a store is built.
    pub(super) fn refuse_for_store(&self, store: &str) -> anyhow::Result<()> {
        let given = [
            ("--spacing", self.spacing.is_some()),
            ("--z-scale", self.z_scale.is_some()),
            ("--z-offset", self.z_offset.is_some()),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((option, _)) => {
                bail!("{store}: is a store, for which {option} was settled when it was built")
            }
            None => Ok(()),
        }
    }

    /// These wishes, and where they say nothing those of a scene file.
    pub(super) fn over(&self, file: &SceneFile) -> Self {
        Self {
            spacing: self.spacing.or(file.spacing),
            z_scale: self.z_scale.or(file.z_scale),
            z_offset: self.z_offset.or(file.z_offset),
        }
    }

    /// What was given, as options.
    #[cfg(feature = "viewer")]
    pub(super) fn said(&self) -> Vec<String> {
        let all = [("spacing", self.spacing), ("z-scale", self.z_scale), ("z-offset", self.z_offset)];
        all.into_iter().filter_map(|(name, value)| value.map(|value| format!("--{name}={value}"))).collect()
    }
}

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

    /// What was given, as options.
    #[cfg(feature = "viewer")]
    pub(super) fn said(&self) -> Vec<String> {
        let loaders = self.loaders.map(u32::from);
        let all = [("cache-mb", self.cache_mb), ("loaders", loaders), ("upload-mb", self.upload_mb)];
        all.into_iter().filter_map(|(name, value)| value.map(|value| format!("--{name}={value}"))).collect()
    }
}
