//! Outer factors: how often each cell of a patch's side is divided, decided from the edge alone.
//!
//! The rule reads only what both neighbours know (the levels that meet and where), so both sides of
//! an edge decide alike. Doubling beside the finer window (Song et al. 2016, section 3.3, types I
//! and II) is its first use; a span may hold any power of two.

use crate::clipmap::{Rect, Windows};

/// Cells of one side of a patch whose edge is divided further than the patch's own cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OuterSpan {
    /// First divided cell along the side, from its west or south end.
    pub from: u32,
    /// One past the last divided cell; equal to `from` when none is.
    pub to: u32,
    /// log2 of the number of segments each of these cells has.
    pub log2: u32,
}

impl OuterSpan {
    /// Segments of cell `cell` along this side.
    #[must_use]
    pub fn segments(self, cell: u32) -> u32 {
        if (self.from..self.to).contains(&cell) { 1 << self.log2 } else { 1 }
    }

    /// Vertices the span adds to the whole side.
    #[must_use]
    pub fn extra(self) -> u32 {
        (self.to - self.from) * ((1 << self.log2) - 1)
    }

    /// Vertices the span adds before cell `cell`.
    #[must_use]
    pub fn extra_before(self, cell: u32) -> u32 {
        (cell.clamp(self.from, self.to) - self.from) * ((1 << self.log2) - 1)
    }
}

/// Spans of the four sides (south, north, west, east) of the cells `rect` of `level`.
#[must_use]
pub fn outer_spans(windows: &Windows, level: u32, rect: Rect) -> [OuterSpan; 4] {
    if level <= windows.finest {
        return [OuterSpan::default(); 4];
    }
    let fine = windows.loaded(level - 1);
    // The finer window's border in our lattice; its far border may be the data's clamped one.
    let lattice = windows.lattice;
    let node = |p: [i32; 2]| lattice.node(level, lattice.base(level - 1, p));
    let ring = Rect { lo: node(fine.lo), hi: node(fine.hi) };
    let side = |along: usize, line: i32| {
        let across = 1 - along;
        let from = rect.lo[along].max(ring.lo[along]);
        let mut to = rect.hi[along].min(ring.hi[along]);
        if (line != ring.lo[across] && line != ring.hi[across]) || to <= from {
            return OuterSpan::default();
        }
        // The narrow last cell of the data has no node of the finer lattice inside it: not doubled.
        if ((2 * to - 1) << (level - 1)) >= lattice.last[along] {
            to -= 1;
        }
        let local = |v: i32| u32::try_from(v - rect.lo[along]).unwrap_or_default();
        if to <= from {
            return OuterSpan::default();
        }
        OuterSpan { from: local(from), to: local(to), log2: 1 }
    };
    [side(0, rect.lo[1]), side(0, rect.hi[1]), side(1, rect.lo[0]), side(1, rect.hi[0])]
}
