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
    /// Largest SUGAR 3 netlist, all files together [byte], default 0: such a netlist is a program, and none is run.
    pub program_bytes: usize,
    /// Most mechanical unknowns of one model, default 200 000. Larger: more memory and longer trials.
    pub unknowns: usize,
    /// Models with at most this many unknowns are stepped on the task of their stream, default 2 000; larger ones on a
    /// thread of their own for each trial, which costs some ten microseconds but lets other streams run meanwhile.
    pub inline_unknowns: usize,
    /// Most compiled models kept, default 64; the one unused for longest is forgotten first.
    pub models: usize,
    /// Most bytes of compiled models kept, default 512 MiB, counted by what their compilation laid out.
    pub model_memory: usize,
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
    /// Most unknowns times the square of the modes of one request, default 2e9: what one restart of the iteration takes, which
    /// cannot be stopped half way.
    pub mode_work: usize,
    /// Analyses computed at once, default the number of cores; others wait their turn. As many compilations and openings
    /// have places of their own, so that long transients do not keep a circuit from starting.
    pub analyses: usize,
    /// Bytes that one computation may lay out, all together, default 512 MiB. Counted before they are laid out.
    pub memory: usize,
    /// Processor time of one computation, default 1 h. Unary calls end earlier, at `request_timeout`.
    pub cpu: Duration,
    /// Most signals, outputs, events or ports of one request, default 10 000.
    pub signals: usize,
    /// Most transients and tables being sent at once, default 64: each may wait for a reader that is slow.
    pub result_streams: usize,
    /// Most calls at once, streams among them, default 4 096.
    pub calls: usize,
    /// Most bytes of requests that are held at once, default 256 MiB: those being received, and those of unary calls until
    /// they are answered.
    pub held_bytes: usize,
    /// Longest pause inside a request [s], default 20 s: a message that was begun must go on.
    pub request_pause: Duration,
    /// A connection that has not said what it speaks by then is closed [s], default 10 s.
    pub handshake: Duration,
    /// Most connections at once, default 512. A further one takes the place of the one without calls that was idle for
    /// longest; with none such it is closed as it comes.
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
            program_bytes: 0,
            unknowns: 200_000,
            inline_unknowns: 2_000,
            models: 64,
            model_memory: 512 << 20,
            sessions: 256,
            sweep_points: 1_000_000,
            sweeps: 16,
            transient_values: 100_000_000,
            modes: 1_000,
            mode_work: 2_000_000_000,
            analyses: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            memory: 512 << 20,
            cpu: Duration::from_secs(3600),
            signals: 10_000,
            result_streams: 64,
            calls: 4096,
            held_bytes: 256 << 20,
            request_pause: Duration::from_secs(20),
            handshake: Duration::from_secs(10),
            connections: 512,
            streams_per_connection: 128,
            request_timeout: Duration::from_secs(120),
            idle: Duration::from_secs(600),
            stream_idle: Duration::from_secs(12 * 3600),
            drain: Duration::from_secs(5),
        }
    }
}

/// A limit by its name.
enum Field<'a> {
    Count(&'a mut usize),
    Count32(&'a mut u32),
    Bytes(&'a mut usize),
    Time(&'a mut Duration),
}

/// Names of all limits, as `--limit NAME=VALUE` and docs/service.md have them.
pub const NAMES: [&str; 28] = [
    "message_bytes",
    "netlist_bytes",
    "program_bytes",
    "unknowns",
    "inline_unknowns",
    "models",
    "model_memory",
    "sessions",
    "sweep_points",
    "sweeps",
    "transient_values",
    "modes",
    "mode_work",
    "analyses",
    "memory",
    "cpu",
    "signals",
    "result_streams",
    "calls",
    "held_bytes",
    "request_pause",
    "handshake",
    "connections",
    "streams_per_connection",
    "request_timeout",
    "idle",
    "stream_idle",
    "drain",
];

impl Limits {
    fn field(&mut self, name: &str) -> Option<Field<'_>> {
        Some(match name {
            "message_bytes" => Field::Bytes(&mut self.message_bytes),
            "netlist_bytes" => Field::Bytes(&mut self.netlist_bytes),
            "program_bytes" => Field::Bytes(&mut self.program_bytes),
            "unknowns" => Field::Count(&mut self.unknowns),
            "inline_unknowns" => Field::Count(&mut self.inline_unknowns),
            "models" => Field::Count(&mut self.models),
            "model_memory" => Field::Bytes(&mut self.model_memory),
            "sessions" => Field::Count(&mut self.sessions),
            "sweep_points" => Field::Count(&mut self.sweep_points),
            "sweeps" => Field::Count(&mut self.sweeps),
            "transient_values" => Field::Count(&mut self.transient_values),
            "modes" => Field::Count(&mut self.modes),
            "mode_work" => Field::Count(&mut self.mode_work),
            "analyses" => Field::Count(&mut self.analyses),
            "memory" => Field::Bytes(&mut self.memory),
            "cpu" => Field::Time(&mut self.cpu),
            "signals" => Field::Count(&mut self.signals),
            "result_streams" => Field::Count(&mut self.result_streams),
            "calls" => Field::Count(&mut self.calls),
            "held_bytes" => Field::Bytes(&mut self.held_bytes),
            "request_pause" => Field::Time(&mut self.request_pause),
            "handshake" => Field::Time(&mut self.handshake),
            "connections" => Field::Count(&mut self.connections),
            "streams_per_connection" => Field::Count32(&mut self.streams_per_connection),
            "request_timeout" => Field::Time(&mut self.request_timeout),
            "idle" => Field::Time(&mut self.idle),
            "stream_idle" => Field::Time(&mut self.stream_idle),
            "drain" => Field::Time(&mut self.drain),
            _ => return None,
        })
    }

    /// Sets a limit by name: a whole number, bytes with an optional k, M or G (times 1024), or seconds.
    ///
    /// # Errors
    /// A name that is none, with the names there are, or a value that is not positive.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), String> {
        let unknown = || format!("no limit named \"{name}\"; expected one of {}", NAMES.join(", "));
        let whole = |text: &str| text.parse::<usize>().ok().filter(|n| *n > 0);
        let set = match self.field(name).ok_or_else(unknown)? {
            Field::Count(to) => whole(value).map(|n| *to = n).ok_or("a whole number above 0"),
            Field::Count32(to) => {
                whole(value).and_then(|n| n.try_into().ok()).map(|n| *to = n).ok_or("a whole number above 0")
            }
            Field::Bytes(to) => {
                let (digits, shift) = match value.char_indices().last() {
                    Some((at, 'k')) => (&value[..at], 10),
                    Some((at, 'M')) => (&value[..at], 20),
                    Some((at, 'G')) => (&value[..at], 30),
                    _ => (value, 0),
                };
                let bytes = whole(digits).and_then(|n| n.checked_mul(1 << shift));
                bytes.map(|n| *to = n).ok_or("bytes above 0, as 1000000, 64M or 2G")
            }
            Field::Time(to) => {
                let seconds = value.parse::<f64>().ok().filter(|s| *s > 0.0 && *s <= 1e9);
                seconds.map(|s| *to = Duration::from_secs_f64(s)).ok_or("seconds above 0, at most 1e9")
            }
        };
        set.map_err(|expected| format!("{name}: expected {expected}, got \"{value}\""))
    }

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
            memory_bytes: self.memory as u64,
            cpu_s: self.cpu.as_secs_f64(),
            signals: self.signals as u64,
            modes: self.modes as u64,
            result_streams: self.result_streams as u64,
            calls: self.calls as u64,
            held_bytes: self.held_bytes as u64,
            connections: self.connections as u64,
            stream_idle_s: self.stream_idle.as_secs_f64(),
            model_memory_bytes: self.model_memory as u64,
            mode_work: self.mode_work as u64,
        }
    }
}

#[cfg(test)]
mod tests {
    //! Every limit is set by its name, and docs/service.md has it.
    use super::*;

    #[test]
    fn every_limit_has_a_name() {
        for name in NAMES {
            let mut limits = Limits::default();
            limits.set(name, "7").unwrap_or_else(|error| panic!("{error}"));
            assert_ne!(limits, Limits::default(), "{name}");
            for bad in ["0", "-1", "x", "", "1e99", "G"] {
                let error = limits.set(name, bad).expect_err("means nothing");
                assert!(error.starts_with(name), "{error}");
            }
        }
        let error = Limits::default().set("session", "1").expect_err("no such limit");
        assert!(error.contains("sessions"), "{error}");
        let mut limits = Limits::default();
        limits.set("memory", "2G").expect("bytes");
        assert_eq!(limits.memory, 2 << 30);
    }

    #[test]
    fn every_limit_is_documented() {
        let docs = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/service.md")).expect("readable");
        for name in NAMES {
            assert!(docs.contains(&format!("`{name}`")), "{name}");
        }
    }
}
