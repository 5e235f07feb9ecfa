//! What factors by error need of the CPU: deviations of the blocks that came into the windows, and the limits.

use super::Renderer;
use crate::clipmap::{ChartWindows, Rect, difference};
use crate::gpu::GpuChoice;
use crate::measure::FrameUpload;
use crate::pyramid::{BLOCK_CELLS, BlockDeviation};
use crate::scene::{Factors, Terrain};
use crate::surface::Base;

/// Measures what is measured when first asked for: now, not in the first frame.
pub(super) fn measure(terrain: &Terrain) {
    let first = Rect { lo: [0, 0], hi: [0, 0] };
    let sources = terrain.curved.as_ref().map_or(std::slice::from_ref(&terrain.source), |c| &c.sources);
    for source in sources {
        source.read_deviations(0, first, &mut Vec::new());
    }
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

    /// Sends the limits, and the deviations of blocks that the windows did not hold before.
    pub(super) fn upload_choice(&self, windows: &ChartWindows, size_px: [u32; 2], upload: &mut FrameUpload) {
        let Some(buffers) = &self.buffers.deviations else { return };
        let (pixel_error, budget) = match self.scene.factors {
            Factors::ByError { pixel_error, budget } => (pixel_error, budget),
            Factors::Uniform => (None, None),
        };
        let choice = GpuChoice {
            half_px: size_px.map(|v| v as f32 * 0.5),
            // The threshold asked for is the scale's lowest mark: it is met exactly, and nothing finer is drawn.
            // Under a budget alone the scale runs from 1/32 to 200 pixels.
            reference_px: pixel_error.unwrap_or(1.0),
            reference_bin: if pixel_error.is_some() { 0.0 } else { 100.0 },
            budget: budget.unwrap_or(0),
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
        for (chart, own) in windows.charts.iter().enumerate() {
            // A streamed level that waits for its samples is not drawn: it gets its blocks when it is.
            let from = if own.sleeps { own.finest } else { 0 };
            for level in from..self.shape.levels() {
                let now = blocks(own.loaded(level));
                let held = self.held_window(chart, level).map(blocks);
                let kept = held.map_or(Rect { lo: [0, 0], hi: [-1, -1] }, |h| now.intersect(h));
                for rect in difference(now, kept) {
                    self.send_deviations(&buffers.deviations, (chart, level), rect, upload);
                }
            }
        }
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
        let lane = u32::try_from(chart).unwrap_or_default() * self.shape.levels() + level;
        let mut blocks = Vec::new();
        if !source.read_deviations(level, rect, &mut blocks) {
            blocks.resize(usize::try_from(rect.count()).unwrap_or(0), BlockDeviation::UNKNOWN);
        }
        let side = (self.shape.n() + 1) / BLOCK_CELLS;
        let wrap = |v: i32| v.rem_euclid(side.cast_signed()).unsigned_abs();
        let width = rect.hi[0].abs_diff(rect.lo[0]) as usize + 1;
        for (y, row) in (rect.lo[1]..).zip(blocks.chunks_exact(width)) {
            let words: Vec<[u32; 3]> = row.iter().map(|b| b.words()).collect();
            // The row may run over the table's end once.
            let first = wrap(rect.lo[0]);
            let fits = ((side - first) as usize).min(width);
            for (column, part) in [(first, &words[..fits]), (0, &words[fits..])] {
                if part.is_empty() {
                    continue;
                }
                let block = u64::from((lane * side + wrap(y)) * side + column);
                self.queue.write_buffer(buffer, block * 12, bytemuck::cast_slice(part));
                upload.factor_bytes += size_of_val(part) as u64;
            }
        }
    }
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
        let finishes = |stem: &str| ["compact_patches", "expand_patches"].contains(&stem);
        self.record_passes(encoder, |stem| !chooses(stem) && !finishes(stem));
        for _ in 0..=more {
            self.record_passes(encoder, chooses);
        }
        self.record_passes(encoder, finishes);
        self.record_draw_again(encoder, target);
    }
}
