//! Time of a session's last use, its lifetime without use, and its current stream.

use super::limits::Limits;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// The use of a session.
pub(super) struct Usage {
    started: Instant,
    used_ms: AtomicU64,
    /// 0: none was requested.
    lease_ms: AtomicU64,
    /// Streams that hold it.
    streams: AtomicUsize,
    /// Streams that ever took hold of it.
    joined: AtomicU64,
}

impl Default for Usage {
    fn default() -> Self {
        Self {
            started: Instant::now(),
            used_ms: AtomicU64::new(0),
            lease_ms: AtomicU64::new(0),
            streams: AtomicUsize::new(0),
            joined: AtomicU64::new(0),
        }
    }
}

impl Usage {
    /// It is used now.
    pub(super) fn touch(&self) {
        self.used_ms.store(self.age_ms(), Ordering::Relaxed);
    }

    /// A stream takes hold of it; its number, from 1.
    pub(super) fn hold(&self) -> u64 {
        self.streams.fetch_add(1, Ordering::Relaxed);
        self.joined.fetch_add(1, Ordering::SeqCst) + 1
    }

    /// Whether no other stream took hold of it after that one.
    pub(super) fn is_last(&self, stream: u64) -> bool {
        self.joined.load(Ordering::SeqCst) == stream
    }

    /// A stream detaches.
    pub(super) fn release(&self) {
        self.touch();
        self.streams.fetch_sub(1, Ordering::Relaxed);
    }

    /// Keeps it for so long without use (ms); 0: for as long as the server keeps any.
    pub(super) fn lease(&self, millis: u64) {
        self.touch();
        self.lease_ms.store(millis, Ordering::Relaxed);
    }

    /// Whether it was not used for longer than it is kept.
    pub(super) fn is_over(&self, limits: &Limits) -> bool {
        let kept = match self.lease_ms.load(Ordering::Relaxed) {
            _ if self.streams.load(Ordering::Relaxed) > 0 => limits.stream_idle,
            0 => limits.idle,
            lease => Duration::from_millis(lease),
        };
        let idle = Duration::from_millis(self.age_ms().saturating_sub(self.used_ms.load(Ordering::Relaxed)));
        idle >= kept
    }

    fn age_ms(&self) -> u64 {
        u64::try_from(self.started.elapsed().as_millis()).unwrap_or(u64::MAX)
    }
}
