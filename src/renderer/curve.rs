//! Curved base surfaces: units, the frame's anchor, and the records of blocks the GPU holds.

use std::sync::Arc;

use glam::DVec3;

use super::{Renderer, State};
use crate::camera::Camera;
use crate::clipmap::{ChartWindows, ClipmapShape, Strip};
use crate::gpu::{Extent, GpuCurve, GpuCurveLevel, Ground};
use crate::measure::FrameUpload;
use crate::reference::Frustum;
use crate::scene::Curved;
use crate::surface::{
    ANCHOR_WORDS, Base, LOW_BITS, RECORD_WORDS, SHORT_WORDS, SURFACE_TERMS, Units, anchor_at, anchor_words,
    block_record, words_m,
};

/// What a renderer keeps of its base surface.
pub(super) struct CurveState {
    curved: Arc<Curved>,
    units: Units,
    /// Levels whose records end before the products beyond the fourth degree.
    short: Vec<bool>,
    /// Block whose anchor lies in each place of each lane's toroidal table,
    anchored: Vec<Option<[i32; 2]>>,
    /// and whose record in each place of that table, which is smaller.
    recorded: Vec<Option<[i32; 2]>>,
    /// Greatest height above or below the base surface, metres.
    height_m: f64,
    lowest_m: f64,
    /// How far the fog should let one see, metres; wherever the data lies in the world.
    pub(super) span_m: f64,
}

impl CurveState {
    pub(super) fn new(curved: &Arc<Curved>, shape: ClipmapShape, extent: Extent) -> Self {
        let [low, high] = curved.height_range().unwrap_or([0.0, 0.0]).map(f64::from);
        let height_m = if curved.points.is_some() { 0.0 } else { low.abs().max(high.abs()) };
        let reach_m = curved.surface.reach_m() + height_m;
        let cell_m = curved.surface.cell_m();
        let units = Units::new(shape.levels(), cell_m, extent.block_cells, height_m, reach_m);
        let lanes = curved.graph.charts.len() * shape.levels() as usize;
        let places = |side: u32| vec![None; lanes * (side * side) as usize];
        let span_m = match curved.base {
            Base::Sampled | Base::Plane => half_extent(curved),
            _ => curved.surface.reach_m(),
        };
        let (radius_m, bend) = curved.surface.bend();
        let half_block = 0.5 * f64::from(extent.block_cells);
        let short = units
            .level_m
            .iter()
            .enumerate()
            .map(|(level, unit)| {
                // What the products beyond the fourth degree amount to. Close by, a fraction of a millimetre
                // may be left out; of a level that is only seen beyond a finer one's thirty cells, more.
                let cell = cell_m * f64::from(1_u32 << level);
                let angle = half_block * bend * f64::from(1_u32 << level);
                let left_out = (radius_m * angle.powi(5) / 16.0).max(height_m * angle.powi(4) / 24.0);
                let always_far = level > 0 && curved.globe.as_ref().is_none_or(|g| g.layer_count() == 1);
                left_out.is_nan() || left_out <= unit.max(if always_far { 1e-5 * cell } else { 0.0 })
            })
            .collect();
        Self {
            curved: curved.clone(),
            units,
            short,
            anchored: places(extent.anchor_side(shape)),
            recorded: places(extent.record_side(shape)),
            height_m,
            lowest_m: low,
            span_m,
        }
    }

    /// The buffers are new: nothing lies there.
    pub(super) fn forget(&mut self) {
        self.anchored.fill(None);
        self.recorded.fill(None);
    }

    /// Where the frame's positions are relative to: the eye on a grid of about 2^20 units, within what
    /// the words can say.
    fn anchor(&self, eye: DVec3) -> DVec3 {
        let unit = self.units.level_m[0];
        let grid = unit * f64::from(1 << 20);
        let most = unit * f64::from(1 << LOW_BITS) * f64::from(1 << 29);
        DVec3::from_array(eye.to_array().map(|v| ((v / grid).round() * grid).clamp(-most, most)))
    }
}

impl Renderer {
    /// Anchors and records of the blocks under all windows that the GPU does not hold yet.
    pub(super) fn upload_records(&mut self, windows: &ChartWindows, upload: &mut FrameUpload) {
        let (Some(state), Some(buffers)) = (&mut self.curve, &self.buffers.curved) else { return };
        let cells = i32::try_from(self.plan.variant.block_cells).unwrap_or(1);
        let levels = self.shape.levels();
        let extent = self.plan.variant.extent();
        let mut anchors = Runs::new(extent.anchor_side(self.shape), ANCHOR_WORDS);
        let mut records = Runs::new(extent.record_side(self.shape), RECORD_WORDS);
        for (chart, own) in windows.charts.iter().enumerate() {
            for level in 0..levels {
                let area = own.held(level);
                if area.is_empty() {
                    continue;
                }
                let last = own.lattice.last_at(level);
                let unit = state.units.level_m[level as usize];
                let lane = chart * levels as usize + level as usize;
                let [lo, hi] =
                    [area.lo, area.hi].map(|node| [0, 1].map(|a| block_at(node[a], last[a], cells)));
                for y in lo[1]..=hi[1] {
                    for x in lo[0]..=hi[0] {
                        let anchor_held = &mut state.anchored[anchors.place(lane, [x, y])];
                        let record_held = state.recorded.get_mut(records.place(lane, [x, y]));
                        let has_record = record_held.as_ref().is_none_or(|held| **held == Some([x, y]));
                        if *anchor_held == Some([x, y]) && has_record {
                            continue;
                        }
                        *anchor_held = Some([x, y]);
                        if let Some(held) = record_held {
                            *held = Some([x, y]);
                        }
                        if state.curved.points.is_some() {
                            let anchor = point_anchor(&state.curved, level, [x, y], cells);
                            anchors.add(lane, [x, y], &anchor_at(anchor, unit));
                            continue;
                        }
                        let surface = state.curved.surface.as_ref();
                        let (anchor, record) =
                            block_record(surface, chart, own.lattice.last, level, [x, y], cells, unit);
                        anchors.add(lane, [x, y], &anchor);
                        let words: &[[i32; 4]] = bytemuck::cast_slice(std::slice::from_ref(&record));
                        let end = if state.short[level as usize] { SHORT_WORDS } else { RECORD_WORDS };
                        records.add(lane, [x, y], &words[..end]);
                    }
                }
            }
        }
        for (buffer, runs) in [(Some(&buffers.anchors), anchors), (buffers.records.as_ref(), records)] {
            let Some(buffer) = buffer else { continue };
            for (first_word, run) in runs.done {
                self.queue.write_buffer(buffer, first_word as u64 * 16, bytemuck::cast_slice(&run));
                upload.surface_bytes += size_of_val(&run[..]) as u64;
            }
        }
    }

    /// Appends a strip's positions to the staging words: offsets from their block's anchor.
    pub(super) fn stage_points(&mut self, chart: usize, strip: Strip) {
        let Some(state) = &self.curve else { return };
        let Some(points) = state.curved.points.clone() else { return };
        let cells = i32::try_from(self.plan.variant.block_cells).unwrap_or(1);
        let lattice = state.curved.graph.charts[chart].lattice;
        let unit = state.units.level_m[strip.level as usize];
        let last = lattice.last_at(strip.level);
        for y in strip.rect.lo[1]..=strip.rect.hi[1] {
            for x in strip.rect.lo[0]..=strip.rect.hi[0] {
                let node = [x, y];
                let Some(p) = points.position(strip.level, node) else {
                    self.staging.extend([i32::MIN.cast_unsigned(), 0, 0]);
                    continue;
                };
                let block = [0, 1].map(|a| block_at(node[a], last[a], cells));
                let anchor = point_anchor(&state.curved, strip.level, block, cells);
                let offset = |a: usize| {
                    let from = words_m(anchor_words(anchor[a], unit), unit);
                    #[expect(clippy::cast_possible_truncation, reason = "saturates; units make it fit")]
                    let units = ((p[a] - from) / unit).round() as i32;
                    units.max(-i32::MAX).cast_unsigned()
                };
                let words = [offset(0), offset(1), offset(2)];
                self.staging.extend(words);
            }
        }
    }

    pub(super) fn curved_state(
        &self,
        curve: &CurveState,
        camera: &Camera,
        windows: ChartWindows,
        size_px: [u32; 2],
        shifted: &[(usize, u32)],
    ) -> State {
        let anchor_m = curve.anchor(camera.eye_m);
        let clip = self.clip(camera, anchor_m, size_px);
        let mut levels = [GpuCurveLevel::default(); crate::clipmap::MAX_LEVELS as usize];
        for (level, (slot, unit)) in levels.iter_mut().zip(&curve.units.level_m).enumerate() {
            let words = anchor_m.to_array().map(|v| anchor_words(v, *unit));
            let said = DVec3::from_array(words.map(|w| words_m(w, *unit)));
            *slot = GpuCurveLevel {
                hi: words.map(|w| w.0),
                lo: words.map(|w| w.1),
                unit_m: *unit as f32,
                slack_m: (64.0 * unit + 1e-6 * curve.height_m) as f32,
                rest_m: (said - anchor_m).as_vec3().to_array(),
                terms: SURFACE_TERMS[usize::from(curve.short[level])],
            };
        }
        let mut bits = [[0; 4]; 3];
        for (chart, level) in shifted {
            bits[chart / 4][chart % 4] |= 1 << level;
        }
        let (horizon_scale, horizon, horizon_eye) = self.horizon(curve, camera);
        let gpu = GpuCurve {
            levels,
            shifted: bits,
            horizon_scale: horizon_scale.as_vec3().to_array(),
            horizon: horizon as f32,
            horizon_eye: horizon_eye.as_vec3().to_array(),
            chart_count: self.plan.variant.charts,
            block_shift: self.plan.variant.block_cells.trailing_zeros(),
            record_side: self.plan.variant.extent().record_side(self.shape),
            anchor_side: self.plan.variant.extent().anchor_side(self.shape),
            spare: 0,
        };
        State {
            windows,
            placement: None,
            frustum: Frustum { planes: Camera::planes(&clip) },
            anchor_m,
            curve: Some(gpu),
            background: self.background(camera),
        }
    }

    /// The ellipsoid that hides what lies behind it: under the lowest ground, and under the chords of the
    /// coarsest cells, which cut below the surface. Scale to its unit sphere, how far the squared distance
    /// of the eye there exceeds 1 (0: nothing is hidden), and the eye.
    fn horizon(&self, curve: &CurveState, camera: &Camera) -> (DVec3, f64, DVec3) {
        let none = (DVec3::ZERO, 0.0, DVec3::ZERO);
        let Some(ellipsoid) = curve.curved.whole.filter(|_| self.plan.variant.ground == Ground::Curved)
        else {
            return none;
        };
        let coarsest = curve.curved.surface.cell_m() * f64::from(1_u32 << (self.shape.levels() - 1));
        // A chord of the cell's diagonal, where the surface bends most.
        let sag = coarsest * coarsest / (4.0 * curve.curved.surface.least_radius_m());
        let depth = sag - curve.lowest_m.min(0.0);
        // Scaled as a whole, so that it lies at least that deep everywhere; axes shortened by as much would
        // not, between the equator and the poles.
        let kept = 1.0 - depth / ellipsoid.a.min(ellipsoid.b);
        if kept <= 0.0 {
            return none;
        }
        let (a, b) = (ellipsoid.a * kept, ellipsoid.b * kept);
        let scale = DVec3::new(1.0 / a, 1.0 / a, 1.0 / b);
        let eye = camera.eye_m * scale;
        (scale, (eye.length_squared() - 1.0).max(0.0), eye)
    }
}

/// Block of a node along one axis; nodes from the last one on begin a block of their own.
fn block_at(node: i32, last: i32, cells: i32) -> i32 {
    if node >= last { (last + cells - 1).div_euclid(cells) } else { node.div_euclid(cells) }
}

/// Anchor of a block of positions: its first node, or what lies nearest to it where that is void.
fn point_anchor(curved: &Curved, level: u32, block: [i32; 2], cells: i32) -> [f64; 3] {
    let last = curved.graph.charts[0].lattice.last_at(level);
    let node = [0, 1].map(|a| (block[a] * cells).clamp(0, last[a]));
    let known = curved.points.as_ref().and_then(|p| p.position(level, node));
    known.unwrap_or_else(|| {
        let at = node.map(|n| f64::from(n) * f64::from(1_u32 << level));
        curved.surface.base(0, at).0.to_array()
    })
}

/// Entries of the lanes' toroidal tables, neighbours in one write.
struct Runs {
    side: u32,
    words: usize,
    done: Vec<(usize, Vec<[i32; 4]>)>,
}

impl Runs {
    fn new(side: u32, words: usize) -> Self {
        Self { side, words, done: Vec::new() }
    }

    fn place(&self, lane: usize, block: [i32; 2]) -> usize {
        let side = i64::from(self.side.max(1));
        let [x, y] = block.map(|b| i64::from(b).rem_euclid(side));
        let place = (lane as i64 * side + y) * side + x;
        usize::try_from(place).unwrap_or_default()
    }

    fn add(&mut self, lane: usize, block: [i32; 2], entry: &[[i32; 4]]) {
        let word = self.place(lane, block) * self.words;
        match self.done.last_mut() {
            Some((first, run)) if *first + run.len() == word => run.extend_from_slice(entry),
            _ => self.done.push((word, entry.to_vec())),
        }
    }
}

/// Half the greatest extent of the base surface along any axis, metres.
fn half_extent(curved: &Curved) -> f64 {
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    for (k, chart) in curved.graph.charts.iter().enumerate() {
        for i in 0..81 {
            let at = [i % 9, i / 9].map(|v| f64::from(v) / 8.0);
            let (p, _) = curved.surface.base(k, [0, 1].map(|a| at[a] * f64::from(chart.lattice.last[a])));
            low = low.min(p);
            high = high.max(p);
        }
    }
    ((high - low) * 0.5).max_element().max(1e-6)
}
