//! How large the messages of streams are, and how often one comes.

use std::time::Duration;

/// Most bytes of one message of a stream.
pub(super) const CHUNK_BYTES: usize = 1 << 20;
/// Longest interval between progress messages of a stream without other messages, so that clients can distinguish slow
/// from dead servers.
pub(super) const HEARTBEAT: Duration = Duration::from_secs(1);
