// How far a block's surface lies off the full-resolution one when nodes are left out, by rank.

@group(0) @binding(18) var<storage, read> deviations: array<u32>; // five words a block

const UNKNOWN = 0x7f7f0000u; // bits of a deviation that is not known

fn deviation(block: u32, rank: u32) -> f32 {
    let word = deviations[5u * block + rank / 2u];
    let bits = select(word << 16u, word & 0xffff0000u, (rank & 1u) == 1u);
    return select(bitcast<f32>(bits), VOID, bits >= UNKNOWN);
}
