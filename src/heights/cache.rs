//! Values that take time to make, in bounded memory: those not held longest are given up first.

use std::collections::{BTreeMap, HashMap};
use std::ops::Deref;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Values by number, made when asked for, and once where several threads ask together.
///
/// Values that are being made or held count as well, so a thread waits when there is no room. It
/// must therefore hold no value while it asks for another.
pub(crate) struct Cache<V> {
    limit: usize,
    state: Mutex<State<V>>,
    /// Something was made, let go or given up.
    changed: Condvar,
}

struct State<V> {
    entries: HashMap<usize, Entry<V>>,
    /// The numbers of entries nobody holds, by the time they were let go.
    idle: BTreeMap<u64, usize>,
    bytes: usize,
    clock: u64,
}

struct Entry<V> {
    /// `None` while a thread makes it.
    value: Option<Arc<V>>,
    bytes: usize,
    holders: usize,
    /// Its key among the idle ones while nobody holds it.
    since: u64,
}

/// A value that stays in the cache while this exists.
pub(crate) struct Held<'a, V> {
    // Dropped first, so that the memory is free by the time the cache thinks so.
    value: Arc<V>,
    _claim: Claim<'a, V>,
}

impl<V> Deref for Held<'_, V> {
    type Target = V;

    fn deref(&self) -> &V {
        &self.value
    }
}

/// One holder of an entry; an entry without a value goes with it, also when making it panics.
struct Claim<'a, V> {
    cache: &'a Cache<V>,
    key: usize,
}

impl<V> Cache<V> {
    /// An empty cache of at most `limit` bytes, or of one larger value.
    pub(crate) fn new(limit: usize) -> Self {
        let state = State { entries: HashMap::new(), idle: BTreeMap::new(), bytes: 0, clock: 0 };
        Self { limit, state: Mutex::new(state), changed: Condvar::new() }
    }

    /// The value of a number; `make` is called where there is none, and takes at most `bytes`.
    pub(crate) fn get<E>(
        &self,
        key: usize,
        bytes: usize,
        make: impl FnOnce() -> Result<V, E>,
    ) -> Result<Held<'_, V>, E> {
        let mut state = self.lock();
        loop {
            match state.hold(key) {
                Some(Some(value)) => return Ok(Held { value, _claim: Claim { cache: self, key } }),
                None if state.make_room(bytes, self.limit) => break,
                _ => state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
            }
        }
        state.bytes += bytes;
        state.entries.insert(key, Entry { value: None, bytes, holders: 1, since: 0 });
        drop(state);
        let claim = Claim { cache: self, key };
        let value = Arc::new(make()?);
        if let Some(entry) = self.lock().entries.get_mut(&key) {
            entry.value = Some(Arc::clone(&value));
        }
        self.changed.notify_all();
        Ok(Held { value, _claim: claim })
    }

    fn lock(&self) -> MutexGuard<'_, State<V>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<V> State<V> {
    /// Holds the entry once more and gives its value; `Some(None)` while it is being made.
    fn hold(&mut self, key: usize) -> Option<Option<Arc<V>>> {
        let entry = self.entries.get_mut(&key)?;
        let value = entry.value.clone();
        if value.is_some() {
            if entry.holders == 0 {
                self.idle.remove(&entry.since);
            }
            entry.holders += 1;
        }
        Some(value)
    }

    /// Gives up idle entries until there is room for `bytes`; false while others hold too much.
    fn make_room(&mut self, bytes: usize, limit: usize) -> bool {
        while self.bytes.saturating_add(bytes) > limit {
            let Some((_, key)) = self.idle.pop_first() else {
                return self.bytes == 0;
            };
            if let Some(entry) = self.entries.remove(&key) {
                self.bytes -= entry.bytes;
            }
        }
        true
    }
}

impl<V> Drop for Claim<'_, V> {
    fn drop(&mut self) {
        let mut state = self.cache.lock();
        let State { entries, idle, bytes, clock } = &mut *state;
        if let Some(entry) = entries.get_mut(&self.key) {
            entry.holders -= 1;
            if entry.value.is_none() {
                *bytes -= entry.bytes;
                entries.remove(&self.key);
            } else if entry.holders == 0 {
                *clock += 1;
                entry.since = *clock;
                idle.insert(*clock, self.key);
            }
        }
        drop(state);
        self.cache.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::Cache;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn the_longest_idle_goes_first_and_failures_leave_nothing() {
        let cache = Cache::new(10);
        let made = AtomicUsize::new(0);
        let get = |key: usize| {
            let made = || {
                made.fetch_add(1, Ordering::Relaxed);
                Ok::<_, ()>(key)
            };
            *cache.get(key, 5, made).unwrap()
        };
        assert_eq!([get(1), get(2), get(1), get(3), get(1)], [1, 2, 1, 3, 1]);
        assert_eq!(made.load(Ordering::Relaxed), 3);
        assert_eq!(get(2), 2);
        assert_eq!(made.load(Ordering::Relaxed), 4);
        assert!(cache.get(7, 5, || Err(())).is_err());
        assert!(cache.get(7, 50, || Err(())).is_err());
        assert_eq!(*cache.get(7, 50, || Ok::<_, ()>(70)).unwrap(), 70);
    }

    #[test]
    fn threads_that_ask_together_make_once() {
        let cache = Cache::new(64);
        let made = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for thread in 0..4 {
                let (cache, made) = (&cache, &made);
                scope.spawn(move || {
                    for i in 0..200 {
                        let key = (i + thread) % 4;
                        let make = || {
                            made.fetch_add(1, Ordering::Relaxed);
                            Ok::<_, ()>(key * 10)
                        };
                        assert_eq!(*cache.get(key, 16, make).unwrap(), key * 10);
                    }
                });
            }
        });
        assert_eq!(made.load(Ordering::Relaxed), 4);
    }
}
