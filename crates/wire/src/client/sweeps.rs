//! Sweeps on a server, from the request to the table.

use super::analyses::{Client, ClientError};
use super::jobs::Submission;
use bimorph_base::Bundle;
use bimorph_jobs::sweep::{SweepProgress, SweepSpec, SweepTable};
use bimorph_model::compile::CompileOptions;

impl Client {
    /// Runs a sweep; `progress` receives the progress and may cancel it. A connection that fails meanwhile is made
    /// anew. The server removes it afterwards, for any result; a sweep that is to outlive its client is a job
    /// ([`Self::submit`], [`Self::follow`]).
    ///
    /// # Errors
    /// [`ClientError`]; code "Cancelled" when `progress` stopped it, "Unavailable" or "DeadlineExceeded" when the
    /// server was not reached again.
    pub fn sweep(
        &mut self,
        spec: &SweepSpec,
        bundle: &Bundle,
        options: &CompileOptions,
        progress: &mut dyn FnMut(SweepProgress) -> bool,
    ) -> Result<SweepTable, ClientError> {
        let name = self.submit(spec, bundle, options, Submission::default())?;
        let outcome = self.follow(&name, progress);
        // done with it, whatever came; that it is gone already is no error
        let _ = self.delete_job(&name);
        match outcome? {
            (table, job) if job.error.is_none() => Ok(table),
            (_, job) => {
                let (code, message) = job.error.unwrap_or_default();
                Err(ClientError { address: self.address.clone(), code, message })
            }
        }
    }
}
