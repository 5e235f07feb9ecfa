// On a plane the displaced sample is its height; the position is made of it in expand_patches.

const WORDS_PER_SAMPLE = 1u;

@group(0) @binding(3) var<storage, read_write> windows: array<f32>;

fn store_sample(level: u32, node: vec2<i32>, first: u32, k: u32) {
    windows[sample_address(level, node)] = staged_height(first, k);
}
