//! The default prefilter is the one with the smaller error against the full-resolution surface.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use tessclip::heights::HeightGrid;
use tessclip::pyramid::{MemoryPyramid, Prefilter, SampleSource};

/// Root mean square, over all base samples, of `level`'s surface (on its own triangles) minus the data.
fn rms_m(grid: &HeightGrid, prefilter: Prefilter, level: u32) -> f64 {
    let pyramid = MemoryPyramid::new(grid, prefilter);
    let cell = 1_i32 << level;
    let cells = pyramid.lattice().last.map(|v| v >> level);
    let (mut sum, mut count) = (0.0, 0_u64);
    for cy in 0..cells[1] {
        for cx in 0..cells[0] {
            let corner = |x: i32, y: i32| f64::from(pyramid.sample(level, [cx + x, cy + y]));
            let (sw, se, nw, ne) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
            for y in 0..cell {
                for x in 0..cell {
                    let (u, v) = (f64::from(x) / f64::from(cell), f64::from(y) / f64::from(cell));
                    let drawn = if u + v <= 1.0 {
                        sw + (se - sw) * u + (nw - sw) * v
                    } else {
                        ne + (nw - ne) * (1.0 - u) + (se - ne) * (1.0 - v)
                    };
                    let ix = (cy * cell + y) as usize * grid.width + (cx * cell + x) as usize;
                    sum += (drawn - f64::from(grid.heights_m[ix])).powi(2);
                    count += 1;
                }
            }
        }
    }
    (sum / count as f64).sqrt()
}

#[test]
fn the_default_prefilter_has_the_smaller_measured_error() {
    let grid = common::terrain("procedural:mountains?size=513");
    let mut total = [0.0, 0.0];
    for level in 1..=4 {
        let figures = [Prefilter::Subsample, Prefilter::LowPass].map(|p| rms_m(&grid, p, level));
        eprintln!("level {level}: subsample {:.3} m, low-pass {:.3} m rms", figures[0], figures[1]);
        total[0] += figures[0];
        total[1] += figures[1];
    }
    let better = if total[0] <= total[1] { Prefilter::Subsample } else { Prefilter::LowPass };
    assert_eq!(Prefilter::default(), better, "{total:?}");
}
