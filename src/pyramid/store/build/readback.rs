//! What was just written, decoded once more.

use super::Build;
use crate::clipmap::Rect;
use crate::pyramid::VOID;
use crate::pyramid::store::SHARD_TILES;
use crate::pyramid::store::bytes::{Folder, ReadAt as _};
use crate::pyramid::store::codec::Coder;
use crate::pyramid::store::error::StoreError;
use crate::pyramid::store::level::Level;
use crate::pyramid::store::open::copy_tile;
use crate::pyramid::store::shard::{INDEX_BYTES, decode_index};

/// Reads levels of a store under construction.
pub(super) struct ReadBack<'a> {
    folder: Folder,
    coder: Coder,
    build: &'a Build<'a>,
}

impl<'a> ReadBack<'a> {
    pub fn new(build: &'a Build<'a>) -> Result<Self, StoreError> {
        let coder = Coder::new(build.options.codec, build.dtype).map_err(|e| build.encode_error(e))?;
        Ok(Self { folder: Folder { root: build.draft.folder().into() }, coder, build })
    }

    /// The samples of a rectangle of nodes, row by row from the south-west: tile by tile, straight from the files.
    pub fn read(&self, level: Level, rect: Rect) -> Result<Vec<f32>, StoreError> {
        let width = rect.hi[0].abs_diff(rect.lo[0]) as usize + 1;
        let height = rect.hi[1].abs_diff(rect.lo[1]) as usize + 1;
        let mut samples = vec![VOID; width * height];
        let (columns, rows) = level.tiles_of(rect);
        let across = SHARD_TILES as u32;
        let io = |e| StoreError::io(self.build.at, "reading back", e);
        for sy in rows[0] / across..=rows[1] / across {
            for sx in columns[0] / across..=columns[1] / across {
                let file = level.shard_file(sx * across, sy * across);
                let Some(bytes) = self.folder.size(&file).map_err(io)? else { continue };
                let at = bytes.saturating_sub(INDEX_BYTES as u64);
                let end = self.folder.read(&file, at, INDEX_BYTES).map_err(io)?;
                let index = decode_index(&end, bytes).map_err(|e| self.build.encode_error(e))?;
                for (k, place) in (0_u32..).zip(index) {
                    let (column, row) = (sx * across + k % across, sy * across + k / across);
                    let wanted =
                        (columns[0]..=columns[1]).contains(&column) && (rows[0]..=rows[1]).contains(&row);
                    let Some((offset, length)) = place.filter(|_| wanted) else { continue };
                    let length = usize::try_from(length).unwrap_or(usize::MAX);
                    let encoded = self.folder.read(&file, offset, length).map_err(io)?;
                    let tile = self.coder.decode(&encoded).map_err(|e| self.build.encode_error(e))?;
                    copy_tile(level, &tile, [column, row], rect, &mut samples);
                }
            }
        }
        Ok(samples)
    }
}
