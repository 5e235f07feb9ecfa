//! Rectangles of a raster as parts of the blocks that its file stores.

use std::ops::Range;

/// How a file cuts its raster into blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blocks {
    /// Columns and rows of the raster.
    pub(crate) size: [u64; 2],
    /// Columns and rows of a block, at least 1; blocks may reach over the raster.
    pub(crate) block: [u64; 2],
    /// Whether row 0 of the file is the northern one.
    pub(crate) north_up: bool,
}

/// What a rectangle and a block have in common.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Piece {
    /// The block, counted in rows as in the file.
    pub(crate) block: usize,
    /// First column and row in the block.
    pub(crate) first: [usize; 2],
    /// Columns and rows, at least 1.
    pub(crate) size: [usize; 2],
    /// First column in the rectangle, and the row in it of the piece's first row.
    to: [usize; 2],
    /// Columns of the rectangle.
    stride: usize,
    /// Whether the piece's rows run against those of the rectangle.
    turned: bool,
}

impl Piece {
    /// Where a row of the piece goes among the samples of the rectangle.
    pub(crate) fn target(&self, row: usize) -> Range<usize> {
        let row = if self.turned { self.to[1] - row } else { self.to[1] + row };
        let start = row * self.stride + self.to[0];
        start..start + self.size[0]
    }
}

impl Blocks {
    /// One block that holds all rows.
    pub(crate) fn whole(size: [u64; 2]) -> Self {
        Self { size, block: size, north_up: true }
    }

    /// Blocks in a row of blocks.
    pub(crate) fn across(self) -> u64 {
        self.size[0].div_ceil(self.block[0])
    }

    /// All blocks.
    pub(crate) fn count(self) -> u64 {
        self.across().saturating_mul(self.size[1].div_ceil(self.block[1]))
    }

    /// First column and row of a block in the file.
    pub(crate) fn first(self, block: usize) -> [usize; 2] {
        let (block, across) = (block as u64, self.across());
        [(block % across * self.block[0]) as usize, (block / across * self.block[1]) as usize]
    }

    /// The row counted from the south of a row of the file; `None` below the last.
    pub(crate) fn row_from_south(self, row: usize) -> Option<usize> {
        let last = (self.size[1] as usize).checked_sub(1)?.checked_sub(row)?;
        Some(if self.north_up { last } else { row })
    }

    /// The pieces of a rectangle inside the raster (first column and row, row 0 in the south),
    /// rows of blocks by rows of blocks.
    pub(crate) fn pieces(self, at: [u64; 2], size: [usize; 2]) -> impl Iterator<Item = Piece> {
        let [width, height] = size.map(|n| n as u64);
        let first_row = if self.north_up { self.size[1] - at[1] - height } else { at[1] };
        overlaps(first_row, height, self.block[1]).flat_map(move |down| {
            let to = if self.north_up { size[1] - 1 - down.from } else { down.from };
            overlaps(at[0], width, self.block[0]).map(move |along| Piece {
                block: (down.block * self.across() + along.block) as usize,
                first: [along.first, down.first],
                size: [along.count, down.count],
                to: [along.from, to],
                stride: size[0],
                turned: self.north_up,
            })
        })
    }
}

/// What a span of samples and a block have in common, along one axis.
#[derive(Clone, Copy)]
struct Overlap {
    block: u64,
    /// First sample, counted from the start of the block.
    first: usize,
    /// The same sample, counted from the start of the span.
    from: usize,
    count: usize,
}

fn overlaps(start: u64, count: u64, block: u64) -> impl Iterator<Item = Overlap> {
    let end = start + count;
    let touched = if count == 0 { 0..0 } else { start / block..end.div_ceil(block) };
    touched.map(move |number| {
        let (low, high) = (number * block, (number + 1) * block);
        let (from, to) = (start.max(low), end.min(high));
        Overlap {
            block: number,
            first: (from - low) as usize,
            from: (from - start) as usize,
            count: (to - from) as usize,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::Blocks;

    /// Every sample of a rectangle is in exactly one piece, and at its own place.
    #[test]
    fn pieces_cover_a_rectangle_once() {
        for north_up in [true, false] {
            for block in [[1, 1], [4, 3], [16, 2], [11, 9], [64, 64]] {
                let blocks = Blocks { size: [11, 9], block, north_up };
                for (at, size) in [([0, 0], [11, 9]), ([3, 2], [5, 4]), ([10, 8], [1, 1]), ([2, 2], [0, 3])] {
                    let mut found = vec![None; size[0] * size[1]];
                    for piece in blocks.pieces(at, size) {
                        let corner = blocks.first(piece.block);
                        for row in 0..piece.size[1] {
                            for (i, to) in piece.target(row).enumerate() {
                                let col = corner[0] + piece.first[0] + i;
                                let row = blocks.row_from_south(corner[1] + piece.first[1] + row).unwrap();
                                assert_eq!(found[to].replace((col, row)), None);
                            }
                        }
                    }
                    for (i, found) in found.into_iter().enumerate() {
                        let wanted = (at[0] as usize + i % size[0], at[1] as usize + i / size[0]);
                        assert_eq!(found, Some(wanted), "{blocks:?} {at:?} {size:?}");
                    }
                }
            }
        }
        let blocks = Blocks { size: [11, 9], block: [4, 3], north_up: true };
        assert_eq!((blocks.across(), blocks.count(), blocks.row_from_south(9)), (3, 9, None));
    }
}
