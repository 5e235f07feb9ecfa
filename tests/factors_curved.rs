//! Grades of nodes on curved bases as they lie on the GPU against the twin's, axis by axis.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

mod common;
#[path = "common/made.rs"]
mod made;

use glam::DVec3;
use made::{Point, frame, renderer, scene};
use tessclip::clipmap::Rect;
use tessclip::gpu::Offscreen;
use tessclip::heights::PositionGrid;
use tessclip::pyramid::{BlockDeviation, FIGURES};
use tessclip::quads::{BLOCK_NODES, PATCH_CELLS, block_nodes, full_cells, rank};
use tessclip::reference::{Grade, grades};
use tessclip::surface::{Base, Ellipsoid};
use tessclip::{Camera, Scene, Terrain};

/// Words the GPU keeps of a block: the bin of code 254 (20 an octave, 0 at a metre), two spare, codes.
const WORDS: usize = 98;
const ALWAYS: u32 = 255;
const AXES: [usize; 3] = [0, 1, 2];

/// How far a chord of a level-0 cell may lie off the base surface; positions hold all of theirs themselves.
fn bend_m(terrain: &Terrain) -> f64 {
    let curved = terrain.curved.as_ref().unwrap();
    if curved.points.is_some() {
        return 0.0;
    }
    assert!(matches!(curved.base, Base::Ellipsoid { .. }));
    let (radius_m, angle) = curved.surface.bend();
    let [low, high] = curved.height_range().unwrap().map(f64::from);
    0.55 * (radius_m + low.abs().max(high.abs())) * angle * angle
}

/// One block and where its nodes stand, metres from its first one.
struct Block {
    level: u32,
    cells: [u32; 2],
    full: [u32; 2],
    at: [[DVec3; BLOCK_NODES]; BLOCK_NODES],
    figures: BlockDeviation,
    /// What integers and f32 may lose of its positions, metres.
    slack_m: f64,
}

impl Block {
    fn of(terrain: &Terrain, chart: usize, level: u32, block: Point) -> Self {
        let curved = terrain.curved.as_ref().unwrap();
        let source = &curved.sources[chart];
        let (lattice, lo) = (source.lattice(), block.map(|v| v * PATCH_CELLS.cast_signed()));
        let last = lattice.last_at(level);
        let hi = [0, 1].map(|a: usize| (lo[a] + PATCH_CELLS.cast_signed()).min(last[a]));
        let mut figures = Vec::new();
        assert!(source.read_deviations(level, Rect { lo: block, hi: block }, &mut figures));
        let cells = [0, 1].map(|a: usize| hi[a].abs_diff(lo[a]));
        let first = curved.position(chart, level, lo).unwrap().0;
        let (mut at, mut extent_m) = ([[DVec3::ZERO; BLOCK_NODES]; BLOCK_NODES], 0.0_f64);
        for [x, y] in block_nodes().filter(|node| node[0] <= cells[0] && node[1] <= cells[1]) {
            let node = [lo[0] + x.cast_signed(), lo[1] + y.cast_signed()];
            let off = curved.position(chart, level, node).unwrap().0 - first;
            at[y as usize][x as usize] = off;
            extent_m = extent_m.max(off.length());
        }
        let full = full_cells(lattice, level, Rect { lo, hi });
        Self { level, cells, full, at, figures: figures[0], slack_m: 2e-6 * extent_m }
    }

    /// Metres that a rank's figure tells; `None` where it tells nothing.
    fn figure(&self, rank: usize) -> Option<f64> {
        let metres = self.figures.metres(rank);
        (metres < BlockDeviation::UNKNOWN.metres(0)).then_some(f64::from(metres))
    }

    /// Grades by the block's own nodes along some axes, whatever its figures are: the root of the squares.
    fn alone(&self, axes: &[usize]) -> Vec<Grade> {
        let mut no_limit = [1e36; FIGURES];
        no_limit[0] = 0.0;
        let mut squares = vec![Some(0.0); BLOCK_NODES * BLOCK_NODES];
        for axis in axes {
            let height = |[x, y]: [u32; 2]| Some(self.at[y as usize][x as usize][*axis]);
            let own = grades(&height, self.cells, self.full, BlockDeviation::of(no_limit));
            for (square, grade) in squares.iter_mut().zip(own.as_flattened()) {
                *square = match grade {
                    Grade::Never => *square,
                    Grade::Metres(m) => square.map(|sum: f64| sum + m * m),
                    Grade::Always => None,
                };
            }
        }
        squares.into_iter().map(|sum| sum.map_or(Grade::Always, |sum| Grade::Metres(sum.sqrt()))).collect()
    }

    /// What is wrong with the block as the GPU keeps it, in words, and how many nodes have metres.
    fn faults(&self, words: &[u32], bend_m: f64, axes: &[usize]) -> (Vec<String>, usize) {
        let (alone, bend) = (self.alone(axes), |level: u32| bend_m * 4.0_f64.powi(level.cast_signed()));
        let finest = self.figure(0).unwrap();
        let (mut out, mut measured) = (Vec::new(), 0);
        for node in block_nodes() {
            let [x, y] = node.map(|v| v as usize);
            let code = (words[3 + 5 * y + x / 4] >> (8 * (x % 4))) & 255;
            let coded = ((f64::from(words[0].cast_signed()) + f64::from(code) - 254.0) / 20.0).exp2();
            let told = |wanted: &str| format!("{node:?}: {wanted}, not {code}: {coded} m");
            if node[0] > self.cells[0] || node[1] > self.cells[1] {
                if code != 0 {
                    out.push(told("beyond the data"));
                }
                continue;
            }
            let Grade::Metres(own) = alone[y * BLOCK_NODES + x] else {
                if code != ALWAYS {
                    out.push(told("always own"));
                }
                continue;
            };
            let rank = rank(node);
            let most = self.figure(rank as usize).unwrap_or(f64::INFINITY);
            let wanted_m = (own + finest + bend(self.level)).min(most + bend(self.level + rank.div_ceil(2)));
            let fits = match code {
                0 => own + finest <= self.slack_m,
                ALWAYS => false,
                // Half a bin for roundings; the lowest code stands for all that lies under it.
                _ => {
                    coded >= wanted_m * (1.0 - 2e-3) - self.slack_m
                        && (coded <= wanted_m * (2.5_f64 / 20.0).exp2() + self.slack_m || code == 1)
                }
            };
            if !fits {
                out.push(told(&format!("{wanted_m} m ({own} of its own)")));
            }
            measured += 1;
        }
        (out, measured)
    }
}

/// Every seventh block of the windows of all charts, or every one of few; how many blocks are told to be wrong without each axis.
fn check(name: &str, terrain: &Terrain, n: u32, camera: &Camera) -> [usize; 3] {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [64, 64]).unwrap();
    let scene = Scene { cull: false, drop_fine_levels: false, ..scene(n, Some(1.0), None) };
    let mut renderer = renderer(&gpu, terrain, &scene);
    frame(&gpu, &mut renderer, &target, camera);
    let all = renderer.read_grades().unwrap();
    let (windows, bend_m) = (renderer.windows().unwrap(), bend_m(terrain));
    let (side, levels) = ((n + 1) / PATCH_CELLS, windows.shape().levels());
    let mut places = Vec::new();
    for (chart, own) in windows.charts.iter().enumerate() {
        // Finer levels are not drawn there.
        for level in own.finest..levels {
            let area = own.loaded(level);
            if !area.has_area() {
                continue;
            }
            let first = area.lo.map(|v| v.div_euclid(PATCH_CELLS.cast_signed()));
            let last = area.hi.map(|v| (v - 1).div_euclid(PATCH_CELLS.cast_signed()));
            let row = |y| (first[0]..=last[0]).map(move |x| (chart, level, [x, y]));
            places.extend((first[1]..=last[1]).flat_map(row));
        }
    }
    let (mut tried, mut nodes, mut noticed) = (0, 0, [0; 3]);
    for &(chart, level, place) in places.iter().step_by(if places.len() > 200 { 7 } else { 1 }) {
        let block = Block::of(terrain, chart, level, place);
        assert!(block.figure(1).is_some(), "{name}: nothing is void: {chart} {level} {place:?}");
        let [x, y] = place.map(|v| v.rem_euclid(side.cast_signed()).cast_unsigned());
        let lane = u32::try_from(chart).unwrap() * levels + level;
        let at = ((lane * side + y) * side + x) as usize * WORDS;
        let words = &all[at..at + WORDS];
        let (found, measured) = block.faults(words, bend_m, &AXES);
        let told = || format!("{name}, chart {chart}, level {level}, block {place:?}");
        assert!(found.is_empty(), "{}: {} faults: {}", told(), found.len(), found[0]);
        tried += 1;
        nodes += measured;
        for (axis, count) in noticed.iter_mut().enumerate() {
            let others: Vec<_> = AXES.into_iter().filter(|other| *other != axis).collect();
            *count += usize::from(!block.faults(words, bend_m, &others).0.is_empty());
        }
    }
    eprintln!("{name}: {tried} blocks, {nodes} nodes; wrong without x, y, z: {noticed:?}");
    assert!(tried > 10 && nodes > 2_000, "{name}: {tried} {nodes}");
    noticed
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn grades_on_a_globe_are_those_of_its_positions() {
    let terrain =
        Terrain::globe(vec![common::terrain("procedural:planet?size=513")], Ellipsoid::WGS84).unwrap();
    let camera = terrain.camera([45.7, 44.6, 4e5, 30.0, -40.0], 60.0);
    let noticed = check("planet", &terrain, 511, &camera);
    // All directions are up somewhere.
    assert!(noticed.iter().all(|count| *count > 0), "{noticed:?}");
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn grades_of_sampled_positions_count_every_axis() {
    let terrain = Terrain::sampled(PositionGrid::parse("overhang?size=203").unwrap());
    let noticed = check("overhang", &terrain, 127, &terrain.overview(60.0));
    // Its nodes are pushed up and east; how much they are pushed north is the recipe's matter.
    assert!(noticed[0] > 0 && noticed[2] > 0, "{noticed:?}");
}
