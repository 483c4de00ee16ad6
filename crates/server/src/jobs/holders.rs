//! Connections that hold a job: those that requested it.

use std::collections::{BTreeSet, VecDeque};
use std::time::{Duration, Instant};

/// Most connections of its client that a job stores; of more, the last.
const MAX_CONNECTIONS: usize = 1024;

/// Connections that requested a job.
#[derive(Debug, Default)]
pub(super) struct JobHolders {
    connections: VecDeque<u64>,
    /// Since when all of them are closed.
    gone: Option<Instant>,
}

impl JobHolders {
    /// It was requested by one.
    pub(super) fn take(&mut self, connection: u64) {
        self.gone = None;
        if !self.connections.contains(&connection) {
            self.connections.push_back(connection);
            if self.connections.len() > MAX_CONNECTIONS {
                self.connections.pop_front();
            }
        }
    }

    /// One of them is known to be open.
    pub(super) fn are_there(&mut self) {
        self.gone = None;
    }

    /// Time since the last of them was closed, given the open connections; `None` while one is open. A process that
    /// asks itself always is there.
    pub(super) fn are_gone(&mut self, open: &BTreeSet<u64>) -> Option<Duration> {
        if self.connections.iter().any(|number| *number == 0 || open.contains(number)) {
            self.gone = None;
            return None;
        }
        Some(self.gone.get_or_insert_with(Instant::now).elapsed())
    }
}
