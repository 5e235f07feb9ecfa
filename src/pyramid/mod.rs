//! The pyramid: a height grid and its coarser levels, read by rectangles.
//!
//! Levels are reached only through [`SampleSource`]: the seam where a tile cache over a store on
//! disk takes the place of the pyramid in memory. Nothing above knows which it is. A whole planet comes
//! through it as well, one [`GlobeFace`] for each chart, with samples made when they are asked for.

mod deviations;
mod globe;
mod measured;
mod memory;
mod points;
mod prefilter;
mod ring;
mod scaled;
#[cfg(feature = "store")]
pub mod store;
mod streaming;

pub use deviations::{BLOCK_CELLS, BlockDeviation, Deviations, FIGURES, blocks_at};
pub use globe::{Globe, GlobeError, GlobeFace};
pub use measured::Measured;
pub use memory::MemoryPyramid;
pub use points::PointHeights;
pub use prefilter::Prefilter;
pub use ring::{Ring, RingChart};
pub use scaled::Scaled;
pub use streaming::{LevelWish, StreamCounters, Streaming};

use crate::clipmap::{Lattice, Rect};

/// Stands for a void sample wherever samples are packed for the GPU: finite, so that no buffer ever
/// holds a NaN. A sample of exactly this value counts as void, whatever its mask says.
pub const VOID: f32 = f32::MAX;

/// Heights by level and rectangle.
pub trait SampleSource: Send + Sync {
    /// Lattice of the finest level.
    fn lattice(&self) -> Lattice;

    /// True when any sample is void.
    fn has_voids(&self) -> bool;

    /// Appends the samples of `rect` (indices of `level`, inside its lattice) to `out`: metres, row
    /// by row from the south-west, [`VOID`] where there is none.
    fn read(&self, level: u32, rect: Rect, out: &mut Vec<f32>);

    /// Lowest and highest valid height of the finest level in metres; `None` when all is void.
    fn height_range(&self) -> Option<[f32; 2]>;

    /// `Some(s)` when every sample of every level is a whole multiple of `s` metres that fits an `i16`
    /// (voids aside), so that it may travel as two bytes.
    fn step_m(&self) -> Option<f32> {
        None
    }

    /// As [`SampleSource::read`], but waits for samples that are not there yet. Never for use in a frame.
    fn read_now(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        self.read(level, rect, out);
    }

    /// The streaming side of a source whose samples arrive in the background; then [`SampleSource::read`]
    /// gives what is there, and the next coarser level's surface where nothing is.
    fn streaming(&self) -> Option<&dyn Streaming> {
        None
    }

    /// Lowest and highest height somewhere around a base sample, metres, where that is known without reading;
    /// a function of the place alone, whatever has arrived.
    fn relief_near(&self, _base: [i32; 2]) -> Option<[f32; 2]> {
        None
    }

    /// True when [`SampleSource::read_deviations`] knows them, or can measure them when it is first asked.
    fn has_deviations(&self) -> bool {
        false
    }

    /// Appends the deviations of `blocks` of a level (16 x 16 cells each), row by row from the south-west, and
    /// tells whether they are known; where they are not, nothing is appended.
    fn read_deviations(&self, _level: u32, _blocks: Rect, _out: &mut Vec<BlockDeviation>) -> bool {
        false
    }

    /// One sample, as [`SampleSource::read`] gives it.
    fn sample(&self, level: u32, index: [i32; 2]) -> f32 {
        let mut out = Vec::with_capacity(1);
        self.read(level, Rect { lo: index, hi: index }, &mut out);
        out.first().copied().unwrap_or(VOID)
    }
}

/// `Some(1.0)` when all samples but voids are whole metres that fit 16 bits.
fn whole_metres(samples: &[f32]) -> Option<f32> {
    let whole = |h: &f32| *h == VOID || (h.fract() == 0.0 && h.abs() <= f32::from(i16::MAX));
    samples.iter().all(whole).then_some(1.0)
}
