//! Grades of nodes as they lie on the GPU against the twin's: what is left out by them is bounded, and not by far.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test may panic")]

mod common;
#[path = "common/made.rs"]
mod made;

use std::cell::OnceCell;
use std::collections::HashMap;

use made::{Point, cameras, frame, holed, mountains, renderer, scene, terrain, with_made_figures};
use tessclip::clipmap::Rect;
use tessclip::gpu::Offscreen;
use tessclip::heights::HeightGrid;
use tessclip::pyramid::{BlockDeviation, FIGURES, SampleSource, VOID};
use tessclip::quads::{BLOCK_NODES, PATCH_CELLS, block_nodes, full_cells, is_forced};
use tessclip::reference::{Grade, grades};
use tessclip::{Prefilter, Scene, Terrain};

/// Words the GPU keeps of a block: the bin of code 254 (20 an octave, 0 at a metre), two spare, rows of codes.
const WORDS: usize = 98;
const ALWAYS: u32 = 255;

type Grades = [[Grade; BLOCK_NODES]; BLOCK_NODES];

fn graded(samples: &[f32], cells: [u32; 2], full: [u32; 2], figures: BlockDeviation) -> Grades {
    let heights = |[x, y]: [u32; 2]| {
        let inside = x <= cells[0] && y <= cells[1];
        let height = if inside { samples[(y * (cells[0] + 1) + x) as usize] } else { VOID };
        (height != VOID).then(|| f64::from(height))
    };
    grades(&heights, cells, full, figures)
}

/// What the twin makes of a block.
struct Twin {
    grades: Grades,
    /// The same by the block's own samples alone, whatever its figures are.
    alone: OnceCell<Grades>,
    samples: Vec<f32>,
    cells: [u32; 2],
    full: [u32; 2],
    known: bool,
    /// What f32 may lose of differences of its heights, metres.
    slack_m: f64,
}

impl Twin {
    fn of(source: &dyn SampleSource, level: u32, block: Point) -> Self {
        let lattice = source.lattice();
        let last = lattice.last_at(level);
        let lo = block.map(|v| v * PATCH_CELLS.cast_signed());
        let hi = [0, 1].map(|a: usize| (lo[a] + PATCH_CELLS.cast_signed()).min(last[a]));
        let rect = Rect { lo, hi };
        let (mut samples, mut figures) = (Vec::new(), Vec::new());
        source.read(level, rect, &mut samples);
        assert!(source.read_deviations(level, Rect { lo: block, hi: block }, &mut figures));
        let cells = [0, 1].map(|a: usize| hi[a].abs_diff(lo[a]));
        let full = full_cells(lattice, level, rect);
        let valid = samples.iter().filter(|h| **h != VOID).map(|h| f64::from(h.abs()));
        let slack_m = 1e-6 * valid.fold(0.0, f64::max);
        Self {
            grades: graded(&samples, cells, full, figures[0]),
            alone: OnceCell::new(),
            samples,
            cells,
            full,
            known: figures[0] != BlockDeviation::UNKNOWN,
            slack_m,
        }
    }

    /// Metres that leaving a node out deviates by, as far as the block's own samples tell; 0 where that is no number.
    fn alone_m(&self, node: [u32; 2]) -> f64 {
        let mut no_limit = [1e36; FIGURES];
        no_limit[0] = 0.0;
        let figures = BlockDeviation::of(no_limit);
        let alone = self.alone.get_or_init(|| graded(&self.samples, self.cells, self.full, figures));
        if let Grade::Metres(m) = of_node(alone, node) { m } else { 0.0 }
    }

    /// False for nodes that are own wherever the heights lie: corners, what the data's end forces, unknown blocks.
    fn is_open(&self, node: [u32; 2]) -> bool {
        let corner = (0..2).all(|a| node[a] == 0 || node[a] == self.cells[a]);
        self.known && !corner && !is_forced(self.cells, self.full, node)
    }
}

fn of_node(rows: &Grades, [x, y]: [u32; 2]) -> Grade {
    rows[y as usize][x as usize]
}

fn place_of([x, y]: [u32; 2]) -> (usize, u32) {
    (3 + 5 * y as usize + x as usize / 4, 8 * (x % 4))
}

fn code_of(words: &[u32], node: [u32; 2]) -> u32 {
    let (word, shift) = place_of(node);
    (words[word] >> shift) & 255
}

fn metres(words: &[u32], code: u32) -> f64 {
    ((f64::from(words[0].cast_signed()) + f64::from(code) - 254.0) / 20.0).exp2()
}

/// What is wrong with a block as the GPU keeps it, node by node, in words.
fn faults(words: &[u32], twin: &Twin) -> Vec<String> {
    let mut out = Vec::new();
    for node in block_nodes() {
        let code = code_of(words, node);
        let coded = metres(words, code);
        let (fits, wanted_m) = match of_node(&twin.grades, node) {
            Grade::Never => (code == 0, 0.0),
            Grade::Always => (code == ALWAYS, f64::INFINITY),
            Grade::Metres(m) => {
                let near = coded <= (m + twin.slack_m) * (2.2_f64 / 20.0).exp2();
                let fits = match code {
                    // So little that f32 does not tell it from nothing.
                    0 => twin.alone_m(node) <= twin.slack_m,
                    ALWAYS => false,
                    // Marks are 3.5 % apart; the lowest stands for all that lies under it.
                    _ => coded >= m * (1.0 - 1e-5) - twin.slack_m && (near || code == 1),
                };
                (fits, m)
            }
        };
        if !fits {
            out.push(format!("{node:?} of {:?}: {wanted_m} m, not {code}: {coded} m", twin.cells));
        }
    }
    out
}

/// Heights that differ by more than 10^30 metres along a line that no block ends at.
fn cliff() -> Terrain {
    let mut grid = common::terrain("procedural:mountains?width=290&height=170");
    for (i, height) in grid.heights_m.iter_mut().enumerate() {
        if i % 290 > 203 {
            *height += 1e30;
        }
    }
    Terrain::new(&grid, Prefilter::Subsample)
}

/// Whole metres, as travel in two bytes, with large steps beside flat ground.
fn steps() -> Terrain {
    let heights = (0..333 * 209).map(|i| ((i % 333) / 40 * 7 + (i / 333) / 30) as f32).collect();
    Terrain::new(&HeightGrid::new(333, 209, heights).unwrap(), Prefilter::Subsample)
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn grades_on_the_gpu_bound_the_twins_and_not_by_far() {
    let gpu = common::gpu();
    let target = Offscreen::new(&gpu.device, [64, 64]).unwrap();
    for (name, terrain) in [
        ("mountains", mountains("width=400&height=333")),
        ("made figures", with_made_figures(mountains("width=145&height=610"), 3)),
        ("voids", holed()),
        ("flat", terrain("procedural:plain?width=300&height=217")),
        ("steps", steps()),
        ("cliff", cliff()),
    ] {
        let n = 127;
        let scene = Scene { drop_fine_levels: false, ..scene(n, Some(1.0), None) };
        let mut renderer = renderer(&gpu, &terrain, &scene);
        let source = terrain.source.as_ref();
        let mut twins: HashMap<(u32, Point), Twin> = HashMap::new();
        let (mut tried, mut narrow) = (0, 0);
        // Windows move there and back; a camera 10^30 m up sees nothing.
        let views: Vec<_> = cameras(&terrain).into_iter().filter(|c| c.eye_m.z.abs() < 1e6).collect();
        for camera in views.iter().chain(&views[..1]) {
            frame(&gpu, &mut renderer, &target, camera);
            let all = renderer.read_grades().unwrap();
            let windows = &renderer.placement().unwrap().windows;
            let side = (n + 1) / PATCH_CELLS;
            for level in 0..windows.shape.levels() {
                let area = windows.loaded(level);
                let first = area.lo.map(|v| v.div_euclid(PATCH_CELLS.cast_signed()));
                let last = area.hi.map(|v| (v - 1).div_euclid(PATCH_CELLS.cast_signed()));
                for block in (first[1]..=last[1]).flat_map(|y| (first[0]..=last[0]).map(move |x| [x, y])) {
                    let twin = twins.entry((level, block)).or_insert_with(|| Twin::of(source, level, block));
                    let [x, y] = block.map(|v| v.rem_euclid(side.cast_signed()).cast_unsigned());
                    let at = ((level * side + y) * side + x) as usize * WORDS;
                    let found = faults(&all[at..at + WORDS], twin);
                    let told = || format!("{name}, level {level}, block {block:?}, {camera:?}");
                    assert!(found.is_empty(), "{}: {} faults: {}", told(), found.len(), found[0]);
                    tried += 1;
                    narrow += u32::from(twin.full != twin.cells);
                }
            }
        }
        // Nothing, metres, all; and all where a block's end does not ask for it.
        let (mut counts, mut most_m) = ([0; 4], 0.0_f64);
        for (twin, node) in twins.values().flat_map(|twin| block_nodes().map(move |node| (twin, node))) {
            match of_node(&twin.grades, node) {
                Grade::Never => counts[0] += 1,
                Grade::Metres(m) => {
                    counts[1] += 1;
                    most_m = most_m.max(m);
                }
                Grade::Always => counts[if twin.is_open(node) { 3 } else { 2 }] += 1,
            }
        }
        eprintln!("{name}: {tried} blocks, {counts:?} nodes, {most_m:e} m at most");
        assert!(tried > 100 && narrow > 0 && counts[2] > 100, "{name}: {tried} {narrow} {counts:?}");
        match name {
            "flat" => assert!(counts[0] > 10_000 && counts[1] == 0, "{counts:?}"),
            "steps" => assert!(counts[0] > 10_000 && counts[1] > 1_000, "{counts:?}"),
            "voids" => assert!(counts[1] > 10_000 && counts[3] > 300, "{counts:?}"),
            "cliff" => assert!(counts[1] > 10_000 && most_m > 1e29, "{counts:?} {most_m}"),
            _ => assert!(counts[1] > 10_000, "{counts:?}"),
        }
    }
}

/// A block as the GPU should keep it.
fn coded(twin: &Twin) -> [u32; WORDS] {
    let bin = |m: f64| (20.0 * m.log2()).ceil() as i32;
    let all_metres = block_nodes().filter_map(|node| match of_node(&twin.grades, node) {
        Grade::Metres(m) => Some(bin(m)),
        _ => None,
    });
    let top = all_metres.max().unwrap_or(0);
    let mut words = [0; WORDS];
    words[0] = top.cast_unsigned();
    for node in block_nodes() {
        let code = match of_node(&twin.grades, node) {
            Grade::Never => 0,
            Grade::Always => ALWAYS,
            Grade::Metres(m) => (254 + bin(m) - top).max(1).cast_unsigned(),
        };
        let (word, shift) = place_of(node);
        words[word] |= code << shift;
    }
    words
}

#[test]
fn a_wrong_grade_is_noticed() {
    let terrain = mountains("width=400&height=333");
    let mut broken = 0;
    for (level, block) in [(0, [3, 4]), (0, [24, 20]), (1, [12, 10]), (2, [6, 2]), (3, [0, 0])] {
        let twin = Twin::of(terrain.source.as_ref(), level, block);
        let good = coded(&twin);
        assert!(faults(&good, &twin).is_empty(), "{:?}", faults(&good, &twin));
        for node in block_nodes() {
            let code = code_of(&good, node);
            let others = match of_node(&twin.grades, node) {
                Grade::Never => vec![1, 254, ALWAYS],
                Grade::Always => vec![0, 1, 254],
                // What is no more than rounding has no bound beneath it.
                Grade::Metres(m) if m.min(twin.alone_m(node)) < 100.0 * twin.slack_m => continue,
                Grade::Metres(_) if !(8..=250).contains(&code) => continue,
                Grade::Metres(_) => vec![0, code - 4, code + 4, ALWAYS],
            };
            for other in others {
                let (mut bad, (word, shift)) = (good, place_of(node));
                bad[word] = (good[word] & !(255 << shift)) | (other << shift);
                assert_eq!(
                    faults(&bad, &twin).len(),
                    1,
                    "level {level}, {block:?}, {node:?}: {code}, {other}"
                );
                broken += 1;
            }
        }
        for off in [-4, 4] {
            let mut bad = good;
            bad[0] = good[0].wrapping_add_signed(off);
            assert!(faults(&bad, &twin).len() > 10, "{block:?}, {off}");
        }
    }
    assert!(broken > 1_000, "{broken}");
}
