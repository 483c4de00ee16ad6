//! Why a computation was stopped.

use std::time::Duration;
use thiserror::Error;

/// Why a computation was stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Stopped {
    /// Nobody waits for it any more.
    #[error("cancelled")]
    Cancelled,
    /// Its wall time is over.
    #[error("its time is over")]
    Late,
    /// It used up its processor time.
    #[error("processor time: at most {seconds} s")]
    Cpu {
        /// What it had [s].
        seconds: u64,
    },
    /// It would lay out more than it may.
    #[error("memory: at most {most} bytes, needs at least {needed}")]
    Bytes {
        /// What it may lay out [byte].
        most: usize,
        /// What it would have laid out by now [byte].
        needed: usize,
    },
    /// All computations of its owner would lay out more at once than they may.
    #[error(
        "client_bytes: at most {most} bytes at once in all computations of one client, {used} used, {more} more asked for"
    )]
    OwnerBytes {
        /// What they may lay out [byte].
        most: usize,
        /// What they have laid out [byte].
        used: usize,
        /// What this one would lay out besides [byte].
        more: usize,
    },
    /// All computations of its owner used up their processor time.
    #[error(
        "client_cpu: at most {} s of processor time of one client within an hour, {:.1} s used; wait for it to come back",
        most.as_secs_f64(),
        used.as_secs_f64()
    )]
    OwnerCpu {
        /// What they may use within [`super::WINDOW`].
        most: Duration,
        /// What they have used.
        used: Duration,
    },
    /// More modes of more unknowns than may be sought.
    #[error("mode_work: at most {most} unknowns times modes squared, got {got}")]
    ModeWork {
        /// What it may be.
        most: usize,
        /// What it would be.
        got: usize,
    },
    /// A model with more unknowns than it may have.
    #[error("unknowns: at most {most}, got at least {got}")]
    Unknowns {
        /// What it may have.
        most: usize,
        /// What it would have.
        got: usize,
    },
}
