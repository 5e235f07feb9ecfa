// Vertices carry the level and kind of their patch.

fn tag_of(record: PatchRecord) -> u32 {
    let level = (record.shape >> 16u) & 0xffu;
    return (level << 24u) | (((record.shape >> 24u) & 3u) << 29u);
}

fn tag_at(tag: u32, level: u32, base: vec2<i32>) -> u32 {
    return tag;
}
