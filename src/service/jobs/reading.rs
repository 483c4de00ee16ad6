//! The rows of a job as they are read, from memory or from the disk.

use super::super::{proto, status};
use super::job::{Job, held};
use super::rows::{Reading, Rows};
use crate::jobs::sweep::journal::Kept;
use crate::jobs::sweep::{self, SweepTable};
use std::time::Instant;
use tonic::Status;

impl Job {
    /// Reads its rows from the disk, where they are there alone.
    ///
    /// # Errors
    /// Files that cannot be read, or do not have what they had.
    pub(super) fn load(&self) -> Result<(), Status> {
        let mut file = held(&self.file);
        let mut rows = held(&self.rows);
        if rows.is_some() {
            return Ok(());
        }
        // deleted meanwhile, or left to another server
        let file = file.as_mut().ok_or_else(|| status::not_found("job", &self.id))?;
        let lost = |what: String| Status::data_loss(format!("the rows of job \"{}\" cannot be read: {what}", self.id));
        let read = file.open().map_err(|error| lost(error.to_string()))?;
        file.close();
        let expected = self.standing().rows;
        if (read.len() as u64) < expected {
            return Err(lost(format!("there are {} of {expected}", read.len())));
        }
        let mut found = Rows::default();
        read.into_iter().for_each(|kept| found.push(kept));
        *rows = Some(found);
        Ok(())
    }

    /// The next rows of a stream.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub(super) fn chunk(&self, reading: &mut Reading, end: u64) -> Result<proto::JobRows, Status> {
        self.load()?;
        *held(&self.used) = Instant::now();
        Ok(held(&self.rows).get_or_insert_default().chunk(&self.spec, reading, end))
    }

    /// Lets go of rows that are on the disk as well, where nobody is about to read them.
    pub(super) fn unload(&self) {
        let file = held(&self.file);
        let read = self.standing.receiver_count() > 1;
        if file.is_some() && self.has_ended() && !read && self.table.get().is_none() {
            *held(&self.rows) = None;
        }
    }

    /// The whole table, of a job that has all of its rows.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub(super) fn make_table(&self) -> Result<(), Status> {
        self.load()?;
        self.table.get_or_init(|| {
            let with =
                |kept: Kept| (self.spec.settings(kept.point).into_iter().map(|(_, value)| value).collect(), kept);
            let rows = held(&self.rows).iter().flat_map(Rows::found).map(with).collect();
            sweep::table_of(self.spec.names().map(str::to_owned).collect(), rows)
        });
        Ok(())
    }

    /// The table, once it was made.
    pub(super) fn table(&self) -> Option<&SweepTable> {
        self.table.get()
    }
}
