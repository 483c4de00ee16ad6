//! How large the messages of streams are, and how often one comes.

use std::time::Duration;

/// Most bytes of one message of a stream.
pub(super) const CHUNK_BYTES: usize = 1 << 20;
/// What goes on without anything to send says at least this often how far it has come, so that clients can tell slow from dead.
pub(super) const HEARTBEAT: Duration = Duration::from_secs(1);
