//! What factors by error need of the CPU: the limits, and which blocks came into the windows, with their
//! deviations.

use super::Renderer;
use crate::clipmap::{ChartWindows, Rect, difference};
use crate::gpu::{DEVIATION_WORDS, GpuChoice};
use crate::measure::FrameUpload;
use crate::pyramid::{BLOCK_CELLS, BlockDeviation};
use crate::scene::{Factors, Terrain};
use crate::surface::Base;

/// Least threshold, pixels: far below what f32 tells of a picture. Also for what is no number.
const LEAST_PX: f32 = 1e-3;

/// Measures what is measured when first asked for: now, not in the first frame. False where the finest level's
/// deviations are not known, so that nothing can be left out of it and no budget be kept.
pub(super) fn measure(terrain: &Terrain) -> bool {
    let first = Rect { lo: [0, 0], hi: [0, 0] };
    let sources = terrain.curved.as_ref().map_or(std::slice::from_ref(&terrain.source), |c| &c.sources);
    sources.iter().all(|source| {
        let mut blocks = Vec::new();
        source.read_deviations(0, first, &mut blocks) && blocks.iter().all(|b| *b != BlockDeviation::UNKNOWN)
    })
}

impl Renderer {
    /// Most triangles a frame, where the scene says so.
    #[must_use]
    pub fn budget(&self) -> Option<u32> {
        match self.scene.factors {
            Factors::ByError { budget, .. } => budget,
            Factors::Uniform => None,
        }
    }

    /// Sends the limits, and the deviations of blocks that the windows did not hold before, whose nodes are to
    /// be graded then. After [`Renderer::upload_strips`], which begins the frame's work.
    pub(super) fn upload_choice(
        &mut self,
        windows: &ChartWindows,
        size_px: [u32; 2],
        upload: &mut FrameUpload,
    ) {
        let Some(buffers) = &self.buffers.deviations else { return };
        let (pixel_error, budget) = match self.scene.factors {
            Factors::ByError { pixel_error, budget } => (pixel_error, budget),
            Factors::Uniform => (None, None),
        };
        let choice = GpuChoice {
            half_px: size_px.map(|v| v as f32 * 0.5),
            // The threshold asked for is the scale's lowest mark: it is met exactly, and nothing finer is drawn.
            // Under a budget alone the scale runs from 1/32 pixel on.
            reference_px: pixel_error.map_or(1.0, |px| if px >= LEAST_PX { px.min(1e6) } else { LEAST_PX }),
            reference_bin: if pixel_error.is_some() { 0.0 } else { 100.0 },
            // 0 says that there is none.
            budget: budget.map_or(0, |most| most.clamp(1, i32::MAX.cast_unsigned())),
            bend_m: self.bend_m(),
            spare: [0; 2],
        };
        self.queue.write_buffer(&buffers.choice, 0, bytemuck::bytes_of(&choice));
        upload.factor_bytes += size_of::<GpuChoice>() as u64;
        let cells = BLOCK_CELLS.cast_signed();
        // Windows are whole blocks: their last sample begins a block they do not hold.
        let blocks = |r: Rect| Rect {
            lo: r.lo.map(|v| v.div_euclid(cells)),
            hi: r.hi.map(|v| (v - 1).div_euclid(cells)),
        };
        let nothing = Rect { lo: [0, 0], hi: [-1, -1] };
        let mut described = std::mem::take(&mut self.described);
        described.resize(self.lanes() as usize, nothing);
        let mut fresh = Vec::new();
        for (chart, own) in windows.charts.iter().enumerate() {
            // A streamed level that waits for its samples is not drawn: it gets its blocks when it is.
            let from = if own.sleeps { own.finest } else { 0 };
            for level in from..self.shape.levels() {
                let area = own.loaded(level);
                let lane = self.lane(chart, level);
                let Some(table) = described.get_mut(lane as usize).filter(|_| area.has_area()) else {
                    continue;
                };
                let now = blocks(area);
                // Samples and grades are there once they are recorded, deviations as soon as they are sent.
                let held = self.held_window(chart, level).map_or(nothing, blocks);
                for rect in difference(now, now.intersect(held).intersect(*table)) {
                    self.send_deviations(&buffers.deviations, (chart, level), rect, upload);
                    fresh.extend(words_of(lane, rect));
                }
                *table = now;
            }
        }
        self.described = described;
        self.send_fresh(fresh, upload);
    }

    /// Names the blocks whose nodes are to be graded.
    fn send_fresh(&mut self, mut blocks: Vec<[u32; 4]>, upload: &mut FrameUpload) {
        let count = u32::try_from(blocks.len()).unwrap_or(u32::MAX);
        let (Some(buffers), Some(first)) = (&self.buffers.by_error, blocks.first_mut()) else { return };
        // Rows of the dispatch are whole: the first block says where to stop.
        first[3] = count;
        self.work.fresh_blocks = count;
        self.queue.write_buffer(&buffers.fresh, 0, bytemuck::cast_slice(&blocks));
        upload.factor_bytes += size_of_val(&blocks[..]) as u64;
    }

    fn lane(&self, chart: usize, level: u32) -> u32 {
        u32::try_from(chart).unwrap_or_default() * self.shape.levels() + level
    }

    /// How far the chord of a level-0 cell may lie off the curved base surface, and off what the heights stand on;
    /// it grows with the square of the cell. A cell's long diagonal is at most two of its sides, 5 % of distortion
    /// included: `r (2 angle)^2 / 8`. Where the surface bends both ways, chords err to either side.
    fn bend_m(&self) -> f32 {
        // Positions hold all of the surface themselves.
        let Some(curved) = self.terrain.curved.as_ref().filter(|c| c.points.is_none()) else { return 0.0 };
        let (radius_m, angle) = curved.surface.bend();
        let [low, high] = curved.height_range().unwrap_or([0.0; 2]).map(f64::from);
        let sides = if matches!(curved.base, Base::Torus { .. }) { 2.0 } else { 1.0 };
        let bend = sides * 0.55 * (radius_m + low.abs().max(high.abs())) * angle * angle;
        if bend.is_finite() { (bend as f32).next_up() } else { 0.0 }
    }

    /// Rows of blocks to their places in the toroidal table.
    fn send_deviations(
        &self,
        buffer: &wgpu::Buffer,
        (chart, level): (usize, u32),
        rect: Rect,
        upload: &mut FrameUpload,
    ) {
        let source = self.terrain.curved.as_ref().map_or(&self.terrain.source, |c| &c.sources[chart]);
        let lane = self.lane(chart, level);
        let mut blocks = Vec::new();
        if !source.read_deviations(level, rect, &mut blocks) {
            blocks.resize(usize::try_from(rect.count()).unwrap_or(0), BlockDeviation::UNKNOWN);
        }
        let side = (self.shape.n() + 1) / BLOCK_CELLS;
        let wrap = |v: i32| v.rem_euclid(side.cast_signed()).unsigned_abs();
        let width = rect.hi[0].abs_diff(rect.lo[0]) as usize + 1;
        for (y, row) in (rect.lo[1]..).zip(blocks.chunks_exact(width)) {
            let words: Vec<[u32; DEVIATION_WORDS]> = row.iter().map(|b| b.words()).collect();
            // The row may run over the table's end once.
            let first = wrap(rect.lo[0]);
            let fits = ((side - first) as usize).min(width);
            for (column, part) in [(first, &words[..fits]), (0, &words[fits..])] {
                if part.is_empty() {
                    continue;
                }
                let block = u64::from((lane * side + wrap(y)) * side + column);
                let at = block * (DEVIATION_WORDS * size_of::<u32>()) as u64;
                self.queue.write_buffer(buffer, at, bytemuck::cast_slice(part));
                upload.factor_bytes += size_of_val(part) as u64;
            }
        }
    }
}

/// Blocks of a lane, as the passes read them.
fn words_of(lane: u32, rect: Rect) -> impl Iterator<Item = [u32; 4]> {
    let rows = rect.lo[1]..=rect.hi[1];
    rows.flat_map(move |y| {
        (rect.lo[0]..=rect.hi[0]).map(move |x| [lane, x.cast_unsigned(), y.cast_unsigned(), 0])
    })
}

impl Renderer {
    /// As [`Renderer::record`], with the choice of factors made `more` times over: what it costs in a frame.
    #[doc(hidden)]
    pub fn record_choosing_more(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        target: crate::renderer::Target<'_>,
        more: u32,
    ) {
        let chooses = |stem: &str| ["wish_factors", "weigh_factors", "set_factors"].contains(&stem);
        let finishes = |stem: &str| ["compact_patches", "expand_leaves"].contains(&stem);
        self.record_passes(encoder, |stem| !chooses(stem) && !finishes(stem));
        for _ in 0..=more {
            self.record_passes(encoder, chooses);
        }
        self.record_passes(encoder, finishes);
        self.record_draw_again(encoder, target);
    }
}
