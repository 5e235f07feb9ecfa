//! Curved base surfaces: units, the frame's anchor, and the records of blocks the GPU holds.

use std::sync::Arc;

use glam::DVec3;

use super::{Renderer, State};
use crate::camera::Camera;
use crate::clipmap::{ChartWindows, ClipmapShape, Strip};
use crate::gpu::{BLOCK_SIDE, GpuCurve, GpuCurveLevel, Ground, block_cells};
use crate::measure::FrameUpload;
use crate::reference::Frustum;
use crate::scene::{Curved, Terrain};
use crate::surface::{Base, LOW_BITS, Units, anchor_record, anchor_words, block_record, words_m};

/// What a renderer keeps of its base surface.
pub(super) struct CurveState {
    curved: Arc<Curved>,
    units: Units,
    /// Block whose record lies in each place of each lane's toroidal table.
    held: Vec<Option<[i32; 2]>>,
    /// Greatest height above or below the base surface, metres.
    height_m: f64,
    lowest_m: f64,
    /// How far the fog should let one see, metres; wherever the data lies in the world.
    pub(super) span_m: f64,
}

impl CurveState {
    pub(super) fn new(curved: &Arc<Curved>, shape: ClipmapShape, terrain: &Terrain) -> Self {
        let [low, high] = curved.height_range().unwrap_or([0.0, 0.0]).map(f64::from);
        let height_m = if curved.points.is_some() { 0.0 } else { low.abs().max(high.abs()) };
        let reach_m = curved.surface.reach_m() + height_m;
        let cell_m = curved.surface.cell_m();
        let units = Units::new(shape.levels(), cell_m, block_cells(shape), height_m, reach_m);
        let charts = terrain.graph().charts.len();
        let places = charts * shape.levels() as usize * (BLOCK_SIDE * BLOCK_SIDE) as usize;
        let span_m = match curved.base {
            Base::Sampled | Base::Plane => half_extent(curved),
            _ => curved.surface.reach_m(),
        };
        Self { curved: curved.clone(), units, held: vec![None; places], height_m, lowest_m: low, span_m }
    }

    /// The buffers are new: nothing lies there.
    pub(super) fn forget(&mut self) {
        self.held.fill(None);
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
    /// Records of the blocks under all windows that the GPU does not hold yet.
    pub(super) fn upload_records(&mut self, windows: &ChartWindows, upload: &mut FrameUpload) {
        let (Some(state), Some(buffers)) = (&mut self.curve, &self.buffers.curved) else { return };
        let cells = i32::try_from(block_cells(self.shape)).unwrap_or(1);
        let words = self.plan.variant.extent().record_words();
        let side = BLOCK_SIDE as i32;
        let levels = self.shape.levels();
        for (chart, own) in windows.charts.iter().enumerate() {
            for level in 0..levels {
                let area = own.held(level);
                if area.is_empty() {
                    continue;
                }
                let last = own.lattice.last_at(level);
                let unit = state.units.level_m[level as usize];
                let lane = chart * levels as usize + level as usize;
                // Nodes from the last one on begin a block of their own.
                let block = |node: i32, a: usize| {
                    if node >= last[a] {
                        (last[a] + cells - 1).div_euclid(cells)
                    } else {
                        node.div_euclid(cells)
                    }
                };
                for y in block(area.lo[1], 1)..=block(area.hi[1], 1) {
                    let row = (lane as i32 * side + y.rem_euclid(side)) * side;
                    // Runs of neighbours in the table go in one write.
                    let mut run: Vec<[i32; 4]> = Vec::new();
                    let mut run_at = 0;
                    for x in block(area.lo[0], 0)..=block(area.hi[0], 0) {
                        let at = (row + x.rem_euclid(side)) as usize;
                        if state.held[at] == Some([x, y]) {
                            continue;
                        }
                        state.held[at] = Some([x, y]);
                        if !run.is_empty() && at != run_at + run.len() / words {
                            flush(&self.queue, &buffers.records, run_at * words, &mut run, upload);
                        }
                        if run.is_empty() {
                            run_at = at;
                        }
                        if let Some(points) = &state.curved.points {
                            let start = [x, y].map(|b| b * cells);
                            let node = [0, 1].map(|a| start[a].clamp(0, last[a]));
                            let anchor = points.position(level, node).unwrap_or_else(|| {
                                let at = node.map(|n| f64::from(n) * f64::from(1_u32 << level));
                                state.curved.surface.base(0, at).0.to_array()
                            });
                            run.extend(anchor_record(anchor, unit));
                        } else {
                            let surface = state.curved.surface.as_ref();
                            let record =
                                block_record(surface, chart, own.lattice.last, level, [x, y], cells, unit);
                            run.extend_from_slice(bytemuck::cast_slice(std::slice::from_ref(&record)));
                        }
                    }
                    flush(&self.queue, &buffers.records, run_at * words, &mut run, upload);
                }
            }
        }
    }

    /// Appends a strip's positions to the staging words: offsets from their block's anchor.
    pub(super) fn stage_points(&mut self, chart: usize, strip: Strip) {
        let Some(state) = &self.curve else { return };
        let Some(points) = state.curved.points.clone() else { return };
        let cells = i32::try_from(block_cells(self.shape)).unwrap_or(1);
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
                let first = [0, 1].map(|a| {
                    let block = if node[a] >= last[a] {
                        (last[a] + cells - 1).div_euclid(cells)
                    } else {
                        node[a].div_euclid(cells)
                    };
                    (block * cells).clamp(0, last[a])
                });
                let anchor = points.position(strip.level, first).unwrap_or_else(|| {
                    let at = first.map(|n| f64::from(n) * f64::from(1_u32 << strip.level));
                    state.curved.surface.base(0, at).0.to_array()
                });
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
        for (slot, unit) in levels.iter_mut().zip(&curve.units.level_m) {
            let words = anchor_m.to_array().map(|v| anchor_words(v, *unit));
            let said = DVec3::from_array(words.map(|w| words_m(w, *unit)));
            *slot = GpuCurveLevel {
                hi: words.map(|w| w.0),
                lo: words.map(|w| w.1),
                unit_m: *unit as f32,
                slack_m: (64.0 * unit + 1e-6 * curve.height_m) as f32,
                rest_m: (said - anchor_m).as_vec3().to_array(),
                spare: 0.0,
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
            block_shift: block_cells(self.shape).trailing_zeros(),
            block_side: BLOCK_SIDE,
            record_words: u32::try_from(self.plan.variant.extent().record_words()).unwrap_or_default(),
            spare: 0,
        };
        State {
            windows,
            placement: None,
            frustum: Frustum { planes: Camera::planes(&clip) },
            anchor_m,
            curve: Some(gpu),
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
        // A chord of the cell's diagonal.
        let sag = coarsest * coarsest / (4.0 * ellipsoid.a.min(ellipsoid.b));
        let depth = curve.lowest_m.min(0.0) - sag;
        let (a, b) = (ellipsoid.a + depth, ellipsoid.b + depth);
        if a <= 0.0 || b <= 0.0 {
            return none;
        }
        let scale = DVec3::new(1.0 / a, 1.0 / a, 1.0 / b);
        let eye = camera.eye_m * scale;
        (scale, (eye.length_squared() - 1.0).max(0.0), eye)
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

fn flush(
    queue: &wgpu::Queue,
    records: &wgpu::Buffer,
    first_word: usize,
    run: &mut Vec<[i32; 4]>,
    upload: &mut FrameUpload,
) {
    if !run.is_empty() {
        queue.write_buffer(records, first_word as u64 * 16, bytemuck::cast_slice(run));
        upload.surface_bytes += size_of_val(&run[..]) as u64;
        run.clear();
    }
}
