//! The rows of a job as they are read, from memory or from the disk.

use super::super::status;
use super::folder::JobOutcome;
use super::job::{Job, held};
use super::job_state::state_of;
use super::rows::{FinishedRows, RowCursor};
use bimorph_jobs::sweep::journal::JournalRow;
use bimorph_jobs::sweep::{self, SweepTable};
use bimorph_wire::proto;
use std::sync::{Arc, MutexGuard};
use std::time::Instant;
use tonic::Status;

impl Job {
    /// Its rows, read from the disk where they are there alone.
    ///
    /// # Errors
    /// Files that cannot be read, or do not have what they had.
    fn loaded(&self) -> Result<MutexGuard<'_, Option<FinishedRows>>, Status> {
        let file = held(&self.file);
        let mut rows = held(&self.rows);
        if rows.is_some() {
            return Ok(rows);
        }
        // deleted meanwhile, or left to another server
        let file = file.as_ref().ok_or_else(|| status::not_found("job", &self.id))?;
        let lost = |what: String| Status::data_loss(format!("the rows of job \"{}\" cannot be read: {what}", self.id));
        let read = file.read_rows().map_err(|error| lost(error.to_string()))?;
        let expected = self.standing().rows;
        if (read.len() as u64) < expected {
            let status = lost(format!(
                "{} of {expected} are damaged; a server that starts computes them again, or submit the job again",
                expected - read.len() as u64
            ));
            tracing::warn!(job = self.id, reason = status.message(), "damaged");
            self.lose(&status);
            return Err(status);
        }
        let mut found = FinishedRows::default();
        read.into_iter().for_each(|kept| found.push(kept));
        *rows = Some(found);
        Ok(rows)
    }

    /// Its rows are damaged on the disk: it is not done any more. That is not kept, so the next server computes them again.
    fn lose(&self, why: &Status) {
        self.standing.send_modify(|standing| {
            let lost = standing.end.as_ref().map(|end| JobOutcome {
                code: why.code() as i32,
                message: why.message().to_owned(),
                ..end.clone()
            });
            if lost.is_some() {
                (standing.state, standing.end) = (state_of(why.code() as i32), lost);
            }
        });
    }

    /// The next rows of a stream.
    ///
    /// # Errors
    /// As it is read.
    pub(super) fn chunk(&self, reading: &mut RowCursor, end: u64) -> Result<proto::JobRows, Status> {
        *held(&self.used) = Instant::now();
        let mut rows = self.loaded()?;
        Ok(rows.get_or_insert_default().chunk(&self.spec, reading, end))
    }

    /// Drops rows from memory that are on the disk as well, while they have no reader. Waits for a reader to finish.
    pub(super) fn unload(&self) {
        let file = held(&self.file);
        if file.is_some() && self.has_ended() && !self.is_watched() {
            *held(&self.rows) = None;
            self.budget.give_back();
        }
    }

    /// The whole table of a complete job; concurrent readers share one.
    ///
    /// # Errors
    /// As they are read.
    pub(super) fn table(&self) -> Result<Arc<SweepTable>, Status> {
        let mut shared = held(&self.table);
        if let Some(table) = shared.upgrade() {
            return Ok(table);
        }
        let rows = self.loaded()?;
        let with =
            |kept: JournalRow| (self.spec.settings(kept.point).into_iter().map(|(_, value)| value).collect(), kept);
        let found = rows.iter().flat_map(FinishedRows::found).map(with).collect();
        drop(rows);
        self.unload();
        let table = Arc::new(sweep::table_of(self.spec.names().map(str::to_owned).collect(), found));
        *shared = Arc::downgrade(&table);
        Ok(table)
    }
}
