// Where things are on a curved base surface. Every sample's position is three integers, offsets from the
// anchor of its block in units of its level; anchors are integers, too. What is near the camera is thus
// subtracted exactly, whatever the distance from the world's origin; only the difference becomes f32.
// A sample is four words: the offset, and in the fourth the base's outward direction (octahedral, 2 x 10 bits)
// and the height (12 bits of the data's range), for the colours.

const VOID_POSITION = -2147483647i - 1i; // first offset of a sample that is void
const LOW_BITS = 24u;               // of an anchor; its high part counts 2^24 units
const BOX_BITS = 4u;                // bounds of blocks count 2^4 units

struct CurveLevel {
    hi: vec3<i32>,      // the frame's anchor in units of this level: high part,
    unit_m: f32,        // metres of one unit, a power of two
    lo: vec3<i32>,      // low part,
    slack_m: f32,       // how far a vertex owned by another chart or level may lie off its bounds
    rest_m: vec3<f32>,  // and what both leave of it
    terms: u32,         // of the base surface's polynomials that this level's records hold
}

struct Curve {
    levels: array<CurveLevel, 16>,
    shifted: array<vec4<u32>, 3>, // bit l of word c: the window of level l of chart c moved this frame
    horizon_scale: vec3<f32>,     // to the space where the ellipsoid that hides is the unit sphere; 0: none
    horizon: f32,                 // there, squared distance of the eye from the centre, less 1
    horizon_eye: vec3<f32>,       // eye from the centre
    chart_count: u32,
    block_shift: u32,             // log2 of the cells of a block of the base surface
    record_side: u32,             // blocks a side of a lane's toroidal table of records
    anchor_side: u32,             // the same for anchors, a power of two
    spare: u32,
}

@group(0) @binding(12) var<uniform> curve: Curve;
@group(0) @binding(14) var<storage, read> anchors: array<vec4<i32>>; // high and low parts, block after block

struct Block {
    at: vec2<i32>,
    local: vec2<i32>, // the node's place in it
}

// Block of a node. The data's last node begins a block of its own: it may stand nearer than a whole cell.
fn block_of(level: u32, node: vec2<i32>) -> Block {
    let cells = 1i << curve.block_shift;
    let last = last_node(level);
    let beyond = node >= last;
    let at = select(node >> vec2<u32>(curve.block_shift), (last + cells - 1i) >> vec2<u32>(curve.block_shift), beyond);
    return Block(at, select(node & vec2<i32>(cells - 1i), node - last, beyond));
}

// Place of a node's anchor.
fn anchor_of(level: u32, node: vec2<i32>) -> u32 {
    let side = curve.anchor_side;
    let at = vec2<u32>(block_of(level, node).at & vec2<i32>(i32(side) - 1i));
    return 2u * ((lane_of(level) * side + at.y) * side + at.x);
}

// Units from one anchor to another; the same level.
fn apart(from_anchor: u32, to_anchor: u32) -> vec3<i32> {
    let high = anchors[to_anchor].xyz - anchors[from_anchor].xyz;
    return (high << vec3<u32>(LOW_BITS)) + anchors[to_anchor + 1u].xyz - anchors[from_anchor + 1u].xyz;
}

// A block's offset as seen from another anchor, in 2^BOX_BITS units: blocks may lie further apart than units reach,
// but not further than these.
fn coarse_offset(from_anchor: u32, own_anchor: u32, offset: vec3<i32>) -> vec3<i32> {
    let at = offset >> vec3<u32>(BOX_BITS);
    if own_anchor == from_anchor {
        return at;
    }
    let far = (anchors[own_anchor].xyz - anchors[from_anchor].xyz) << vec3<u32>(LOW_BITS - BOX_BITS);
    return at + far + ((anchors[own_anchor + 1u].xyz - anchors[from_anchor + 1u].xyz) >> vec3<u32>(BOX_BITS));
}

// Offset from a block's anchor -> metres from the frame's anchor. Split before anything is added: offsets
// take all bits.
fn placed(level: u32, anchor: u32, offset: vec3<i32>) -> vec3<f32> {
    let mask = vec3<i32>((1i << LOW_BITS) - 1i);
    return from_parts(level, anchor, offset >> vec3<u32>(LOW_BITS), offset & mask);
}

// The same for a corner of a block's bounds, which count coarser units.
fn placed_box(level: u32, anchor: u32, corner: vec3<i32>) -> vec3<f32> {
    let mask = vec3<i32>((1i << (LOW_BITS - BOX_BITS)) - 1i);
    return from_parts(level, anchor, corner >> vec3<u32>(LOW_BITS - BOX_BITS), (corner & mask) << vec3<u32>(BOX_BITS));
}

fn from_parts(level: u32, anchor: u32, offset_hi: vec3<i32>, offset_lo: vec3<i32>) -> vec3<f32> {
    let at = units_of(level);
    let low = anchors[anchor + 1u].xyz - at.lo + offset_lo;
    let high = anchors[anchor].xyz - at.hi + offset_hi + (low >> vec3<u32>(LOW_BITS));
    let part = low & vec3<i32>((1i << LOW_BITS) - 1i);
    // Both terms are exact; their sum is rounded once.
    let metres = vec3<f32>(high) * (at.unit_m * 16777216.0) + vec3<f32>(part) * at.unit_m;
    return metres + at.rest_m;
}

// Octahedral coordinates of a unit vector, each -1 to 1 (Cigolle et al. 2014, section 3.3).
fn octahedral(n: vec3<f32>) -> vec2<f32> {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = (1.0 - abs(p.yx)) * select(vec2<f32>(-1.0), vec2<f32>(1.0), p >= vec2<f32>(0.0));
    return select(folded, p, n.z >= 0.0);
}

fn from_octahedral(p: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - abs(p.x) - abs(p.y);
    let folded = (1.0 - abs(p.yx)) * select(vec2<f32>(-1.0), vec2<f32>(1.0), p >= vec2<f32>(0.0));
    return normalize(vec3<f32>(select(folded, p, z >= 0.0), z));
}
