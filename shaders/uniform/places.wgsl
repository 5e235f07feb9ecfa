// Where a patch's vertices and indices stand: in its record.

fn put_places(slot: u32, first_vertex: u32, first_index: u32, fits: bool) {
    patches[slot].first_vertex = first_vertex;
    patches[slot].first_index = first_index;
}
