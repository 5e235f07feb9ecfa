//! The tile cache: slots with generations under one short lock.
//!
//! A slot belongs to one tile at a time. Whoever loads for it holds a ticket with the slot's generation; when
//! the slot is given to another tile, its generation moves on and the ticket is worth nothing: a late load can
//! never land in a slot that was reused. Bytes are reserved before anything is decoded, so the bound on decoded
//! tiles holds at every moment, those in flight included; what a loader needs besides while it decodes (the
//! encoded bytes and copies of one tile) is not in it.
//!
//! Tiles that a frame has found ready are pinned until the wishes of the next one: what it goes on to read is
//! still there.

use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::account::{Account, Reservation};
use super::wishes::Wish;
use crate::pyramid::StreamCounters;
use crate::pyramid::store::{Samples, TileKey};

/// A tile in memory.
#[derive(Debug)]
pub(crate) struct Loaded {
    pub samples: Samples,
    _bytes: Reservation,
}

/// The right to fill one slot once.
#[derive(Debug)]
pub(crate) struct Ticket {
    pub key: TileKey,
    slot: usize,
    generation: u64,
    bytes: Reservation,
}

#[derive(Debug)]
enum Content {
    Free,
    Loading,
    Ready(Arc<Loaded>),
}

#[derive(Debug)]
struct Slot {
    generation: u64,
    content: Content,
    /// Number of the wish list that last asked for it.
    used: u64,
    /// Number of the wish list under which a frame found it ready.
    pinned: u64,
}

#[derive(Debug, Default)]
struct State {
    slots: Vec<Slot>,
    free: Vec<usize>,
    by_key: HashMap<TileKey, usize>,
    /// Tiles being loaded.
    loading: HashSet<TileKey>,
    /// Tiles whose parent stood in for them.
    damaged: HashSet<TileKey>,
    queue: VecDeque<TileKey>,
    /// Place of each wanted tile in the list; smaller is more urgent.
    wanted: HashMap<TileKey, (usize, bool)>,
    /// Tiles whose reading failed in a way that may pass: when to try again, and how often it failed.
    later: HashMap<TileKey, (Instant, u32)>,
    clock: u64,
    counters: StreamCounters,
    closed: bool,
}

/// Decoded tiles, bounded in bytes.
#[derive(Debug)]
pub(crate) struct TileCache {
    state: Mutex<State>,
    /// Rung when there is something to load, or room for it.
    bell: Condvar,
    account: Arc<Account>,
    tile_bytes: u64,
}

impl TileCache {
    /// Room for `limit_bytes`, at least one tile of `tile_bytes`.
    pub(crate) fn new(limit_bytes: u64, tile_bytes: u64) -> Self {
        let account = Account::new(limit_bytes.max(tile_bytes));
        Self { state: Mutex::default(), bell: Condvar::new(), account, tile_bytes }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Tiles that fit.
    pub(crate) fn capacity(&self) -> usize {
        usize::try_from(self.account.limit() / self.tile_bytes).unwrap_or(usize::MAX)
    }

    /// What happened so far.
    pub(crate) fn counters(&self) -> StreamCounters {
        StreamCounters {
            resident_bytes: self.account.used(),
            resident_bytes_max: self.account.most(),
            limit_bytes: self.account.limit(),
            ..self.lock().counters
        }
    }

    /// A tile, if it is there.
    pub(crate) fn get(&self, key: TileKey) -> Option<Arc<Loaded>> {
        let state = self.lock();
        match &state.slots[*state.by_key.get(&key)?].content {
            Content::Ready(tile) => Some(tile.clone()),
            _ => None,
        }
    }

    /// True when all of these tiles are there; they then stay until the next wishes.
    pub(crate) fn has_all(&self, keys: impl IntoIterator<Item = TileKey>) -> bool {
        let mut state = self.lock();
        let state = &mut *state;
        let mut found = Vec::new();
        for key in keys {
            match state.by_key.get(&key) {
                Some(slot) if matches!(state.slots[*slot].content, Content::Ready(_)) => found.push(*slot),
                _ => return false,
            }
        }
        for slot in found {
            state.slots[slot].pinned = state.clock;
        }
        true
    }

    /// What is wanted from now on, most urgent first. Requests nobody repeats are dropped, loads under way
    /// for them lose their slots.
    pub(crate) fn wish(&self, wishes: &[Wish]) {
        let mut state = self.lock();
        let state = &mut *state;
        state.clock += 1;
        let before = std::mem::take(&mut state.wanted);
        let queued = std::mem::take(&mut state.queue);
        for (rank, wish) in wishes.iter().enumerate() {
            state.wanted.insert(wish.key, (rank, wish.now));
            let slot = state.by_key.get(&wish.key).copied();
            let ready = slot.is_some_and(|s| matches!(state.slots[s].content, Content::Ready(_)));
            let asked_before = before.get(&wish.key).is_some_and(|(_, now)| *now);
            if wish.now && !asked_before {
                *(if ready { &mut state.counters.cache_hits } else { &mut state.counters.cache_misses }) += 1;
            }
            match slot {
                Some(slot) => state.slots[slot].used = state.clock,
                None => state.queue.push_back(wish.key),
            }
        }
        state.counters.cancelled +=
            queued.iter().filter(|key| !state.wanted.contains_key(key)).count() as u64;
        let left = state.loading.iter().filter(|key| !state.wanted.contains_key(key)).copied();
        for key in left.collect::<Vec<_>>() {
            state.release(key);
            state.counters.cancelled += 1;
        }
        state.later.retain(|key, _| state.wanted.contains_key(key));
        if !state.queue.is_empty() {
            self.bell.notify_all();
        }
    }

    /// The next thing to load; waits for one. `None` when the cache is closed.
    pub(crate) fn next(&self) -> Option<Ticket> {
        let mut state = self.lock();
        loop {
            if state.closed {
                return None;
            }
            let (ticket, pause) = self.try_next(&mut state);
            if ticket.is_some() {
                return ticket;
            }
            // Room may come from a tile that the render thread is just putting down: look again soon.
            let wait = pause.unwrap_or(Duration::from_secs(3600));
            let again = self.bell.wait_timeout(state, wait).unwrap_or_else(PoisonError::into_inner);
            state = again.0;
        }
    }

    /// A ticket, or how long to wait before looking again without being rung for.
    fn try_next(&self, state: &mut State) -> (Option<Ticket>, Option<Duration>) {
        let now = Instant::now();
        let mut pause = None;
        let mut at = 0;
        while let Some(key) = state.queue.get(at).copied() {
            if let Some((when, _)) = state.later.get(&key)
                && *when > now
            {
                let left = *when - now;
                pause = Some(pause.map_or(left, |p: Duration| p.min(left)));
                at += 1;
                continue;
            }
            let rank = state.wanted.get(&key).map_or(usize::MAX, |w| w.0);
            let Some(bytes) = self.room(state, rank) else {
                return (None, Some(Duration::from_millis(2)));
            };
            state.queue.remove(at);
            let slot = state.take_slot(key);
            let generation = state.slots[slot].generation;
            return (Some(Ticket { key, slot, generation, bytes }), None);
        }
        (None, pause)
    }

    /// Bytes for one tile, at the cost of the least recently wanted tile that is less urgent.
    fn room(&self, state: &mut State, rank: usize) -> Option<Reservation> {
        loop {
            if let Some(bytes) = self.account.reserve(self.tile_bytes) {
                return Some(bytes);
            }
            let victim = state.by_key.iter().filter(|(_, slot)| {
                let slot = &state.slots[**slot];
                // A tile somebody is reading from just now would give nothing back.
                let free = matches!(&slot.content, Content::Ready(tile) if Arc::strong_count(tile) == 1);
                free && slot.pinned != state.clock
            });
            let victim = victim
                .map(|(key, slot)| {
                    let wanted = state.wanted.get(key).map_or(usize::MAX, |w| w.0);
                    (wanted, std::cmp::Reverse(state.slots[*slot].used), *key)
                })
                .max()?;
            if victim.0 <= rank {
                return None;
            }
            state.release(victim.2);
            state.counters.evicted += 1;
        }
    }

    /// True while a ticket's slot is still its own: a loader asks before it decodes.
    pub(crate) fn is_current(&self, ticket: &Ticket) -> bool {
        self.lock().holds(ticket)
    }

    /// Puts a tile into its slot. Where that was given away and nobody wants the tile, it is thrown away;
    /// where somebody wants it again, it gets another slot. Says whether it was kept.
    pub(crate) fn put(&self, ticket: Ticket, samples: Samples, damaged: bool, read: u64) -> bool {
        let mut state = self.lock();
        state.counters.tiles_read += 1;
        state.counters.bytes_read += read;
        state.later.remove(&ticket.key);
        let slot = match state.slot_for(&ticket) {
            Some(slot) => slot,
            None => {
                state.counters.stale_loads += 1;
                return false;
            }
        };
        if damaged {
            state.damaged.insert(ticket.key);
            state.counters.damaged_tiles = state.damaged.len() as u64;
        }
        state.loading.remove(&ticket.key);
        let tile = Loaded { samples, _bytes: ticket.bytes };
        state.slots[slot].content = Content::Ready(Arc::new(tile));
        true
    }

    /// A load that did not succeed but may later: after a while that doubles each time, at most 2 s. Gives
    /// the ticket back when it has failed `tries` times in a row: then something else must stand in.
    pub(crate) fn put_off(&self, ticket: Ticket, tries: u32) -> Option<Ticket> {
        let mut state = self.lock();
        state.counters.failed_reads += 1;
        let failed = state.later.get(&ticket.key).map_or(1, |(_, n)| n + 1);
        if failed >= tries {
            return Some(ticket);
        }
        let wait = Duration::from_millis(10_u64 << failed.min(8)).min(Duration::from_secs(2));
        state.later.insert(ticket.key, (Instant::now() + wait, failed));
        if state.holds(&ticket) {
            state.release(ticket.key);
            if state.wanted.contains_key(&ticket.key) {
                state.queue.push_back(ticket.key);
            }
        }
        None
    }

    /// Gives a ticket back whose slot was given away before anything was read.
    pub(crate) fn give_up(&self, ticket: Ticket) {
        self.lock().counters.stale_loads += 1;
        drop(ticket);
        self.bell.notify_one();
    }

    /// One more failed read.
    pub(crate) fn count_failure(&self) {
        self.lock().counters.failed_reads += 1;
    }

    /// Forgets all tiles and wishes; loads under way will find their slots gone.
    pub(crate) fn clear(&self) {
        let mut state = self.lock();
        let keys: Vec<TileKey> = state.by_key.keys().copied().collect();
        for key in keys {
            state.release(key);
        }
        state.queue.clear();
        state.wanted.clear();
        state.later.clear();
    }

    /// Ends all loaders.
    pub(crate) fn close(&self) {
        self.lock().closed = true;
        self.bell.notify_all();
    }

    /// True when nothing is queued and nothing is being loaded.
    pub(crate) fn is_idle(&self) -> bool {
        let state = self.lock();
        state.queue.is_empty() && state.loading.is_empty()
    }
}

impl State {
    fn take_slot(&mut self, key: TileKey) -> usize {
        let used = self.clock;
        let slot = match self.free.pop() {
            Some(slot) => {
                let old = &mut self.slots[slot];
                (old.content, old.used, old.pinned) = (Content::Loading, used, 0);
                slot
            }
            None => {
                self.slots.push(Slot { generation: 0, content: Content::Loading, used, pinned: 0 });
                self.slots.len() - 1
            }
        };
        self.by_key.insert(key, slot);
        self.loading.insert(key);
        slot
    }

    /// Where a finished load may go: its own slot, or, when that was given away and the tile is wanted again,
    /// that of the load that was begun anew (which then comes too late), or a fresh one.
    fn slot_for(&mut self, ticket: &Ticket) -> Option<usize> {
        if self.holds(ticket) {
            return Some(ticket.slot);
        }
        let key = ticket.key;
        if !self.wanted.contains_key(&key) {
            return None;
        }
        match self.by_key.get(&key).copied() {
            Some(slot) if matches!(self.slots[slot].content, Content::Loading) => {
                self.slots[slot].generation += 1;
                Some(slot)
            }
            Some(_) => None,
            None => {
                self.queue.retain(|queued| *queued != key);
                Some(self.take_slot(key))
            }
        }
    }

    /// Takes a slot from its tile: its generation moves on.
    fn release(&mut self, key: TileKey) {
        self.loading.remove(&key);
        if let Some(slot) = self.by_key.remove(&key) {
            self.slots[slot].content = Content::Free;
            self.slots[slot].generation += 1;
            self.free.push(slot);
        }
    }

    fn holds(&self, ticket: &Ticket) -> bool {
        let slot = &self.slots[ticket.slot];
        slot.generation == ticket.generation && matches!(slot.content, Content::Loading)
    }
}

#[cfg(test)]
mod tests;
