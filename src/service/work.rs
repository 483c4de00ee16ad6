//! Computations that take their time: off the event loop, a few at once, each under a budget.

use super::limits::Limits;
use super::shutdown::Shutdown;
use super::status;
use super::turns::{CLIENT, Place, Turns, client};
use crate::budget::{self, Allowance, Budget, Stopped};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio_stream::Stream;
use tonic::Status;

/// Places for computations.
pub(super) struct Work {
    places: Arc<Turns>,
    timeout: Duration,
    allowance: Allowance,
    shutdown: Shutdown,
}

impl Work {
    /// At most `places` at once, each answered within the limit of a unary call.
    pub(super) fn new(places: usize, limits: &Limits, shutdown: Shutdown) -> Self {
        let places = Turns::new(places);
        Self { places, timeout: limits.request_timeout, allowance: allowance(limits), shutdown }
    }

    /// How many computations wait for a place.
    pub(super) fn waiting(&self) -> usize {
        self.places.waiting()
    }

    /// Waits for a place, in the turn of the client at hand.
    pub(super) async fn place(&self) -> Result<Place, Status> {
        tokio::select! {
            place = self.places.place(client().number) => Ok(place),
            () = tokio::time::sleep(self.timeout) => Err(self.late("waiting for its turn")),
            () = self.shutdown.ending.cancelled() => Err(status::stopping()),
        }
    }

    /// Waits for a place as long as it takes, for a computation that gave its own back; none when the server stops.
    pub(super) async fn again(&self, client: u64) -> Option<Place> {
        tokio::select! {
            place = self.places.place(client) => Some(place),
            () = self.shutdown.ending.cancelled() => None,
        }
    }

    /// A budget without a deadline, for a computation that is not a unary call.
    pub(super) fn budget(&self) -> Budget {
        Budget::new(of_client(self.allowance.clone()))
    }

    /// Runs `job` on a thread of its own. It is stopped when its time is over, when the server stops, and when nobody
    /// waits for it any more, which drops this future.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        job: impl FnOnce() -> Result<T, Status> + Send + 'static,
    ) -> Result<T, Status> {
        self.run_with(|budget| guarded(budget, job)).await
    }

    /// The same for a job that enters its budget itself.
    pub(super) async fn run_with<T: Send + 'static>(
        &self,
        job: impl FnOnce(&Budget) -> Result<T, Status> + Send + 'static,
    ) -> Result<T, Status> {
        let place = self.place().await?;
        let deadline = Some(Instant::now() + self.timeout);
        let budget = Budget::new(Allowance { deadline, ..of_client(self.allowance.clone()) });
        let guard = CancelOnDrop(budget.clone());
        let (span, client) = (tracing::Span::current(), client());
        let running = tokio::task::spawn_blocking(move || {
            let _place = place;
            CLIENT.sync_scope(client, || span.in_scope(|| job(&budget)))
        });
        tokio::select! {
            answer = running => answer.unwrap_or_else(|_| Err(status::fault())).map_err(|status| self.told(status)),
            () = tokio::time::sleep(self.timeout) => {
                guard.0.late();
                Err(self.late("computing"))
            }
            () = self.shutdown.ending.cancelled() => Err(status::stopping()),
        }
    }

    /// A computation that noticed its deadline itself says the same as one that did not.
    fn told(&self, status: Status) -> Status {
        if status.code() == tonic::Code::DeadlineExceeded { self.late("computing") } else { status }
    }

    fn late(&self, doing: &str) -> Status {
        let seconds = self.timeout.as_secs_f64();
        Status::deadline_exceeded(format!("still {doing} after {seconds} s, the limit of this server for one call"))
    }
}

/// The same, drawn on what the client at hand has.
pub(super) fn of_client(allowance: Allowance) -> Allowance {
    Allowance { purse: client().account.map(|account| Arc::clone(&account.purse)), ..allowance }
}

/// What one computation may use.
pub(super) fn allowance(limits: &Limits) -> Allowance {
    Allowance {
        bytes: limits.memory,
        unknowns: limits.unknowns,
        mode_work: limits.mode_work,
        cpu: Some(limits.cpu),
        ..Allowance::default()
    }
}

/// Stops a computation that nobody waits for any more.
pub(super) struct CancelOnDrop(pub(super) Budget);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

/// A stream of results that stops its computation when its reader is gone.
pub(super) struct Results<S> {
    stream: S,
    _guard: CancelOnDrop,
}

impl<S> Results<S> {
    /// The results of what runs under `budget`.
    pub(super) fn new(stream: S, budget: Budget) -> Self {
        Self { stream, _guard: CancelOnDrop(budget) }
    }
}

impl<S: Stream + Unpin> Stream for Results<S> {
    type Item = S::Item;

    fn poll_next(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        Pin::new(&mut self.stream).poll_next(cx)
    }
}

/// Runs `job` under a budget, and turns a panic into INTERNAL: one bad request must not end the others.
pub(super) fn guarded<T>(budget: &Budget, job: impl FnOnce() -> Result<T, Status>) -> Result<T, Status> {
    match caught(budget, job) {
        Some(Ok(answer)) => answer,
        Some(Err(why)) => Err(status::stopped(why)),
        None => {
            tracing::error!("internal fault: one call has no answer");
            Err(status::fault())
        }
    }
}

/// Runs `job` under a budget; none when it panicked.
pub(super) fn caught<T>(budget: &Budget, job: impl FnOnce() -> T) -> Option<Result<T, Stopped>> {
    catch_unwind(AssertUnwindSafe(|| budget::within(budget, job))).ok()
}
