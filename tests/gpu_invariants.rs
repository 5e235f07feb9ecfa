//! The invariants of the mesh on what the GPU made. Needs an adapter.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use tessclip::measure::invariants::{Effort, check_gpu, check_twin};
use tessclip::{Prefilter, Terrain};

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn invariants_hold_on_the_gpu_for_an_odd_sized_terrain() {
    let gpu = common::gpu();
    let grid = common::terrain("procedural:mountains?width=203&height=150&spacing=30");
    for row in check_gpu(&gpu, &grid, Effort::Brief).expect("drawable") {
        eprintln!("{row:?}");
        assert!(row.pass, "{row:?}");
    }
}

#[test]
fn invariants_hold_on_the_cpu_twin() {
    let grid = common::terrain("procedural:mountains?width=203&height=150&spacing=30");
    for row in check_twin(&Terrain::new(&grid, Prefilter::Subsample), Effort::Full) {
        eprintln!("{row:?}");
        assert!(row.pass, "{row:?}");
    }
}
