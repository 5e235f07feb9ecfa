//! What geomipmaps and chunks share: grids of vertices in slots of pooled buffers, of which the least
//! recently used one is given up (Brodersen 2005, section 5), and index sets in one growing buffer.

use rayon::prelude::*;

use super::stage::{GridVertex, Stage};
use crate::gpu::GpuError;
use crate::measure::FrameUpload;

/// Most bytes of a pool.
const POOL_BYTES: u64 = 8 << 20;
/// Frames that could have done with a pool less before one is given back.
const CALM_FRAMES: u32 = 120;
/// No slot, no key.
const NONE: u32 = u32::MAX;

/// A slot in the list from the least to the most recently used.
#[derive(Clone, Copy, Debug)]
struct Slot {
    key: u32,
    /// Last frame that used it.
    frame: u64,
    older: u32,
    newer: u32,
    listed: bool,
}

/// Which key holds which slot; no buffers.
pub(crate) struct Slots {
    pool_slots: u32,
    /// Of all pools, one after the other.
    slots: Vec<Slot>,
    slot_of: Vec<u32>,
    oldest: u32,
    newest: u32,
    frame: u64,
    /// Slots used this frame.
    used: u32,
    /// Slots of the last pool that are on their way out: in no list, without a key.
    unlisted: u32,
    /// Frames in a row that could have done with a pool less.
    calm: u32,
}

impl Slots {
    /// No slots yet, for keys below `keys`.
    pub fn new(keys: usize, pool_slots: u32) -> Self {
        Self {
            pool_slots,
            slots: Vec::new(),
            slot_of: vec![NONE; keys],
            oldest: NONE,
            newest: NONE,
            frame: 1,
            used: 0,
            unlisted: 0,
            calm: 0,
        }
    }

    /// Pools there must be.
    pub fn pools(&self) -> usize {
        self.slots.len() / self.pool_slots as usize
    }

    /// True while the key has the slot.
    pub fn holds(&self, slot: u32, key: u32) -> bool {
        self.slots.get(slot as usize).is_some_and(|s| s.key == key)
    }

    /// Ends the frame before; may give back the last pool.
    pub fn begin_frame(&mut self) {
        let capacity = self.slots.len() as u32;
        let spare = self.pools() > 1 && self.used + self.pool_slots <= capacity;
        self.calm = if spare { self.calm + 1 } else { 0 };
        if self.calm >= CALM_FRAMES {
            self.retire(capacity - self.pool_slots);
        }
        self.frame += 1;
        self.used = 0;
    }

    /// Takes unused slots of the last pool out of the list, and the pool away when none is left: what is in
    /// view is never sent again because of it.
    fn retire(&mut self, first: u32) {
        for s in first..self.slots.len() as u32 {
            let slot = self.slots[s as usize];
            if slot.listed && slot.frame != self.frame {
                self.forget(s);
                self.unlist(s);
                self.unlisted += 1;
            }
        }
        if self.unlisted == self.pool_slots {
            self.slots.truncate(first as usize);
            self.unlisted = 0;
            self.calm = 0;
        }
    }

    /// The slot of a key for this frame; true when its content must be sent.
    pub fn take(&mut self, key: u32) -> (u32, bool) {
        let held = self.slot_of[key as usize];
        let fresh = held == NONE;
        let s = if fresh { self.victim() } else { held };
        if fresh {
            self.forget(s);
            self.slots[s as usize].key = key;
            self.slot_of[key as usize] = s;
        }
        self.unlist(s);
        self.list_newest(s);
        let slot = &mut self.slots[s as usize];
        if slot.frame != self.frame {
            slot.frame = self.frame;
            self.used += 1;
        }
        (s, fresh)
    }

    /// The least recently used slot, one of a new pool when this frame uses them all.
    fn victim(&mut self) -> u32 {
        if self.oldest == NONE || self.slots[self.oldest as usize].frame == self.frame {
            self.grow();
        }
        self.oldest
    }

    fn grow(&mut self) {
        if self.unlisted == 0 {
            let empty = Slot { key: NONE, frame: 0, older: NONE, newer: NONE, listed: false };
            self.slots.resize(self.slots.len() + self.pool_slots as usize, empty);
        }
        let end = self.slots.len() as u32;
        // From the back, so that slots taken one after the other lie side by side and are sent in one piece.
        for s in (end - self.pool_slots..end).rev() {
            if !self.slots[s as usize].listed {
                self.list_oldest(s);
            }
        }
        self.unlisted = 0;
        self.calm = 0;
    }

    fn forget(&mut self, s: u32) {
        let key = std::mem::replace(&mut self.slots[s as usize].key, NONE);
        if key != NONE {
            self.slot_of[key as usize] = NONE;
        }
    }

    fn unlist(&mut self, s: u32) {
        let Slot { older, newer, .. } = self.slots[s as usize];
        match older {
            NONE => self.oldest = newer,
            _ => self.slots[older as usize].newer = newer,
        }
        match newer {
            NONE => self.newest = older,
            _ => self.slots[newer as usize].older = older,
        }
        self.slots[s as usize].listed = false;
    }

    fn list_newest(&mut self, s: u32) {
        let older = self.newest;
        match older {
            NONE => self.oldest = s,
            _ => self.slots[older as usize].newer = s,
        }
        self.newest = s;
        self.link(s, older, NONE);
    }

    fn list_oldest(&mut self, s: u32) {
        let newer = self.oldest;
        match newer {
            NONE => self.newest = s,
            _ => self.slots[newer as usize].older = s,
        }
        self.oldest = s;
        self.link(s, NONE, newer);
    }

    fn link(&mut self, s: u32, older: u32, newer: u32) {
        let slot = &mut self.slots[s as usize];
        (slot.older, slot.newer, slot.listed) = (older, newer, true);
    }

    fn cpu_bytes(&self) -> u64 {
        (size_of_val(&self.slots[..]) + size_of_val(&self.slot_of[..])) as u64
    }
}

/// Slots with their buffers. Pools are never copied: growing adds one.
pub(crate) struct VertexSlots {
    /// Vertices, `GridDraw::pool` counts them.
    pub pools: Vec<wgpu::Buffer>,
    slots: Slots,
    slot_vertices: u32,
    /// Slot and key of what is to be sent.
    fresh: Vec<[u32; 2]>,
}

impl VertexSlots {
    /// No pools yet; keys are below `keys`.
    pub fn new(keys: usize, slot_vertices: u32) -> Self {
        let slot_bytes = u64::from(slot_vertices) * size_of::<GridVertex>() as u64;
        let pool_slots = (POOL_BYTES / slot_bytes.max(1)).clamp(16, 1_024).min(keys.max(1) as u64) as u32;
        Self { pools: Vec::new(), slots: Slots::new(keys, pool_slots), slot_vertices, fresh: Vec::new() }
    }

    /// Call once a frame, before any `take`.
    pub fn begin_frame(&mut self) {
        self.slots.begin_frame();
        self.pools.truncate(self.slots.pools());
    }

    /// Pool and first vertex of a key this frame.
    pub fn take(&mut self, key: u32) -> (usize, u32) {
        let (slot, fresh) = self.slots.take(key);
        if fresh {
            self.fresh.push([slot, key]);
        }
        let pool_slots = self.slots.pool_slots;
        ((slot / pool_slots) as usize, slot % pool_slots * self.slot_vertices)
    }

    /// Sends what has no content yet; `fill` makes the vertices of a key.
    ///
    /// # Errors
    /// When a pool is more than the device allows.
    pub fn upload(
        &mut self,
        stage: &Stage,
        ledger: &mut FrameUpload,
        fill: impl Fn(u32, &mut [GridVertex]) + Sync,
    ) -> Result<(), GpuError> {
        let pool_slots = self.slots.pool_slots;
        let slot_bytes = u64::from(self.slot_vertices) * size_of::<GridVertex>() as u64;
        while self.pools.len() < self.slots.pools() {
            let bytes = u64::from(pool_slots) * slot_bytes;
            self.pools.push(stage.buffer("vertex slots", bytes, wgpu::BufferUsages::VERTEX)?);
        }
        let slots = &self.slots;
        // A frame that failed leaves some behind, and their slots may have gone to others since.
        self.fresh.retain(|[slot, key]| slots.holds(*slot, *key));
        self.fresh.sort_unstable();
        self.fresh.dedup();
        let slot_vertices = self.slot_vertices as usize;
        // Neighbours in a pool go in one piece: each write costs more than its bytes.
        for run in self.fresh.chunk_by(|a, b| b[0] == a[0] + 1 && b[0] % pool_slots != 0) {
            let mut vertices = vec![GridVertex::default(); run.len() * slot_vertices];
            vertices.par_chunks_mut(slot_vertices).zip(run).for_each(|(to, [_, key])| fill(*key, to));
            let first = run[0][0];
            let pool = &self.pools[(first / pool_slots) as usize];
            let at = u64::from(first % pool_slots) * slot_bytes;
            stage.queue.write_buffer(pool, at, bytemuck::cast_slice(&vertices));
            ledger.vertices += vertices.len() as u64;
            ledger.vertex_bytes += size_of_val(&vertices[..]) as u64;
        }
        self.fresh.clear();
        Ok(())
    }

    /// Bytes of all pools.
    pub fn gpu_bytes(&self) -> u64 {
        self.pools.iter().map(wgpu::Buffer::size).sum()
    }

    /// Bytes of the bookkeeping.
    pub fn cpu_bytes(&self) -> u64 {
        self.slots.cpu_bytes()
    }
}

/// Index sets by number, made when first asked for, all in one buffer.
pub(crate) struct IndexSets {
    /// First index and count; none yet where the count is 0.
    ranges: Vec<[u32; 2]>,
    numbers: Vec<u16>,
    /// Of the numbers.
    sent: usize,
    buffer: Option<wgpu::Buffer>,
}

impl IndexSets {
    /// Room for `count` sets.
    pub fn new(count: usize) -> Self {
        Self { ranges: vec![[0; 2]; count], numbers: Vec::new(), sent: 0, buffer: None }
    }

    /// First index and count of a set.
    pub fn range(&mut self, set: usize, make: impl FnOnce() -> Vec<u16>) -> [u32; 2] {
        if self.ranges[set][1] == 0 {
            let made = make();
            self.ranges[set] = [self.numbers.len() as u32, made.len() as u32];
            self.numbers.extend(made);
            // Writes begin and end at multiples of four bytes.
            if self.numbers.len() % 2 == 1 {
                self.numbers.push(0);
            }
        }
        self.ranges[set]
    }

    /// Sends what is new; its bytes belong in the ledger.
    ///
    /// # Errors
    /// When all sets are more than the device allows.
    pub fn upload(&mut self, stage: &Stage) -> Result<u64, GpuError> {
        let bytes = size_of_val(&self.numbers[..]) as u64;
        if self.buffer.as_ref().is_none_or(|b| b.size() < bytes) {
            let room = bytes.max(2 * self.gpu_bytes());
            self.buffer = Some(stage.buffer("index sets", room, wgpu::BufferUsages::INDEX)?);
            self.sent = 0;
        }
        let new = &self.numbers[self.sent..];
        if let (Some(buffer), false) = (&self.buffer, new.is_empty()) {
            let at = (self.sent * size_of::<u16>()) as u64;
            stage.queue.write_buffer(buffer, at, bytemuck::cast_slice(new));
        }
        let bytes = size_of_val(new) as u64;
        self.sent = self.numbers.len();
        Ok(bytes)
    }

    /// The buffer; there is one after the first upload.
    pub fn buffer(&self) -> Option<&wgpu::Buffer> {
        self.buffer.as_ref()
    }

    /// Bytes of the buffer.
    pub fn gpu_bytes(&self) -> u64 {
        self.buffer.as_ref().map_or(0, wgpu::Buffer::size)
    }

    /// Bytes of the tables.
    pub fn cpu_bytes(&self) -> u64 {
        (size_of_val(&self.ranges[..]) + size_of_val(&self.numbers[..])) as u64
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    #[test]
    fn no_slot_serves_two_keys_in_one_frame() {
        let mut slots = Slots::new(400, 16);
        let mut content: HashMap<u32, u32> = HashMap::new();
        let mut state = 1_u32;
        for frame in 0..600_u32 {
            slots.begin_frame();
            let mut taken: HashMap<u32, u32> = HashMap::new();
            // Busy and quiet times take turns, so that pools come and go.
            let wanted = if frame / 150 % 2 == 0 { 100 } else { 5 };
            for _ in 0..wanted {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let key = (state >> 16) % 400;
                let (slot, fresh) = slots.take(key);
                assert!((slot as usize) < slots.pools() * 16);
                if fresh {
                    content.insert(slot, key);
                }
                assert_eq!(content[&slot], key, "frame {frame}: the slot's content is another's");
                assert_eq!(*taken.entry(slot).or_insert(key), key, "frame {frame}: used twice");
            }
        }
    }

    #[test]
    fn the_least_recently_used_slot_is_given_up() {
        let mut slots = Slots::new(100, 4);
        slots.begin_frame();
        let first: Vec<u32> = (0..4).map(|k| slots.take(k).0).collect();
        assert_eq!(first, [0, 1, 2, 3]);
        slots.begin_frame();
        slots.take(0);
        slots.take(2);
        slots.begin_frame();
        assert_eq!(slots.take(50), (1, true));
        assert_eq!(slots.take(51), (3, true));
        assert_eq!(slots.take(0), (0, false));
        assert_eq!(slots.take(1), (2, true));
        // All four are used: a pool more rather than one of them twice.
        assert_eq!(slots.take(2), (4, true));
        assert_eq!(slots.pools(), 2);
    }

    #[test]
    fn pools_go_one_by_one_and_what_is_in_view_stays() {
        let mut slots = Slots::new(100, 4);
        slots.begin_frame();
        for key in 0..16 {
            slots.take(key);
        }
        assert_eq!(slots.pools(), 4);
        let mut counts = vec![slots.pools()];
        for _ in 0..1_000 {
            slots.begin_frame();
            assert!(!slots.take(0).1 && !slots.take(1).1);
            assert!(counts[counts.len() - 1] - slots.pools() <= 1);
            counts.push(slots.pools());
        }
        assert_eq!(slots.pools(), 1);
        // One that shows something in the last pool stays.
        let mut slots = Slots::new(100, 4);
        slots.begin_frame();
        for key in 0..8 {
            slots.take(key);
        }
        for _ in 0..300 {
            slots.begin_frame();
            assert_eq!(slots.take(7), (7, false));
        }
        assert_eq!(slots.pools(), 2);
        // And takes back its other slots when they are needed.
        for key in 20..27 {
            slots.take(key);
        }
        assert_eq!(slots.pools(), 2);
    }

    #[test]
    fn index_sets_are_made_once_and_begin_at_even_places() {
        let mut sets = IndexSets::new(2);
        assert_eq!(sets.range(1, || vec![0, 1, 2]), [0, 3]);
        assert_eq!(sets.range(0, || vec![2, 1, 3]), [4, 3]);
        assert_eq!(sets.range(1, || unreachable!()), [0, 3]);
    }
}
