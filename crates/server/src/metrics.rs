//! Metrics of a server in Prometheus' text format 0.0.4, and readiness.

use std::fmt::Write;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};
use tonic::Code;

/// Calls that are counted by name; the last stands for all others.
const CALLS: [&str; 36] = [
    "Info",
    "Check",
    "Convert",
    "Compile",
    "Describe",
    "Open",
    "Trial",
    "Run",
    "Linearize",
    "Snapshot",
    "Restore",
    "Fork",
    "KeepAlive",
    "Close",
    "Static",
    "Modes",
    "FrequencyResponse",
    "PullIn",
    "Path",
    "Export",
    "Transient",
    "SubmitJob",
    "GetJob",
    "ListJobs",
    "WatchJob",
    "FetchJob",
    "CancelJob",
    "DeleteJob",
    "SubmitSweep",
    "WatchSweep",
    "FetchSweep",
    "CancelSweep",
    "Health/Check",
    "Health/Watch",
    "ServerReflectionInfo",
    "other",
];
/// Codes of gRPC, by number.
const CODES: usize = 17;
/// Upper ends of the classes of durations (s).
const CLASSES: [f64; 8] = [0.001, 0.01, 0.1, 1.0, 10.0, 100.0, 1000.0, f64::INFINITY];

/// A metric: its name, what it is, and what it means.
pub struct Metric {
    /// Name.
    pub name: &'static str,
    /// "gauge", "counter" or "histogram".
    pub kind: &'static str,
    /// Meaning, with its unit.
    pub help: &'static str,
}

const fn metric(name: &'static str, kind: &'static str, help: &'static str) -> Metric {
    Metric { name, kind, help }
}

/// Every metric, in the order of the report.
pub const METRICS: [Metric; 17] = [
    metric("bimorph_info", "gauge", "1, with the version of the server."),
    metric("bimorph_start_time_seconds", "gauge", "When the server started, since 1970 [s]."),
    metric("bimorph_ready", "gauge", "1 where it is ready for more, 0 where it is full or stops."),
    metric("bimorph_connections", "gauge", "Connections open."),
    metric("bimorph_calls", "gauge", "Calls under way, streams among them."),
    metric("bimorph_calls_total", "counter", "Calls that ended, by name and gRPC code."),
    metric("bimorph_call_seconds", "histogram", "How long calls took, by name [s]."),
    metric("bimorph_trials_total", "counter", "Requests on Trial streams, and trials of runs."),
    metric("bimorph_held_bytes", "gauge", "Bytes of requests that are held [byte]."),
    metric("bimorph_sessions", "gauge", "Sessions open."),
    metric("bimorph_models", "gauge", "Models kept."),
    metric("bimorph_sweeps", "gauge", "Jobs kept, running or finished."),
    metric("bimorph_waiting", "gauge", "Computations that wait for a place, by what they are."),
    metric("bimorph_kept_sessions", "gauge", "Sessions in the folder of states."),
    metric("bimorph_kept_bytes", "gauge", "Bytes in the folder of states [byte]."),
    metric(
        "bimorph_log_lines_dropped_total",
        "counter",
        "Lines of the log that were dropped because they were not read in time.",
    ),
    metric("process_resident_memory_bytes", "gauge", "Resident memory [byte]."),
];

/// Counts of one server.
#[derive(Debug)]
pub(super) struct Metrics {
    pub(super) started: SystemTime,
    pub(super) ended: Vec<[AtomicU64; CODES]>,
    pub(super) classes: Vec<[AtomicU64; CLASSES.len()]>,
    /// Microseconds.
    pub(super) took: Vec<AtomicU64>,
    /// Requests on Trial streams, and trials of runs.
    pub(super) trials: AtomicU64,
}

impl Default for Metrics {
    fn default() -> Self {
        Self {
            started: SystemTime::now(),
            ended: CALLS.iter().map(|_| Default::default()).collect(),
            classes: CALLS.iter().map(|_| Default::default()).collect(),
            took: CALLS.iter().map(|_| AtomicU64::new(0)).collect(),
            trials: AtomicU64::new(0),
        }
    }
}

/// The place of a call among those that are counted.
pub(super) fn place(path: &str) -> usize {
    let own = path.strip_prefix("/bimorph.v1.Bimorph/").or_else(|| path.strip_prefix("/grpc.health.v1."));
    let name = own.or_else(|| path.rsplit('/').next()).unwrap_or_default();
    CALLS.iter().position(|call| *call == name).unwrap_or(CALLS.len() - 1)
}

/// The name of a call that is counted.
pub(super) fn name(place: usize) -> &'static str {
    CALLS.get(place).copied().unwrap_or("other")
}

impl Metrics {
    /// A call has ended.
    pub(super) fn ended(&self, place: usize, code: Code, time: Duration) {
        let class = CLASSES.iter().position(|end| time.as_secs_f64() <= *end).unwrap_or(0);
        self.ended[place][code as usize % CODES].fetch_add(1, Ordering::Relaxed);
        self.classes[place][class].fetch_add(1, Ordering::Relaxed);
        self.took[place].fetch_add(u64::try_from(time.as_micros()).unwrap_or(u64::MAX), Ordering::Relaxed);
    }

    pub(super) fn calls(&self, out: &mut String) {
        for (name, codes) in CALLS.iter().zip(&self.ended) {
            for (code, count) in codes.iter().enumerate().map(|(k, count)| (k, count.load(Ordering::Relaxed))) {
                if count > 0 {
                    let code = Code::from_i32(i32::try_from(code).unwrap_or(2));
                    let _ = writeln!(out, "bimorph_calls_total{{call=\"{name}\",code=\"{code:?}\"}} {count}");
                }
            }
        }
    }

    pub(super) fn durations(&self, out: &mut String) {
        for (k, name) in CALLS.iter().enumerate() {
            let counts: Vec<u64> = self.classes[k].iter().map(|count| count.load(Ordering::Relaxed)).collect();
            let mut sum = 0;
            if counts.iter().all(|count| *count == 0) {
                continue;
            }
            for (end, count) in CLASSES.iter().zip(counts) {
                sum += count;
                let end = if end.is_finite() { end.to_string() } else { "+Inf".to_owned() };
                let _ = writeln!(out, "bimorph_call_seconds_bucket{{call=\"{name}\",le=\"{end}\"}} {sum}");
            }
            let took = Duration::from_micros(self.took[k].load(Ordering::Relaxed)).as_secs_f64();
            let _ = writeln!(out, "bimorph_call_seconds_sum{{call=\"{name}\"}} {took}");
            let _ = writeln!(out, "bimorph_call_seconds_count{{call=\"{name}\"}} {sum}");
        }
    }
}
