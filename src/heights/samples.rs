//! Decoded TIFF samples of any type, one block at a time, into a raster.

use tiff::decoder::DecodingResult;

use super::gdal_tags::Nodata;
use super::raster::Raster;

/// A sample type: its value, and comparison with a void value in that very type.
trait Sample: Copy {
    fn value(self) -> f64;
    fn is(self, nodata: Nodata) -> bool;
}

macro_rules! integer_samples {
    ($($t:ty),*) => {$(
        impl Sample for $t {
            fn value(self) -> f64 {
                self as f64
            }
            fn is(self, nodata: Nodata) -> bool {
                nodata.integer == Some(i128::from(self))
            }
        }
    )*};
}
integer_samples!(u8, i8, u16, i16, u32, i32, u64, i64);

impl Sample for f32 {
    fn value(self) -> f64 {
        f64::from(self)
    }
    fn is(self, nodata: Nodata) -> bool {
        self == nodata.float as f32
    }
}

impl Sample for f64 {
    fn value(self) -> f64 {
        self
    }
    fn is(self, nodata: Nodata) -> bool {
        self == nodata.float
    }
}

/// A rectangle of the file: samples of a block, and where they go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    /// First column.
    pub(crate) col: usize,
    /// First row, counted as in the file.
    pub(crate) row: usize,
    /// Columns in the block.
    pub(crate) width: usize,
    /// Samples per pixel in the block; the first is used.
    pub(crate) stride: usize,
    /// Whether row 0 of the file is the northern one.
    pub(crate) north_up: bool,
}

/// Puts a decoded block into the raster; NaN, infinities and `nodata` stay void.
pub(crate) fn place_block(raster: &mut Raster, block: Block, data: &DecodingResult, nodata: Option<Nodata>) {
    match data {
        DecodingResult::U8(v) => place(raster, block, v.iter().copied(), nodata),
        DecodingResult::U16(v) => place(raster, block, v.iter().copied(), nodata),
        DecodingResult::U32(v) => place(raster, block, v.iter().copied(), nodata),
        DecodingResult::U64(v) => place(raster, block, v.iter().copied(), nodata),
        DecodingResult::I8(v) => place(raster, block, v.iter().copied(), nodata),
        DecodingResult::I16(v) => place(raster, block, v.iter().copied(), nodata),
        DecodingResult::I32(v) => place(raster, block, v.iter().copied(), nodata),
        DecodingResult::I64(v) => place(raster, block, v.iter().copied(), nodata),
        DecodingResult::F16(v) => place(raster, block, v.iter().map(|h| h.to_f32()), nodata),
        DecodingResult::F32(v) => place(raster, block, v.iter().copied(), nodata),
        DecodingResult::F64(v) => place(raster, block, v.iter().copied(), nodata),
    }
}

fn place<S: Sample>(
    raster: &mut Raster,
    block: Block,
    samples: impl Iterator<Item = S>,
    nodata: Option<Nodata>,
) {
    let (mut row, mut col) = (block.row, 0);
    for sample in samples.step_by(block.stride.max(1)) {
        if col == block.width {
            col = 0;
            row += 1;
        }
        if row >= raster.height {
            return;
        }
        if !nodata.is_some_and(|n| sample.is(n)) {
            let from_south = if block.north_up { raster.height - 1 - row } else { row };
            raster.put(from_south, block.col + col, sample.value());
        }
        col += 1;
    }
}

/// Fills a block that the file leaves out; such samples are 0 by convention.
pub(crate) fn place_sparse(raster: &mut Raster, block: Block, rows: usize) {
    let count = block.width.saturating_mul(rows);
    let block = Block { stride: 1, ..block };
    place(raster, block, std::iter::repeat_n(0_u8, count), None);
}
