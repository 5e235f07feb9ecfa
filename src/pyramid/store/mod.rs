//! The tiled store on disk: one Zarr v3 group a level, sharded, and a manifest that binds them together.
//!
//! ```text
//! T.zarr/zarr.json               group: the list of levels (multiscales)
//! T.zarr/manifest.json           what belongs to the store: sizes and hashes of all other files
//! T.zarr/manifest.json.xxh3      hash of the manifest
//! T.zarr/L/elevation/c/Y/X       shards of 4 x 4 tiles of 256 x 256 samples, rows from the north
//! T.zarr/L/tiles/c/0/0/0         five figures a tile: min, max, mean, worst error of the finer level, voids
//! T.zarr/L/deviations/c/Y/X/0    nine figures a block of 16 x 16 cells, rows from the south: see `deviations.rs`
//! ```
//!
//! Any Zarr reader can open it; the manifest is what makes damage visible: Zarr itself takes a missing shard
//! for one that holds nothing. Level `l` has the nodes of [`Lattice`](crate::clipmap::Lattice) level `l`, up to
//! the first level that fits one tile; coarser ones are made from that when the store is opened.
//!
//! Voids are the fill value of the array (-32768, 65535 or NaN), which other readers mask by themselves; a
//! separate mask would cost bytes where there are none.

mod build;
mod bytes;
mod codec;
mod deviations;
mod error;
mod level;
mod manifest;
mod open;
mod raster;
#[cfg(feature = "remote")]
mod remote;
mod replace;
mod shard;
mod sink;
mod verify;

pub use build::{BuildOptions, BuildSummary, Progress, build};
pub use bytes::{Folder, InMemory, ReadAt};
pub use codec::{Codec, Dtype, Samples};
pub use error::StoreError;
pub use level::{TileKey, TileStats};
pub use manifest::{Manifest, Place};
pub use open::Store;
pub(crate) use open::copy_tile;
pub use raster::StoreRaster;
#[cfg(feature = "remote")]
pub use remote::Remote;
pub use shard::{Tile, TileFault};
pub use verify::{Damage, VerifyReport};

/// Samples along a side of a tile.
pub const TILE: usize = 256;
/// Tiles along a side of a shard.
pub const SHARD_TILES: usize = 4;
/// Most tiles of a level: 2^38 samples. Their figures are held in memory, 20 bytes each.
pub const MOST_TILES: u64 = 1 << 22;
/// Samples along a side of a shard.
pub const SHARD: usize = TILE * SHARD_TILES;
