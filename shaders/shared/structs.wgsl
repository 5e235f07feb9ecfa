// Structures shared by all passes. Rust's side is src/gpu/layouts.rs; tests/shaders.rs compares every
// member's name, offset and size.

const MAX_LEVELS = 16u;      // length of Frame.levels
const CONTROL_POINTS = 44u;  // per level
const QUADS_PER_LEVEL = 20u; // per level
const PATCH_CELLS = 16;      // cells per side of a patch
const VOID = 3.40282347e38;  // stands for a void sample: finite, and no height

// Kinds of blocks, as in src/quads/control.rs.
const KIND_L = 2u;
const KIND_FILL = 3u;

struct Frame {
    clip_from_near: mat4x4<f32>,   // of positions less eye_from_anchor_m; reverse depth, far plane at infinity
    planes: array<vec4<f32>, 5>,   // inward normals in anchor space, metres
    eye_from_anchor_m: vec3<f32>,
    fog_per_m: f32,
    sun_direction: vec3<f32>,      // towards the sun, unit
    ambient: f32,                  // 0..1
    fog_color: vec3<f32>,          // linear
    anchor_height_m: f32,
    height_range_m: vec2<f32>,     // lowest and highest of the data
    sample_step_m: f32,            // metres a unit of samples sent as two bytes
    sea_level: f32,                // height 0 in the data's range from 0 to 1, on globes with seas; else 0
    spacing_m: vec2<f32>,          // between base samples
    eye_samples: vec2<f32>,        // camera minus anchor, in base samples
    anchor: vec2<i32>,             // base sample that positions are relative to
    last: vec2<i32>,               // index of the last base sample
    level_count: u32,
    finest: u32,                   // finest level drawn
    n: u32,                        // samples per side of a window
    slots_per_level: u32,          // patch slots
    window_cells: u32,             // cells a side of a window, n - 1 or what whole blocks leave of it
    vertex_capacity: u32,
    index_capacity: u32,
    shifted_levels: u32,           // bit l: the window of level l moved this frame
    origins: array<vec4<i32>, 16>, // xy: low corner of each level's window in its own lattice; z: bits of an f32, the coarser surface's share
}

// What never changes of a control quad; its corners stand in a buffer of their own, because the L's are
// all that a shift rewrites.
struct ControlQuad {
    kind: u32,        // 0 M, 1 R, 2 L, 3 fill
    first_patch: u32, // first of its patch slots in the level
    patches_east: u32,
}

// Metres from the anchor; lo > hi when empty.
struct Box {
    lo: vec3<f32>,
    hi: vec3<f32>,
}

fn joined(a: Box, b: Box) -> Box {
    return Box(min(a.lo, b.lo), max(a.hi, b.hi));
}

// Who owns a vertex, once its chart is the current one.
struct Owner {
    level: u32,
    base: vec2<i32>,
}

struct PatchRecord {
    cell: vec2<i32>,   // low corner in the level's lattice
    shape: u32,        // cells east | cells north << 8 | level << 16 | kind << 24 | chart << 28
    outer_sn: u32,     // south span | north span << 16; span: from (5 bits) to (5 bits) log2 (4 bits)
    outer_we: u32,     // west span | east span << 16
    first_vertex: u32,
    first_index: u32,
    visible: u32,      // 1 when seen; bits 8 to 15: its mark, where the colouring asks for one
}

// A vertex that a divided side adds to a patch's grid: its side, its cell along it and its place among the
// cell's, from 1.
struct Extra {
    side: u32,
    cell: u32,
    t: u32,
}

struct Counters {
    // Arguments of draw_indexed_indirect.
    index_count: u32,
    instance_count: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
    // Arguments of draw_indirect, used by the wireframe.
    wire_vertex_count: u32,
    wire_instance_count: u32,
    wire_first_vertex: u32,
    wire_first_instance: u32,
    // Arguments of dispatch_workgroups_indirect: one workgroup a patch.
    expand_x: u32,
    expand_y: u32,
    expand_z: u32,
    // What the frame needed; may exceed the capacities, then patches were dropped.
    vertices_needed: u32,
    indices_needed: u32,
    patches_visible: u32,
    patches_dropped: u32,
    threshold_px: f32, // screen-space error that factors went by; 0 where they are uniform
}

struct Vertex {
    x: f32, // metres from the anchor along the world's axes: on a plane east,
    y: f32, // north,
    z: f32, // and up
    packed: u32, // octahedral normal 2 x 12 bits | level << 24 | kind << 29, or | mark << 24
}

@group(0) @binding(0) var<uniform> frame: Frame;
