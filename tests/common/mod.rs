//! What the tests share.
#![allow(dead_code, reason = "each test file uses its own part")]

pub mod stores;

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

/// A file of the shared data; says so and gives `None` where it is absent.
pub fn data(name: &str) -> Option<String> {
    let folder = std::env::var_os("TESSCLIP_DATA").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        std::path::PathBuf::from,
    );
    let path = folder.join(name);
    if !path.is_file() {
        eprintln!("SKIPPED: {} is absent", path.display());
        return None;
    }
    Some(path.to_string_lossy().into_owned())
}
