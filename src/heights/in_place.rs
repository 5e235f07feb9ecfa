//! Rasters whose samples lie in a file as they are: only what is asked for is ever read.

use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::Arc;

use super::HeightError;
use super::blocks::{Blocks, Piece};
use super::geotiff::SPARSE;
use super::positioned::Positioned;
use super::rasters::{RasterHeader, RasterSource};
use super::samples::{Rule, Stored};

/// Bytes read at once where that takes in several rows.
const TOGETHER_BYTES: u64 = 1 << 18;

/// Bare samples in a file, in blocks without gaps between their rows.
pub(crate) struct InPlace {
    pub(crate) header: RasterHeader,
    /// The file that is to blame for errors.
    pub(crate) path: PathBuf,
    pub(crate) file: Arc<Positioned>,
    pub(crate) blocks: Blocks,
    /// Where in the file the blocks begin, or [`SPARSE`].
    pub(crate) places: Vec<u64>,
    pub(crate) stored: Stored,
    pub(crate) big_endian: bool,
    pub(crate) rule: Rule,
}

impl RasterSource for InPlace {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, at: [u64; 2], size: [usize; 2], out: &mut [f32]) -> Result<(), HeightError> {
        self.header.check(at, size, out.len())?;
        let mut bytes = Vec::new();
        for piece in self.blocks.pieces(at, size) {
            // A table without an entry is refused when the file is opened.
            let place = self.places.get(piece.block).copied().unwrap_or(SPARSE);
            if place != SPARSE {
                self.read_piece(&piece, place, &mut bytes, out)?;
                continue;
            }
            for row in 0..piece.size[1] {
                out[piece.target(row)].fill(self.rule.sparse());
            }
        }
        Ok(())
    }
}

impl InPlace {
    /// Reads a piece of the block that begins at `place` into its rectangle's samples.
    fn read_piece(
        &self,
        piece: &Piece,
        place: u64,
        bytes: &mut Vec<u8>,
        out: &mut [f32],
    ) -> Result<(), HeightError> {
        let sample_bytes = self.stored.bytes();
        let row_bytes = self.blocks.block[0] * sample_bytes as u64;
        let part_bytes = piece.size[0] * sample_bytes;
        // Gaps of up to half of what is read cost less than a call for every row.
        let together = if row_bytes <= 2 * part_bytes as u64 { TOGETHER_BYTES / row_bytes } else { 1 };
        let together = together.max(1) as usize;
        let mut row = 0;
        while row < piece.size[1] {
            let rows = together.min(piece.size[1] - row);
            let length = (rows - 1) * row_bytes as usize + part_bytes;
            if bytes.len() < length {
                bytes.resize(length, 0);
            }
            let start = ((piece.first[1] + row) as u64).saturating_mul(row_bytes);
            let start = start.saturating_add(place).saturating_add((piece.first[0] * sample_bytes) as u64);
            let read = self.file.read_exact_at(&mut bytes[..length], start);
            read.map_err(|e| self.failed(piece.block, e))?;
            for i in 0..rows {
                let part = &bytes[i * row_bytes as usize..][..part_bytes];
                let heights = &mut out[piece.target(row + i)];
                self.stored.heights(part, self.big_endian, self.rule, heights);
            }
            row += rows;
        }
        Ok(())
    }

    fn failed(&self, block: usize, e: std::io::Error) -> HeightError {
        if e.kind() != ErrorKind::UnexpectedEof {
            return HeightError::io(&self.path, e);
        }
        let detail = format!("block {block} ends after the {} bytes of the file", self.file.length());
        HeightError::malformed(&self.path, self.header.format, detail)
    }
}
