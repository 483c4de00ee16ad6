//! Peer of a connection: its address, and the client at its end.

use super::accounts::CountLease;
use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use tokio_util::sync::CancellationToken;

static NUMBERS: AtomicU64 = AtomicU64::new(1);

/// Peer of a connection.
#[derive(Debug)]
pub(super) struct Peer {
    pub(super) number: u64,
    pub(super) opened: Instant,
    /// Calls under way.
    pub(super) calls: AtomicUsize,
    /// Bytes of requests, by the lengths that they announce.
    pub(super) requests: AtomicUsize,
    /// When the last call ended, after `opened` (ms).
    pub(super) used_ms: AtomicU64,
    pub(super) greeted: AtomicBool,
    /// Once its client has been understood.
    pub(super) who: OnceLock<PeerIdentity>,
    /// Its place in the account of its client, once it had a call.
    pub(super) counted: OnceLock<CountLease>,
    pub(super) cut: CancellationToken,
}

impl Peer {
    pub(super) fn new(cut: &CancellationToken) -> Arc<Self> {
        Arc::new(Self {
            number: NUMBERS.fetch_add(1, Ordering::Relaxed),
            opened: Instant::now(),
            calls: AtomicUsize::new(0),
            requests: AtomicUsize::new(0),
            used_ms: AtomicU64::new(0),
            greeted: AtomicBool::new(false),
            who: OnceLock::new(),
            counted: OnceLock::new(),
            cut: cut.child_token(),
        })
    }

    /// Number of the connection; never 0.
    pub(super) fn number(&self) -> u64 {
        self.number
    }

    /// The client, as far as the connection itself identifies it.
    pub(super) fn who(&self) -> PeerIdentity {
        self.who.get().cloned().unwrap_or(PeerIdentity::Unknown)
    }

    /// A call begins.
    pub(super) fn begin(&self) {
        self.calls.fetch_add(1, Ordering::Relaxed);
    }

    /// A call ends.
    pub(super) fn end(&self) {
        let now = u64::try_from(self.opened.elapsed().as_millis()).unwrap_or(u64::MAX);
        self.used_ms.store(now, Ordering::Relaxed);
        self.calls.fetch_sub(1, Ordering::Relaxed);
    }

    /// How long it has had no call; none while it has one. Before its greeting it counts as idle for ever.
    pub(super) fn idle(&self) -> Option<Duration> {
        if self.calls.load(Ordering::Relaxed) > 0 {
            return None;
        }
        if !self.greeted.load(Ordering::Relaxed) {
            return Some(Duration::MAX);
        }
        Some(self.opened.elapsed().saturating_sub(Duration::from_millis(self.used_ms.load(Ordering::Relaxed))))
    }
}

/// Identity of a client.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum PeerIdentity {
    /// The owner of this server, over a Unix socket.
    Local,
    /// Anybody.
    Unknown,
    /// A client that uses plain HTTP/2 on a TLS address.
    Plain,
    /// The owner of a certificate, by its SHA-256.
    Certified([u8; 32]),
    /// The owner of a token.
    Named(Arc<str>),
}

impl fmt::Display for PeerIdentity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Local => f.write_str("local"),
            Self::Unknown | Self::Plain => f.write_str("unknown"),
            Self::Certified(hash) => hash[..8].iter().try_for_each(|byte| write!(f, "{byte:02x}")),
            Self::Named(name) => f.write_str(name),
        }
    }
}
