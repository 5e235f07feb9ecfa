//! Bytes in use: reserved before a tile is decoded, given back when the last owner drops it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A bound on bytes that is never passed, whoever holds them.
#[derive(Debug)]
pub(crate) struct Account {
    limit: u64,
    used: AtomicU64,
    most: AtomicU64,
}

impl Account {
    pub fn new(limit: u64) -> Arc<Self> {
        Arc::new(Self { limit, used: AtomicU64::new(0), most: AtomicU64::new(0) })
    }

    /// Takes bytes, if the bound allows.
    pub fn reserve(self: &Arc<Self>, bytes: u64) -> Option<Reservation> {
        let fits = |used: u64| used.checked_add(bytes).filter(|sum| *sum <= self.limit);
        let before = self.used.fetch_update(Ordering::AcqRel, Ordering::Acquire, fits).ok()?;
        self.most.fetch_max(before + bytes, Ordering::AcqRel);
        Some(Reservation { account: self.clone(), bytes })
    }

    pub fn used(&self) -> u64 {
        self.used.load(Ordering::Acquire)
    }

    pub fn most(&self) -> u64 {
        self.most.load(Ordering::Acquire)
    }

    pub fn limit(&self) -> u64 {
        self.limit
    }
}

/// Bytes taken from an [`Account`]; dropping it gives them back.
#[derive(Debug)]
pub(crate) struct Reservation {
    account: Arc<Account>,
    bytes: u64,
}

impl Drop for Reservation {
    fn drop(&mut self) {
        self.account.used.fetch_sub(self.bytes, Ordering::AcqRel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_is_exact() {
        let account = Account::new(10);
        let a = account.reserve(6).unwrap();
        assert!(account.reserve(5).is_none());
        let b = account.reserve(4).unwrap();
        assert_eq!((account.used(), account.most()), (10, 10));
        drop(a);
        assert!(account.reserve(7).is_none());
        drop(b);
        assert_eq!((account.used(), account.most()), (0, 10));
    }
}
