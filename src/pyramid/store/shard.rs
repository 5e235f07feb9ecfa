//! Reading one tile: the shard's index, the tile's bytes, their checksum, and the figures it must have.

use super::level::{Level, TileKey, TileStats};
use super::{SHARD_TILES, Samples, TILE};
use crate::pyramid::VOID;

/// Where the tiles of one shard lie: offset and length, `None` for tiles of voids alone.
pub(crate) type ShardIndex = [Option<(u64, u64)>; SHARD_TILES * SHARD_TILES];

/// Bytes of an encoded index: two u64 a tile and a CRC-32C, as Zarr's sharding_indexed has it at the end.
pub(crate) const INDEX_BYTES: usize = SHARD_TILES * SHARD_TILES * 16 + 4;

/// Decodes the index at the end of a shard of `shard_bytes` bytes.
pub(crate) fn decode_index(encoded: &[u8], shard_bytes: u64) -> Result<ShardIndex, String> {
    let Some((entries, sum)) = encoded.split_at_checked(INDEX_BYTES - 4) else {
        return Err("the shard is shorter than its index".into());
    };
    if sum != crc32c::crc32c(entries).to_le_bytes() {
        return Err("the checksum of the shard's index does not match".into());
    }
    let mut index: ShardIndex = [None; SHARD_TILES * SHARD_TILES];
    for (slot, entry) in index.iter_mut().zip(entries.chunks_exact(16)) {
        let number = |from: usize| {
            let mut bytes = [0; 8];
            bytes.copy_from_slice(&entry[from..from + 8]);
            u64::from_le_bytes(bytes)
        };
        let (offset, length) = (number(0), number(8));
        if (offset, length) == (u64::MAX, u64::MAX) {
            continue;
        }
        let end = offset.checked_add(length).filter(|end| *end <= shard_bytes - INDEX_BYTES as u64);
        if end.is_none() {
            return Err(format!("the shard's index points beyond its {shard_bytes} bytes"));
        }
        *slot = Some((offset, length));
    }
    Ok(index)
}

/// A decoded tile, its samples row-major from the north-west.
#[derive(Clone, Debug)]
pub struct Tile {
    /// Which.
    pub key: TileKey,
    /// All [`TILE`] x [`TILE`] samples; those beyond the data are void.
    pub samples: Samples,
    /// Encoded bytes it was made from.
    pub encoded_bytes: u64,
}

/// What is wrong with a tile, and where its bytes lie.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key} ({file}, {}): {reason}", place(*.offset, *.length))]
pub struct TileFault {
    /// Which tile.
    pub key: TileKey,
    /// Its shard's file.
    pub file: String,
    /// First byte of the tile in that file, where known.
    pub offset: Option<u64>,
    /// Its length, where known.
    pub length: Option<u64>,
    /// What was found.
    pub reason: String,
    /// True when the bytes themselves are wrong; false when they could not be had, which may pass.
    pub damaged: bool,
}

fn place(offset: Option<u64>, length: Option<u64>) -> String {
    match (offset, length) {
        (Some(o), Some(l)) => format!("bytes {o} to {}", o + l),
        _ => "place unknown".into(),
    }
}

/// Figures of a tile's samples inside the data; the error is not theirs to tell.
pub(crate) fn figures(level: Level, column: u32, row: u32, samples: &Samples) -> TileStats {
    let rect = level.rect_of(column, row);
    let width = rect.hi[0].abs_diff(rect.lo[0]) as usize + 1;
    let height = rect.hi[1].abs_diff(rect.lo[1]) as usize + 1;
    let mut out = TileStats { min_m: f32::NAN, max_m: f32::NAN, mean_m: f32::NAN, error_m: 0.0, voids: 0 };
    let (mut low, mut high, mut sum, mut count) = (f32::INFINITY, f32::NEG_INFINITY, 0.0_f64, 0_u32);
    let mut line = Vec::with_capacity(width);
    for y in 0..height {
        line.clear();
        samples.append(y * TILE, width, &mut line);
        for &h in &line {
            if h == VOID {
                out.voids += 1;
                continue;
            }
            low = low.min(h);
            high = high.max(h);
            sum += f64::from(h);
            count += 1;
        }
    }
    if count > 0 {
        #[expect(clippy::cast_possible_truncation, reason = "a mean of f32 values fits f32")]
        let mean = (sum / f64::from(count)) as f32;
        (out.min_m, out.max_m, out.mean_m) = (low, high, mean);
    }
    out
}
