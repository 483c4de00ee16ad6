//! Why a computation was stopped.

use std::time::Duration;
use thiserror::Error;

/// Why a computation was stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Stopped {
    /// The request was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// Its wall time is over.
    #[error("its time is over")]
    Late,
    /// It used up its processor time.
    #[error("processor time: at most {seconds} s")]
    Cpu {
        /// The time limit (s).
        seconds: u64,
    },
    /// It would lay out more than it may.
    #[error("memory: at most {most} bytes, needs at least {needed}")]
    Bytes {
        /// The limit (byte).
        most: usize,
        /// The required memory (byte).
        needed: usize,
    },
    /// All computations of its owner would lay out more at once than they may.
    #[error(
        "client_bytes: at most {most} bytes at once in all computations of one client, {used} used, {more} more requested"
    )]
    OwnerBytes {
        /// The quota (byte).
        most: usize,
        /// Memory in use (byte).
        used: usize,
        /// Memory that this computation requires in addition (byte).
        more: usize,
    },
    /// All computations of its owner used up their processor time.
    #[error(
        "client_cpu: at most {} s of processor time of one client within an hour, {:.1} s used; wait for it to come back",
        most.as_secs_f64(),
        used.as_secs_f64()
    )]
    OwnerCpu {
        /// The quota within [`super::WINDOW`].
        most: Duration,
        /// Time used.
        used: Duration,
    },
    /// More modes of more unknowns than may be sought.
    #[error("mode_work: at most {most} unknowns times modes squared, got {got}")]
    ModeWork {
        /// The limit.
        most: usize,
        /// The required value.
        got: usize,
    },
    /// A model with more unknowns than it may have.
    #[error("unknowns: at most {most}, got at least {got}")]
    Unknowns {
        /// The limit.
        most: usize,
        /// The required value.
        got: usize,
    },
}
