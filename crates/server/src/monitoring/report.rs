//! Content of the monitoring endpoints: every metric in Prometheus' format, and readiness.

use crate::admission::counters::AdmissionCounters;
use crate::log;
use crate::metrics::{METRICS, Metric};
use crate::shared::ServerState;
use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::UNIX_EPOCH;

/// Data of the monitoring endpoints.
#[derive(Clone)]
pub(crate) struct MonitoringState {
    pub(crate) shared: Arc<ServerState>,
    pub(crate) gate: Arc<AdmissionCounters>,
}

/// Why a server is not ready for more; none: it is.
pub(crate) fn busy(shared: &ServerState, gate: &AdmissionCounters) -> Option<String> {
    let limits = &shared.limits;
    if shared.shutdown.draining.is_cancelled() {
        return Some("it is stopping".to_owned());
    }
    let sessions = shared.sessions.len();
    let (calls, held) = (gate.calls(), gate.held());
    let waiting = shared.work.waiting().max(shared.desk.waiting());
    for (what, have, most) in [
        ("sessions", sessions, limits.sessions),
        ("calls", calls, limits.calls),
        ("held_bytes", held, limits.held_bytes),
        // each would wait for this many others before its turn
        ("waiting", waiting, limits.analyses.saturating_mul(WAITING)),
    ] {
        if have >= most {
            return Some(format!("{what}: {have} of {most}"));
        }
    }
    None
}

/// Computations that may wait for each place before others are sent elsewhere.
const WAITING: usize = 8;

/// Everything, as Prometheus reads it.
pub(crate) fn text(shared: &ServerState, gate: &AdmissionCounters) -> String {
    let mut out = String::with_capacity(8192);
    for Metric { name, kind, help } in METRICS {
        let _ = writeln!(out, "# HELP {name} {help}\n# TYPE {name} {kind}");
        let value = match name {
            "bimorph_info" => {
                let _ = writeln!(out, "bimorph_info{{version=\"{}\"}} 1", env!("CARGO_PKG_VERSION"));
                continue;
            }
            "bimorph_calls_total" => {
                shared.metrics.calls(&mut out);
                continue;
            }
            "bimorph_call_seconds" => {
                shared.metrics.durations(&mut out);
                continue;
            }
            "bimorph_waiting" => {
                for (what, work) in [("analyses", &shared.work), ("openings", &shared.desk), ("trials", &shared.trials)]
                {
                    let _ = writeln!(out, "bimorph_waiting{{for=\"{what}\"}} {}", work.waiting());
                }
                continue;
            }
            "bimorph_start_time_seconds" => {
                shared.metrics.started.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs()
            }
            "bimorph_ready" => u64::from(busy(shared, gate).is_none()),
            "bimorph_connections" => shared.connections.open() as u64,
            "bimorph_calls" => gate.calls() as u64,
            "bimorph_trials_total" => shared.metrics.trials.load(Ordering::Relaxed),
            "bimorph_held_bytes" => gate.held() as u64,
            "bimorph_sessions" => shared.sessions.len() as u64,
            "bimorph_models" => shared.models.len() as u64,
            "bimorph_sweeps" => shared.jobs.len() as u64,
            "bimorph_kept_sessions" => shared.store.as_ref().map_or(0, |store| store.len() as u64),
            "bimorph_kept_bytes" => shared.store.as_ref().map_or(0, |store| store.used() as u64),
            "bimorph_log_lines_dropped_total" => log::dropped(),
            _ => resident(),
        };
        let _ = writeln!(out, "{name} {value}");
    }
    out
}

/// Resident memory (byte) on Linux; 0 elsewhere.
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()).and_then(|word| word.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}
