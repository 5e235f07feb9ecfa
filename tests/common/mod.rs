//! What the tests share.
#![allow(dead_code, reason = "each test file uses its own part")]

use tessclip::gpu::{Gpu, no_gpu_allowed};
use tessclip::heights::{HeightGrid, ReadOptions, open_terrain};

/// The GPU, with its adapter printed. `None` only where TESSCLIP_NO_GPU=1 allows it.
pub fn gpu() -> Option<Gpu> {
    if no_gpu_allowed() {
        eprintln!("IGNORED: TESSCLIP_NO_GPU=1");
        return None;
    }
    let gpu = Gpu::new().expect("an adapter: apt-get install mesa-vulkan-drivers, or set TESSCLIP_NO_GPU=1");
    eprintln!("adapter: {}", gpu.describe());
    Some(gpu)
}

/// A terrain by its specification.
pub fn terrain(spec: &str) -> HeightGrid {
    open_terrain(spec, &ReadOptions::default()).expect("a readable terrain")
}
