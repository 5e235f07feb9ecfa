// Where a patch's vertices and indices stand: before its nodes, with all of its record that the expansion needs,
// because one binding more would be more than default WebGPU grants a stage.

@group(0) @binding(24) var<storage, read_write> leaves: array<u32>;

// set_factors counted them and left them where their places will stand.
fn needs_of(record: PatchRecord) -> vec2<u32> {
    return vec2<u32>(record.first_vertex, record.first_index);
}

fn put_places(slot: u32, first_vertex: u32, first_index: u32, fits: bool) {
    let record = patches[slot];
    let at = slot * NODE_WORDS;
    leaves[at] = bitcast<u32>(record.cell.x);
    leaves[at + 1u] = bitcast<u32>(record.cell.y);
    leaves[at + 2u] = record.shape;
    leaves[at + 3u] = select(0u, record.visible, fits);
    leaves[at + 4u] = first_vertex;
    leaves[at + 5u] = first_index;
    leaves[at + 6u] = record.first_vertex;
    leaves[at + 7u] = record.first_index;
    patches[slot].first_vertex = first_vertex;
    patches[slot].first_index = first_index;
}
