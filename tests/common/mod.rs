//! What the tests share.
#![allow(dead_code, reason = "each test file uses its own part")]

use tessclip::gpu::Gpu;
use tessclip::heights::{HeightGrid, ReadOptions, open_terrain};

/// The GPU, with its adapter printed. Tests that call it carry `cfg_attr(tessclip_no_gpu, ignore)`.
pub fn gpu() -> Gpu {
    let gpu = Gpu::new().expect("an adapter: apt-get install mesa-vulkan-drivers, or set TESSCLIP_NO_GPU=1");
    eprintln!("adapter: {}", gpu.describe());
    gpu
}

/// A terrain by its specification.
pub fn terrain(spec: &str) -> HeightGrid {
    open_terrain(spec, &ReadOptions::default()).expect("a readable terrain")
}
