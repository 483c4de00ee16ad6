//! Where a job stands, and why one is to stop.

use super::super::status;
use super::folder::JobOutcome;
use bimorph_wire::proto;
use proto::job_metadata::State;
use std::io;
use std::time::Duration;
use tonic::{Code, Status};

/// Where a job stands.
#[derive(Debug, Clone, Default)]
pub(super) struct JobState {
    pub(super) state: State,
    pub(super) rows: u64,
    pub(super) failed: u64,
    pub(super) end: Option<JobOutcome>,
    /// It has ended for this server alone: another one may continue it.
    pub(super) refused: bool,
    /// Deleted.
    pub(super) gone: bool,
    /// The next server continues it.
    pub(super) suspended: bool,
}

/// Why a job is to stop.
#[derive(Debug)]
pub(super) enum JobStopReason {
    Cancelled,
    /// Its client was gone for so long.
    Released(Duration),
    /// The server stops.
    Suspended,
    Deleted,
    /// Its rows cannot be kept.
    Disk(io::Error),
}

impl JobStopReason {
    /// The state as reported to clients.
    pub(super) fn reported(&self) -> Status {
        match self {
            Self::Cancelled | Self::Deleted => Status::cancelled("cancelled"),
            Self::Suspended => Status::cancelled("cancelled: the server is shutting down"),
            Self::Released(time) => {
                Status::cancelled(format!("cancelled: its client was gone for {} s", time.as_secs_f64()))
            }
            Self::Disk(error) => status::not_kept("its rows are", error),
        }
    }
}

/// The state of what ended with a code.
pub(super) fn state_of(code: i32) -> State {
    match Code::from_i32(code) {
        Code::Ok => State::Done,
        Code::Cancelled => State::Cancelled,
        _ => State::Failed,
    }
}
