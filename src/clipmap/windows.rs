//! Windows of all levels as a pure function of the camera's ground point.

use super::{Lattice, Rect};

/// Most levels a clipmap may have: the length of the array in the frame uniform.
pub const MAX_LEVELS: u32 = 16;

/// Why a clipmap shape cannot be used.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum ClipmapError {
    /// `n` is not of the form 2^k - 1 in range.
    #[error(
        "window size n = {n} cannot be used: take 2^k - 1 from 15 to 1023 (15, 31, 63, 127, 255, 511, 1023)"
    )]
    WindowSize {
        /// What was asked for.
        n: u32,
    },
    /// `n` is too small for a layout of whole blocks.
    #[error("factors by error need windows of at least 127 samples: take n = 127, 255, 511 or 1023, not {n}")]
    BlockWindowSize {
        /// What was asked for.
        n: u32,
    },
    /// No deviations are known.
    #[error("factors by error are not to be had here: {why}; or take --factors uniform")]
    NoDeviations {
        /// What is in the way.
        why: &'static str,
    },
    /// Level count out of range for this data.
    #[error(
        "{levels} levels cannot be used: this data supports 1 to {most}; lower --levels or give a larger terrain"
    )]
    LevelCount {
        /// What was asked for.
        levels: u32,
        /// The most that the data supports.
        most: u32,
    },
    /// `n` is too small for a curved base surface.
    #[error(
        "window size n = {n} is too small for this base surface and the detail of its data: take a larger one, {least} to 1023"
    )]
    GluedWindowSize {
        /// What was asked for.
        n: u32,
        /// The least that may do.
        least: u32,
    },
    /// Too few levels to close the surface.
    #[error("{levels} levels do not cover this base surface: take {least} or more, or leave --levels out")]
    GluedLevelCount {
        /// What was asked for.
        levels: u32,
        /// The fewest that do.
        least: u32,
    },
}

/// Window size and level count (Song et al. 2016, section 3.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClipmapShape {
    n: u32,
    levels: u32,
    unit: u32,
}

impl ClipmapShape {
    /// A shape of `levels` windows with `n` x `n` samples each.
    ///
    /// # Errors
    /// `n` must be 2^k - 1 from 15 to 1023; `levels` must be 1 to what the lattice supports.
    pub fn new(n: u32, levels: u32, lattice: Lattice) -> Result<Self, ClipmapError> {
        if !(15..=1023).contains(&n) || !(n + 1).is_power_of_two() {
            return Err(ClipmapError::WindowSize { n });
        }
        let most = lattice.coarsest_level() + 1;
        if !(1..=most).contains(&levels) {
            return Err(ClipmapError::LevelCount { levels, most });
        }
        Ok(Self { n, levels, unit: 1 })
    }

    /// The fewest levels whose coarsest window covers the whole grid from any ground point on it.
    ///
    /// Windows hang over the border rather than stop at it (Brettell 2005, section 3.4 stops them),
    /// so the detail around the camera is the same at the border as in the middle.
    ///
    /// # Errors
    /// As [`ClipmapShape::new`], for `n` only.
    pub fn covering(n: u32, lattice: Lattice) -> Result<Self, ClipmapError> {
        Self::new(n, 1, lattice)?.cover(lattice)
    }

    /// As [`ClipmapShape::covering`], laid out in whole blocks of the pyramid (16 x 16 cells): every line of the
    /// layout, scaled by 16, lies on a block's border, so a patch is a block and its measured deviations hold.
    /// The layout is that of (n + 1) / 16 - 1 samples; what it leaves over of the window is not held.
    ///
    /// # Errors
    /// As [`ClipmapShape::new`]; `n` must be 127 or more.
    pub fn covering_by_blocks(n: u32, lattice: Lattice) -> Result<Self, ClipmapError> {
        Self::new(n, 1, lattice)?.by_blocks()?.cover(lattice)
    }

    /// The same shape in whole blocks.
    ///
    /// # Errors
    /// `n` must be 127 or more.
    pub fn by_blocks(self) -> Result<Self, ClipmapError> {
        if self.n < 127 {
            return Err(ClipmapError::BlockWindowSize { n: self.n });
        }
        Ok(Self { unit: 16, ..self })
    }

    fn cover(self, lattice: Lattice) -> Result<Self, ClipmapError> {
        let one = self;
        let longest = i64::from(lattice.last[0].max(lattice.last[1]));
        // A window's centre may lie two of its own units from the camera, hence 2m - 2 and not 2m + 1.
        let reach = one.reach();
        let mut levels = 1;
        while levels <= lattice.coarsest_level() && reach << (levels - 1) < longest {
            levels += 1;
        }
        Ok(Self { unit: self.unit, ..Self::new(self.n, levels, lattice)? })
    }

    /// Samples per side of a window.
    #[must_use]
    pub fn n(self) -> u32 {
        self.n
    }

    /// Number of levels.
    #[must_use]
    pub fn levels(self) -> u32 {
        self.levels
    }

    /// Cells a step of the layout: 1, or 16 where patches are blocks.
    #[must_use]
    pub fn unit(self) -> u32 {
        self.unit
    }

    /// Side of an M block in cells, `m = (n + 1) / 4 - 1` (Song et al. 2016, Eq. 1), in whole units.
    #[must_use]
    pub fn m(self) -> u32 {
        self.n.div_ceil(4) - self.unit
    }

    /// Cells a side of a window, `4m + 2` units; `n - 1` where a unit is a cell.
    #[must_use]
    pub fn cells(self) -> u32 {
        self.n + 1 - 2 * self.unit
    }

    /// Cells of the data that a level surely covers, wherever the camera stands over them. 0 where n = 127 goes by
    /// blocks: then every level there is is taken.
    #[must_use]
    pub(crate) fn reach(self) -> i64 {
        2 * i64::from(self.m()) - 2 * i64::from(self.unit)
    }
}

/// Which of its four places the L block takes: on the low or high side of the finer window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LPosition {
    /// True when the L's vertical arm lies on the east (high) side.
    pub high_x: bool,
    /// True when the L's horizontal arm lies on the north (high) side.
    pub high_y: bool,
}

/// Where every level's window stands. A pure function of its arguments: no history.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Windows {
    /// Window size and level count.
    pub shape: ClipmapShape,
    /// Lattice of the data underneath.
    pub lattice: Lattice,
    /// Finest level that is drawn; finer ones are loaded but inactive (the camera is too high).
    pub finest: u32,
    /// Origin of each level's window in that level's own lattice; always even.
    pub origins: Vec<[i32; 2]>,
    /// True when levels finer than `finest` hold no samples either.
    pub sleeps: bool,
    /// Sides (south, north, west, east) beyond which another chart lies: one more node is held there,
    /// for the normals on the border.
    pub apron: [bool; 4],
}

impl Windows {
    /// Places all windows around `centre`, in base samples east and north of the first sample.
    ///
    /// The centre is clamped to the data, so that a camera far outside still sees the nearest part.
    #[must_use]
    pub fn place(shape: ClipmapShape, lattice: Lattice, centre: [f64; 2], finest: u32) -> Self {
        let m = i32_from(shape.m());
        let unit = i32_from(shape.unit());
        // Origins stand on every second unit, so that they are whole units of the coarser level.
        let step = f64::from(2 * unit);
        let half = f64::from(2 * m + unit);
        let mut origin = [0, 1].map(|a| {
            let inside = if centre[a].is_finite() { centre[a] } else { 0.0 };
            let inside = inside.clamp(0.0, f64::from(lattice.last[a]));
            let snapped = ((inside - half) / step).round() * step;
            #[expect(clippy::cast_possible_truncation, reason = "clamped to the lattice, which fits i32")]
            let snapped = snapped as i32;
            snapped
        });
        let mut origins = vec![origin];
        for _ in 1..shape.levels() {
            // The finer window begins m or m + 1 units inside; the even one of both is ours.
            origin = origin.map(|o| {
                let low = o / 2 - m;
                if low % (2 * unit) == 0 { low } else { low - unit }
            });
            origins.push(origin);
        }
        Self {
            shape,
            lattice,
            finest: finest.min(shape.levels() - 1),
            origins,
            sleeps: false,
            apron: [false; 4],
        }
    }

    /// The samples level `level` keeps: what it draws and the nodes beyond borders with other charts.
    #[must_use]
    pub fn held(&self, level: u32) -> Rect {
        if self.sleeps && level < self.finest {
            return Rect { lo: [0, 0], hi: [-1, -1] };
        }
        let last = self.lattice.last_at(level);
        let [south, north, west, east] = self.apron.map(i32::from);
        let all = Rect { lo: [-west, -south], hi: [last[0] + east, last[1] + north] };
        self.window(level).intersect(all)
    }

    /// The samples level `level` may draw: its window where there is data, in its own lattice.
    #[must_use]
    pub fn loaded(&self, level: u32) -> Rect {
        self.window(level).intersect(Rect { lo: [0, 0], hi: self.lattice.last_at(level) })
    }

    /// The whole window of `level` in its own lattice, hanging over the data's border where it does.
    #[must_use]
    pub fn window(&self, level: u32) -> Rect {
        let lo = self.origins[level as usize];
        let side = i32_from(self.shape.cells());
        Rect { lo, hi: [lo[0] + side, lo[1] + side] }
    }

    /// The part of the data under the window of `level`, in base samples.
    #[must_use]
    pub fn covered(&self, level: u32) -> Rect {
        let r = self.loaded(level);
        Rect { lo: self.lattice.base(level, r.lo), hi: self.lattice.base(level, r.hi) }
    }

    /// Everything drawn for this camera, in base samples.
    #[must_use]
    pub fn domain(&self) -> Rect {
        self.covered(self.shape.levels() - 1)
    }

    /// Place of the L block of `level`; `None` on the finest active level, which fills its hole.
    #[must_use]
    pub fn l_position(&self, level: u32) -> Option<LPosition> {
        if level <= self.finest {
            return None;
        }
        Some(self.l_position_of_data(level))
    }

    /// As [`Windows::l_position`], also where finer levels are inactive (level 0: low, low).
    #[must_use]
    pub fn l_position_of_data(&self, level: u32) -> LPosition {
        if level == 0 {
            return LPosition { high_x: false, high_y: false };
        }
        let coarse = self.origins[level as usize];
        let fine = self.origins[level as usize - 1];
        let m = i32_from(self.shape.m());
        let high = |a: usize| fine[a] / 2 - coarse[a] == m;
        LPosition { high_x: high(0), high_y: high(1) }
    }

    /// Level whose samples own the vertex at base index `base` seen from a patch of `level`.
    ///
    /// Shared edges belong to the finer level, so that any prefilter may make the coarser ones.
    #[must_use]
    pub fn owner(&self, level: u32, base: [i32; 2]) -> u32 {
        if level > self.finest && self.covered(level - 1).on_perimeter(base) { level - 1 } else { level }
    }
}

pub(crate) fn i32_from(v: u32) -> i32 {
    // Window sizes and level counts are at most 1023: always in range.
    v.try_into().unwrap_or(i32::MAX)
}
