// Vertices carry the mark of their patch: what mark_patches found its error to be.

fn tag_of(record: PatchRecord) -> u32 {
    return (record.visible << 16u) & 0xff000000u;
}

fn tag_at(tag: u32, level: u32, base: vec2<i32>) -> u32 {
    return tag;
}
