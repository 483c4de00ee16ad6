//! Bytes that a folder of states may have, and has.

use std::io;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A bound on bytes, and those in use.
#[derive(Debug)]
pub(super) struct ByteQuota {
    most: usize,
    used: AtomicUsize,
}

impl ByteQuota {
    /// At most so many, of which some are in use.
    pub(super) fn new(most: usize, used: usize) -> Self {
        Self { most, used: AtomicUsize::new(used) }
    }

    /// Bytes in use.
    pub(super) fn used(&self) -> usize {
        self.used.load(Ordering::Relaxed)
    }

    /// Whether there would be room if `before` bytes became `after`.
    ///
    /// # Errors
    /// A storage that is full, with the name of the limit.
    pub(super) fn check(&self, before: usize, after: usize) -> io::Result<()> {
        let used = self.used().saturating_sub(before).saturating_add(after);
        if used > self.most { Err(self.full(used)) } else { Ok(()) }
    }

    /// So many bytes became so many.
    pub(super) fn count(&self, before: usize, after: usize) {
        let change = |used: usize| Some(used.saturating_add(after).saturating_sub(before));
        let _ = self.used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, change);
    }

    /// Takes bytes.
    ///
    /// # Errors
    /// As [`Self::look`]; then none are taken.
    pub(super) fn take(&self, bytes: usize) -> io::Result<()> {
        let more = |used: usize| used.checked_add(bytes).filter(|used| *used <= self.most);
        let taken = self.used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, more);
        taken.map(drop).map_err(|used| self.full(used.saturating_add(bytes)))
    }

    fn full(&self, used: usize) -> io::Error {
        let text = format!("state_bytes: at most {} in all, got {used}; Info lists the limits", self.most);
        io::Error::new(io::ErrorKind::StorageFull, text)
    }
}
