//! Modules import only what stands above them in the data flow, and pure layers never the GPU.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

use std::path::{Path, PathBuf};

/// The layers in order (design: section 5).
const LAYERS: [&str; 7] = ["heights", "surface", "pyramid", "stream", "clipmap", "quads", "reference"];

/// `pyramid` and `stream` read rectangles of a lattice, which `clipmap` defines: the one name taken from below.
const ALLOWED: [(&str, &str); 3] = [("pyramid", "clipmap"), ("stream", "clipmap"), ("clipmap", "clipmap")];

fn sources(dir: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).expect("a readable folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// What is wrong with one file of a layer, in words.
fn violations(layer: usize, text: &str) -> Vec<String> {
    let mut out = Vec::new();
    for line in text.lines().map(str::trim).filter(|l| !l.starts_with("//")) {
        if line.contains("wgpu") {
            out.push(format!("imports the GPU: {line}"));
        }
        for (other_ix, other) in LAYERS.iter().enumerate() {
            let allowed = other_ix <= layer || ALLOWED.contains(&(LAYERS[layer], other));
            if line.contains(&format!("crate::{other}")) && !allowed {
                out.push(format!("points up the flow: {line}"));
            }
        }
        for above in ["crate::gpu", "crate::renderer", "crate::scene", "crate::measure"] {
            if line.contains(above) {
                out.push(format!("points up the flow: {line}"));
            }
        }
    }
    out
}

#[test]
fn arrows_point_down_only() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut seen = 0;
    for (ix, layer) in LAYERS.iter().enumerate() {
        let mut files = Vec::new();
        if src.join(layer).is_dir() {
            sources(&src.join(layer), &mut files);
        }
        for file in files {
            seen += 1;
            let text = std::fs::read_to_string(&file).expect("a readable file");
            let bad = violations(ix, &text);
            assert!(bad.is_empty(), "{}: {bad:?}", file.display());
        }
    }
    assert!(seen > 20, "the layers were not found");
}

#[test]
fn the_check_of_arrows_can_fail() {
    assert_eq!(violations(0, "use wgpu::Device;").len(), 1);
    assert_eq!(violations(0, "use crate::quads::Patch;").len(), 1);
    assert_eq!(violations(5, "use crate::gpu::Gpu;").len(), 1);
    assert!(violations(6, "use crate::quads::Patch;").is_empty());
}
