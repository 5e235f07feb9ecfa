//! Outer factors: how often each cell of a patch's side is divided, decided from the edge alone.
//!
//! The rule reads only what both neighbours know (the levels that meet and where), so both sides of
//! an edge decide alike. Doubling beside the finer window (Song et al. 2016, section 3.3, types I
//! and II) is its first use; a span may hold any power of two.

use crate::clipmap::{ChartWindows, Lattice, Rect, Side, Windows};

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

/// Spans of the four sides (south, north, west, east) of the cells `rect` of `level`, of one chart alone.
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
    Side::ALL.map(|side| {
        let (along, across) = (side.along(), 1 - side.along());
        let line = if side.is_high() { rect.hi[across] } else { rect.lo[across] };
        if line != ring.lo[across] && line != ring.hi[across] {
            return OuterSpan::default();
        }
        doubled(lattice, level, along, [rect.lo[along], rect.hi[along]], [ring.lo[along], ring.hi[along]])
    })
}

/// As [`outer_spans`], and doubled also where the chart beyond a border draws finer cells. That chart is
/// never finer by more than one level ([`ChartWindows::place`]), so doubling is enough there, too.
#[must_use]
pub fn chart_spans(windows: &ChartWindows, chart: usize, level: u32, rect: Rect) -> [OuterSpan; 4] {
    let own = &windows.charts[chart];
    let mut spans = outer_spans(own, level, rect);
    if level == 0 {
        return spans;
    }
    let last = own.lattice.last_at(level);
    for side in Side::ALL {
        let (along, across) = (side.along(), 1 - side.along());
        let on_border = if side.is_high() { rect.hi[across] == last[across] } else { rect.lo[across] == 0 };
        if !on_border {
            continue;
        }
        if let Some(interval) = windows.beyond(chart, side, level - 1) {
            let node = |base: i32| {
                let mut p = [0, 0];
                p[along] = base;
                own.lattice.node(level, p)[along]
            };
            spans[side as usize] =
                doubled(own.lattice, level, along, [rect.lo[along], rect.hi[along]], interval.map(node));
        }
    }
    spans
}

/// The span of the cells `cells` (first and last node) that lie on the finer interval `ring`.
fn doubled(lattice: Lattice, level: u32, along: usize, cells: [i32; 2], ring: [i32; 2]) -> OuterSpan {
    let from = cells[0].max(ring[0]);
    let mut to = cells[1].min(ring[1]);
    // The narrow last cell of the data has no node of the finer lattice inside it: not doubled.
    if to > from && ((2 * to - 1) << (level - 1)) >= lattice.last[along] {
        to -= 1;
    }
    if to <= from {
        return OuterSpan::default();
    }
    let local = |v: i32| u32::try_from(v - cells[0]).unwrap_or_default();
    OuterSpan { from: local(from), to: local(to), log2: 1 }
}
