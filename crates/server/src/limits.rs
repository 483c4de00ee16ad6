//! Limits of one server: a table that defines the fields, their defaults, and their description for clients.

use super::settings::syntax::{
    ByteSize, BytesOrNone, CountOrNone, PositiveCount, PositiveSeconds, TimeOrNone, ValueSyntax,
};
use bimorph_wire::proto;
use std::sync::LazyLock;
use std::time::Duration;

/// A limit: what it is, and its field.
pub struct Limit {
    /// Name, as `--limit NAME=VALUE`, the environment and files have it.
    pub name: &'static str,
    /// Placeholder for its value in help: `N`, `BYTES`, `SECONDS`.
    pub place: &'static str,
    /// Meaning, in one sentence or two.
    pub help: &'static str,
    pub(super) read: fn(&mut Limits, &str) -> Result<(), &'static str>,
    pub(super) write: fn(&Limits) -> String,
}

macro_rules! limits {
    ($($(#[doc = $help:literal])+ $field:ident: $kind:ident = $default:expr;)+) => {
        /// Limits of a server. A request beyond one is answered with RESOURCE_EXHAUSTED and a message that names it.
        /// `Default` is the only place where the numbers stand; bytes are in (byte), times in (s).
        #[derive(Debug, Clone, PartialEq)]
        pub struct Limits {
            $($(#[doc = $help])+ pub $field: <$kind as ValueSyntax>::Held,)+
        }

        impl Default for Limits {
            fn default() -> Self {
                Self { $($field: $default,)+ }
            }
        }

        /// Every limit, in the order of the documentation.
        pub static LIMITS: LazyLock<Vec<Limit>> = LazyLock::new(|| vec![$(Limit {
            name: stringify!($field),
            place: $kind::METAVAR,
            help: concat!($($help, "\n"),+),
            read: |limits, text| $kind::read(text).map(|value| limits.$field = value),
            write: |limits| $kind::write(&limits.$field),
        }),+]);
    };
}

limits! {
    /// Largest message in either direction. Streams send chunks of at most 1 MiB whatever this is. A session whose
    /// answers would be larger (derivatives are as many as the square of the ports) does not open, and a `Linearize` of
    /// too many frequencies or cross-spectra is refused.
    message_bytes: ByteSize = 64 << 20;

    /// Largest netlist, all files together, and largest layout.
    netlist_bytes: ByteSize = 16 << 20;

    /// Largest SUGAR 3 netlist, all files together: such a netlist is a Lua program, and 0 runs none. With 1M they run
    /// in the sandbox of docs/reference/sugar.md.
    program_bytes: BytesOrNone = 0;

    /// Most mechanical unknowns of one model.
    unknowns: PositiveCount = 200_000;

    /// Models with at most this many unknowns are stepped where their requests arrive; larger ones on a thread of their
    /// own for each trial, which costs some ten microseconds but lets other streams run meanwhile.
    inline_unknowns: PositiveCount = 2_000;

    /// Most compiled models cached. The least recently used one is evicted first, but none that an open session or a
    /// computation of another client uses.
    models: PositiveCount = 64;

    /// Most models of one client cached, whose own are evicted first; 0: any.
    client_models: CountOrNone = 0;

    /// Most bytes of all models kept, counted by what their compilation laid out.
    model_memory: ByteSize = 512 << 20;

    /// The same of the models of one client; 0: any. A single model may be larger.
    client_model_memory: BytesOrNone = 0;

    /// Most sessions open at once. Each holds a bounded number of states.
    sessions: PositiveCount = 256;

    /// Most bytes of all open sessions, counted as 4 kB for each unknown of their models and 176 bytes more for each of their ports.
    session_memory: ByteSize = 2 << 30;

    /// The same of all sessions of one client; 0: any.
    client_session_memory: BytesOrNone = 0;

    /// Most sessions of one client open at once; 0: any. A client is the owner of a token or a certificate. All
    /// connections by a Unix socket count as one client, and so do all without credentials.
    client_sessions: CountOrNone = 0;

    /// Most unknowns of the models of all open sessions of one client, together; 0: any.
    client_unknowns: CountOrNone = 0;

    /// Most bytes that all computations of one client lay out at once, counted before they are laid out; 0: any.
    client_bytes: BytesOrNone = 0;

    /// Most processor time of one client within an hour, trials and threads of sweeps among it; what was used comes back evenly. 0: any.
    client_cpu: TimeOrNone = Duration::ZERO;

    /// Most bytes of states, netlists and jobs in the folder `state_dir`; a session whose states would be beyond does not open, an
    /// accepted state that would be is refused, and a job whose rows would be ends.
    state_bytes: ByteSize = 1 << 30;

    /// Most points of one sweep.
    sweep_points: PositiveCount = 1_000_000;

    /// Most jobs kept, running or finished; with a folder `state_dir` most that run or wait, and 64 times as many in all. All that run
    /// share the processors, in turns of their clients.
    sweeps: PositiveCount = 16;

    /// Most jobs of one client kept, running or finished; with a folder `state_dir` most that run or wait, and 64 times as many in all. 0: any.
    client_sweeps: CountOrNone = 0;

    /// Time without a request after which a finished job in the folder `state_dir` is removed; without such a folder
    /// `idle` applies.
    sweeps_idle: PositiveSeconds = Duration::from_secs(7 * 24 * 3600);

    /// Most samples times signals of one transient.
    transient_values: PositiveCount = 100_000_000;

    /// Most modes of one request.
    modes: PositiveCount = 1_000;

    /// Most unknowns times the square of the modes of one request, which is what one restart of the iteration takes: 1
    /// 000 modes of 2 000 unknowns, 100 of 200 000.
    mode_work: PositiveCount = 2_000_000_000;

    /// Analyses computed at once, others wait their turn: as many as there are cores. As many compilations and openings
    /// have places of their own, and twice as many long trials.
    analyses: PositiveCount = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);

    /// Bytes that one computation may lay out, all together, counted before they are laid out.
    memory: ByteSize = 512 << 20;

    /// Processor time of one computation. Unary calls end earlier, at `request_timeout`.
    cpu: PositiveSeconds = Duration::from_secs(3600);

    /// Most signals, outputs, events or ports of one request.
    signals: PositiveCount = 10_000;

    /// Most transients and tables being sent at once; one whose reader is slow gives its place among analyses to
    /// others.
    result_streams: PositiveCount = 64;

    /// Most calls at once of all connections, streams among them.
    calls: PositiveCount = 4096;

    /// Most calls of one client at once, of all its connections; 0: any.
    client_calls: CountOrNone = 0;

    /// Most transients and tables of one client being sent at once; 0: any.
    client_result_streams: CountOrNone = 0;

    /// Most connections of one client with calls; 0: any.
    client_connections: CountOrNone = 0;

    /// Most bytes of requests held at once: those being received, and those of unary calls until they are answered.
    held_bytes: ByteSize = 256 << 20;

    /// Most bytes of requests of one connection held at once, by the lengths that they announce: from the head of a message until it is
    /// answered. At least `message_bytes`.
    connection_bytes: ByteSize = 128 << 20;

    /// The same of all connections of one client; 0: any.
    client_held_bytes: BytesOrNone = 0;

    /// Longest pause inside a request: a begun message must continue, or the call ends with `DEADLINE_EXCEEDED`.
    request_pause: PositiveSeconds = Duration::from_secs(20);

    /// Time after which a connection without a completed handshake is closed.
    handshake: PositiveSeconds = Duration::from_secs(10);

    /// Time of silence on a TCP connection after which the system probes the other end. It closes the connection after
    /// five unanswered probes, a sixth of this time apart, so that a machine without power or network releases its
    /// slot. A program that is paused is there.
    keepalive: PositiveSeconds = Duration::from_secs(60);

    /// Most connections at once. A further one takes the place of the one without calls that was idle for longest; with
    /// none such it is closed as it comes.
    connections: PositiveCount = 512;

    /// Most HTTP/2 streams of one connection.
    streams_per_connection: PositiveCount = 128;

    /// Longest unary call; then `DEADLINE_EXCEEDED`.
    request_timeout: PositiveSeconds = Duration::from_secs(120);

    /// Time without use after which a session without a stream and without a lease, or a finished job that is not
    /// stored on a disk, is removed.
    idle: PositiveSeconds = Duration::from_secs(600);

    /// Time without use after which a session on an open stream is removed: a circuit may be paused for lunch, but the
    /// session of a vanished client must not stay for ever. Also the longest lease.
    stream_idle: PositiveSeconds = Duration::from_secs(12 * 3600);

    /// Time for open streams to continue after the signal to stop. Then they end with `UNAVAILABLE`, and connections
    /// that do not close are cut.
    drain: PositiveSeconds = Duration::from_secs(5);
}

impl Limits {
    /// Sets a limit by name: a whole number, bytes with an optional k, M or G (times 1024), or seconds.
    ///
    /// # Errors
    /// An unknown name, with the known ones, or a value that is not positive.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), String> {
        let limit = LIMITS.iter().find(|limit| limit.name == name).ok_or_else(|| {
            let names: Vec<&str> = LIMITS.iter().map(|limit| limit.name).collect();
            format!("no limit named \"{name}\"; expected one of {}", names.join(", "))
        })?;
        (limit.read)(self, value).map_err(|expected| format!("{name}: expected {expected}, got \"{value}\""))
    }

    /// The value of a limit as it is written.
    pub fn get(&self, limit: &Limit) -> String {
        (limit.write)(self)
    }

    /// The limits as a message of Info.
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
            client_sweeps: self.client_sweeps as u64,
            sweeps_idle_s: self.sweeps_idle.as_secs_f64(),
        }
    }
}

#[cfg(test)]
mod tests {
    //! Every limit is set by its name, and shown as it reads.
    use super::*;

    #[test]
    fn every_limit_has_a_name() {
        for limit in LIMITS.iter() {
            let name = limit.name;
            let mut limits = Limits::default();
            limits.set(name, "7").unwrap_or_else(|error| panic!("{error}"));
            assert_ne!(limits, Limits::default(), "{name}");
            assert_eq!(limits.get(limit), "7", "{name}");
            for bad in ["-1", "x", "", "1e99", "G"] {
                let error = limits.set(name, bad).expect_err("means nothing");
                assert!(error.starts_with(name), "{error}");
            }
            // every default can be written, and none but such is nothing
            let default = Limits::default().get(limit);
            limits.set(name, &default).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(limits.get(limit), default, "{name}");
            assert_eq!(limits.set(name, "0").is_ok(), default == "0", "{name}");
        }
        // what is added up or multiplied stays a number
        let error = Limits::default().set("connections", "2305843009213693952").expect_err("too many");
        assert!(error.contains("at most 1e15"), "{error}");
        let error = Limits::default().set("session", "1").expect_err("no such limit");
        assert!(error.contains("sessions"), "{error}");
        let mut limits = Limits::default();
        limits.set("memory", "2G").expect("bytes");
        assert_eq!(limits.memory, 2 << 30);
    }
}
