//! Intervals of clock readings, and the clock of processor time.

use std::time::Duration;

/// Checks between two clock readings; a reading costs some 30 ns.
pub(super) const CHECKS_PER_LOOK: u32 = 16;
/// Interval between reads of the thread's processor time, which the system provides in a file.
pub(super) const CPU_INTERVAL: Duration = Duration::from_millis(100);

/// Processor time of this thread, where the system provides it (Linux); elsewhere deadlines alone hold.
#[inline]
pub fn thread_cpu() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse().ok().map(Duration::from_nanos)
}
