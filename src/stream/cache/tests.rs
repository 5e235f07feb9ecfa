//! Slots, generations, pins and bytes, one loader at a time.

use super::*;

fn key(column: u32) -> TileKey {
    TileKey { level: 0, column, row: 0 }
}

fn wish(column: u32) -> Wish {
    Wish { key: key(column), now: true }
}

/// A ticket without waiting for one.
fn at_once(cache: &TileCache) -> Option<Ticket> {
    let mut state = cache.lock();
    cache.try_next(&mut state).0
}

fn tile() -> Samples {
    Samples::Int16(vec![7; 4])
}

#[test]
fn a_late_load_cannot_land_in_a_reused_slot() {
    let cache = TileCache::new(200, 100);
    cache.wish(&[wish(1)]);
    let late = cache.next().unwrap();
    // Nobody wants it any more; another tile takes the slot.
    cache.wish(&[wish(2)]);
    let other = cache.next().unwrap();
    assert_eq!(late.slot, other.slot, "the slot was reused");
    assert_ne!(late.generation, other.generation);
    assert!(!cache.is_current(&late));
    assert!(cache.put(other, tile(), false, 0));
    assert!(!cache.put(late, Samples::Int16(vec![9; 4]), false, 0));
    assert_eq!(cache.get(key(2)).unwrap().samples, tile());
    assert!(cache.get(key(1)).is_none());
    assert_eq!(cache.counters().stale_loads, 1);
    assert_eq!(cache.counters().cancelled, 1);
}

#[test]
fn a_load_that_is_wanted_again_is_kept_and_its_double_comes_too_late() {
    let cache = TileCache::new(400, 100);
    cache.wish(&[wish(1)]);
    let first = cache.next().unwrap();
    cache.wish(&[wish(2)]);
    cache.wish(&[wish(1)]);
    let again = cache.next().unwrap();
    assert_eq!((first.key, again.key), (key(1), key(1)));
    assert!(cache.put(first, tile(), false, 0));
    assert!(!cache.put(again, Samples::Int16(vec![9; 4]), false, 0));
    assert_eq!(cache.get(key(1)).unwrap().samples, tile());
    // And without a double.
    cache.wish(&[wish(3)]);
    let only = cache.next().unwrap();
    cache.wish(&[wish(1)]);
    cache.wish(&[wish(3)]);
    assert!(cache.put(only, tile(), false, 0));
    assert!(cache.get(key(3)).is_some() && cache.is_idle());
}

#[test]
fn what_a_frame_found_ready_stays_until_the_next_wishes() {
    let cache = TileCache::new(100, 100);
    cache.wish(&[wish(1)]);
    let ticket = cache.next().unwrap();
    cache.put(ticket, tile(), false, 0);
    cache.wish(&[wish(2)]);
    assert!(cache.has_all([key(1)]), "no longer wanted, but still there");
    assert!(at_once(&cache).is_none(), "and not to be driven out now");
    cache.wish(&[wish(2)]);
    assert!(at_once(&cache).is_some());
}

#[test]
fn a_read_that_keeps_failing_gives_its_ticket_back_in_the_end() {
    let cache = TileCache::new(100, 100);
    cache.wish(&[wish(1)]);
    for tried in 1..=3 {
        let ticket = cache.next().unwrap();
        let back = cache.put_off(ticket, 3);
        assert_eq!(back.is_some(), tried == 3);
        if let Some(ticket) = back {
            assert!(cache.put(ticket, tile(), true, 0));
        }
    }
    assert!(cache.get(key(1)).is_some());
    assert_eq!((cache.counters().damaged_tiles, cache.counters().failed_reads), (1, 3));
}

#[test]
fn bytes_never_pass_the_limit_and_the_least_urgent_goes_first() {
    let cache = TileCache::new(250, 100);
    assert_eq!(cache.capacity(), 2);
    for k in 0..50 {
        cache.wish(&[wish(k), wish(k + 1)]);
        while let Some(ticket) = at_once(&cache) {
            cache.put(ticket, tile(), false, 1);
            assert!(cache.counters().resident_bytes <= 200);
        }
        assert!(cache.get(key(k)).is_some() && cache.get(key(k + 1)).is_some());
    }
    let c = cache.counters();
    assert_eq!((c.resident_bytes_max, c.evicted, c.tiles_read), (200, 49, 51));
    assert_eq!((c.cache_hits, c.cache_misses), (0, 51));
}

#[test]
fn what_is_wanted_most_is_not_driven_out_by_what_is_wanted_less() {
    let cache = TileCache::new(100, 100);
    cache.wish(&[wish(1), wish(2)]);
    let first = cache.next().unwrap();
    assert_eq!(first.key, key(1));
    cache.put(first, tile(), false, 0);
    assert!(at_once(&cache).is_none(), "there is no room for the second");
    assert!(cache.get(key(1)).is_some());
}

#[test]
fn a_tile_in_use_is_not_counted_as_free() {
    let cache = TileCache::new(100, 100);
    cache.wish(&[wish(1)]);
    let ticket = cache.next().unwrap();
    cache.put(ticket, tile(), false, 0);
    let held = cache.get(key(1)).unwrap();
    cache.wish(&[wish(2)]);
    assert!(at_once(&cache).is_none());
    assert_eq!(cache.counters().resident_bytes, 100);
    drop(held);
    assert!(at_once(&cache).is_some());
}
