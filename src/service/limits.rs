//! What one server allows.

use super::proto;
use std::time::Duration;

/// Limits of a server. A request beyond one is answered with RESOURCE_EXHAUSTED and a message that names it.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Largest message in either direction [byte], default 64 MiB. Streams send chunks of at most 1 MiB whatever this is.
    pub message_bytes: usize,
    /// Largest netlist, all files together [byte], default 16 MiB.
    pub netlist_bytes: usize,
    /// Most mechanical unknowns of one model, default 200 000. Larger: more memory and longer trials.
    pub unknowns: usize,
    /// Models with at most this many unknowns are stepped on the task of their stream, default 2 000; larger ones on a
    /// thread of their own for each trial, which costs some ten microseconds but lets other streams run meanwhile.
    pub inline_unknowns: usize,
    /// Most compiled models kept, default 64; the one unused for longest is forgotten first.
    pub models: usize,
    /// Most sessions open at once, default 256. Each holds a bounded number of states: the device forgets the least
    /// recently used.
    pub sessions: usize,
    /// Most points of one sweep, default 1 000 000.
    pub sweep_points: usize,
    /// Most sweeps kept, running or finished, default 16.
    pub sweeps: usize,
    /// Most samples times signals of one transient, default 100 000 000.
    pub transient_values: usize,
    /// Most modes of one request, default 1 000.
    pub modes: usize,
    /// Analyses computed at once, default the number of cores; others wait their turn. As many compilations and openings
    /// have places of their own, so that long transients do not keep a circuit from starting.
    pub analyses: usize,
    /// Most connections at once, default 512; further ones are closed as they come.
    pub connections: usize,
    /// Most HTTP/2 streams of one connection, default 128.
    pub streams_per_connection: u32,
    /// Longest unary call [s], default 120 s; then DEADLINE_EXCEEDED.
    pub request_timeout: Duration,
    /// A session without a stream, or a finished sweep, untouched for this long is forgotten, default 10 min.
    pub idle: Duration,
    /// A session on an open stream untouched for this long is forgotten, default 12 h: a circuit may be paused for lunch,
    /// but a client that vanished without a word must not stay for ever.
    pub stream_idle: Duration,
    /// After the signal to stop, open streams may go on for this long, default 5 s; then they end with UNAVAILABLE, and
    /// connections that do not close are cut.
    pub drain: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            message_bytes: 64 << 20,
            netlist_bytes: 16 << 20,
            unknowns: 200_000,
            inline_unknowns: 2_000,
            models: 64,
            sessions: 256,
            sweep_points: 1_000_000,
            sweeps: 16,
            transient_values: 100_000_000,
            modes: 1_000,
            analyses: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            connections: 512,
            streams_per_connection: 128,
            request_timeout: Duration::from_secs(120),
            idle: Duration::from_secs(600),
            stream_idle: Duration::from_secs(12 * 3600),
            drain: Duration::from_secs(5),
        }
    }
}

impl Limits {
    /// The limits as Info tells them.
    pub(super) fn to_wire(&self) -> proto::Limits {
        proto::Limits {
            message_bytes: self.message_bytes as u64,
            netlist_bytes: self.netlist_bytes as u64,
            unknowns: self.unknowns as u64,
            models: self.models as u64,
            sessions: self.sessions as u64,
            sweep_points: self.sweep_points as u64,
            sweeps: self.sweeps as u64,
            transient_values: self.transient_values as u64,
            request_timeout_s: self.request_timeout.as_secs_f64(),
            idle_s: self.idle.as_secs_f64(),
        }
    }
}
