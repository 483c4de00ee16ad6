//! Why a sweep has no table.

use bimorph_base::budget::Stopped;
use thiserror::Error;

/// Why a sweep has no table. A point that fails is not an error of the sweep: its row says why.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A specification that means nothing.
    #[error("{what}: expected {expected}, got {got}")]
    BadSpec {
        /// Which part.
        what: String,
        /// The expected value.
        expected: String,
        /// The given value.
        got: String,
    },
    /// The progress callback stopped it.
    #[error("cancelled after {done} of {points} points")]
    Cancelled {
        /// Points finished.
        done: u64,
        /// Points of this shard.
        points: u64,
    },
    /// The table would take more memory than the sweep may use.
    #[error("the table needs more than {most} bytes; name the outputs that are wanted, or split the sweep into shards")]
    TooLarge {
        /// The limit (byte).
        most: usize,
    },
    /// The quota of its owner is used up.
    #[error("{0}")]
    Owner(Stopped),
    /// The operating system gave no threads.
    #[error("no worker threads: {reason}")]
    Threads {
        /// The message.
        reason: String,
    },
}

/// Error of an invalid entry of a specification.
pub(super) fn bad(what: String, expected: &str, got: &str) -> SweepError {
    SweepError::BadSpec { what, expected: expected.to_owned(), got: got.to_owned() }
}
