//! Computations that take their time: off the event loop, a few at once, each within a deadline.

use super::shutdown::Shutdown;
use super::status;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tonic::Status;

/// Places for computations.
pub(super) struct Work {
    places: Arc<Semaphore>,
    timeout: Duration,
    shutdown: Shutdown,
}

impl Work {
    /// At most `places` at once, each answered within `timeout`.
    pub(super) fn new(places: usize, timeout: Duration, shutdown: Shutdown) -> Self {
        Self { places: Arc::new(Semaphore::new(places.max(1))), timeout, shutdown }
    }

    /// Waits for a place.
    pub(super) async fn place(&self) -> Result<OwnedSemaphorePermit, Status> {
        tokio::select! {
            place = Arc::clone(&self.places).acquire_owned() => place.map_err(|_| status::stopping()),
            () = tokio::time::sleep(self.timeout) => Err(self.late("waiting for its turn")),
            () = self.shutdown.ending.cancelled() => Err(status::stopping()),
        }
    }

    /// Runs `job` on a thread of its own. When the deadline passes first, the client is told so; the computation keeps
    /// its place until it ends, so that late ones cannot pile up.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        job: impl FnOnce() -> Result<T, Status> + Send + 'static,
    ) -> Result<T, Status> {
        let place = self.place().await?;
        let running = tokio::task::spawn_blocking(move || {
            let _place = place;
            guarded(job)
        });
        tokio::select! {
            answer = running => answer.unwrap_or_else(|_| Err(status::fault())),
            () = tokio::time::sleep(self.timeout) => Err(self.late("computing")),
            () = self.shutdown.ending.cancelled() => Err(status::stopping()),
        }
    }

    fn late(&self, doing: &str) -> Status {
        let seconds = self.timeout.as_secs_f64();
        Status::deadline_exceeded(format!("still {doing} after {seconds} s, the limit of this server for one call"))
    }
}

/// Turns a panic into INTERNAL: one bad request must not end the others.
pub(super) fn guarded<T>(job: impl FnOnce() -> Result<T, Status>) -> Result<T, Status> {
    catch_unwind(AssertUnwindSafe(job)).unwrap_or_else(|_| {
        tracing::error!("internal fault: one call has no answer");
        Err(status::fault())
    })
}
