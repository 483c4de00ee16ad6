//! Computations that take their time: off the event loop, a few at once, each under a budget.
//!
//! A computation first has [`SLICE`] in a place for short ones. A longer one is stopped there and repeated with a
//! permit for long ones. This changes only its time, since computations are pure until they end. So a call of a
//! millisecond waits for slices of others, not for their minutes. A connection with a computation that is known to be
//! long has no slices meanwhile.

use super::fair_semaphore::{CLIENT, FairSemaphore, Permit, Waiter, client};
use super::limits::Limits;
use super::shutdown::Shutdown;
use super::status;
use bimorph_base::budget::{self, Allowance, Budget, Stopped};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio_stream::Stream;
use tonic::Status;

/// Wall time of a computation in a place for short ones.
const SLICE: Duration = Duration::from_millis(30);
/// Processor time of a slice below which a computation was kept from the processor by others, and gets another slice.
const STARVED: Duration = Duration::from_millis(8);

/// Places for computations.
pub(super) struct ComputePermits {
    places: Arc<FairSemaphore>,
    /// Places for short ones; none: there are no slices.
    short: Option<Arc<FairSemaphore>>,
    long: Arc<LongComputations>,
    timeout: Duration,
    allowance: Allowance,
    shutdown: Shutdown,
}

/// Connections whose computations are known to be long, and how many each has.
#[derive(Default)]
struct LongComputations(Mutex<BTreeMap<u64, usize>>);

/// A computation that is known to be long, until it ends.
struct LongComputation {
    long: Arc<LongComputations>,
    number: u64,
}

/// Outcome of a computation.
struct ComputationOutcome<T> {
    answer: Result<T, Status>,
    /// Whether it was stopped by its time limit.
    is_late: bool,
    /// Processor time of one that was.
    cpu: Option<Duration>,
}

impl LongComputations {
    fn has(&self, number: u64) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).contains_key(&number)
    }

    fn enter(self: &Arc<Self>, number: u64) -> LongComputation {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner).entry(number).or_default() += 1;
        LongComputation { long: Arc::clone(self), number }
    }
}

impl Drop for LongComputation {
    fn drop(&mut self) {
        let mut long = self.long.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(count) = long.get_mut(&self.number) {
            *count -= 1;
            if *count == 0 {
                long.remove(&self.number);
            }
        }
    }
}

impl ComputePermits {
    /// At most `places` long ones at once and one more of each client that has none, each answered within the limit of a unary call.
    pub(super) fn new(places: usize, limits: &Limits, shutdown: Shutdown) -> Self {
        let (places, long) = (FairSemaphore::and_own(places), Arc::default());
        Self { places, short: None, long, timeout: limits.request_timeout, allowance: allowance(limits), shutdown }
    }

    /// The same with as many places for short ones.
    pub(super) fn sliced(places: usize, limits: &Limits, shutdown: Shutdown) -> Self {
        Self { short: Some(FairSemaphore::new(places)), ..Self::new(places, limits, shutdown) }
    }

    /// How many computations wait for a place.
    pub(super) fn waiting(&self) -> usize {
        self.places.waiting() + self.short.as_ref().map_or(0, |short| short.waiting())
    }

    /// Waits for a place, in the turn of the client at hand.
    pub(super) async fn place(&self) -> Result<Permit, Status> {
        self.place_of(&self.places, client().party(), Instant::now() + self.timeout).await
    }

    async fn place_of(&self, places: &Arc<FairSemaphore>, party: Waiter, deadline: Instant) -> Result<Permit, Status> {
        tokio::select! {
            place = places.place(party) => Ok(place),
            () = tokio::time::sleep_until(deadline.into()) => Err(self.late("waiting for its turn")),
            () = self.shutdown.ending.cancelled() => Err(status::stopping()),
        }
    }

    /// Waits for a place as long as it takes, for a computation that gave its own back; none when the server stops.
    pub(super) async fn again(&self, party: Waiter) -> Option<Permit> {
        tokio::select! {
            place = self.places.place(party) => Some(place),
            () = self.shutdown.ending.cancelled() => None,
        }
    }

    /// A budget without a deadline, for a computation that is not a unary call.
    pub(super) fn budget(&self) -> Budget {
        Budget::new(of_client(self.allowance.clone()))
    }

    /// Runs `job` on a thread of its own. It is stopped by its time limit, by the shutdown of the server, and when the
    /// caller drops this future. It may be stopped and run anew, so it must be pure until it ends.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        job: impl Fn() -> Result<T, Status> + Send + Sync + 'static,
    ) -> Result<T, Status> {
        self.run_with(move |budget| guarded(budget, &job)).await
    }

    /// The same for a job that enters its budget itself.
    pub(super) async fn run_with<T: Send + 'static>(
        &self,
        job: impl Fn(&Budget) -> Result<T, Status> + Send + Sync + 'static,
    ) -> Result<T, Status> {
        let deadline = Instant::now() + self.timeout;
        let (party, job) = (client().party(), Arc::new(job));
        while let Some(short) = self.short.as_ref().filter(|_| !self.long.has(party.number)) {
            let place = self.place_of(short, party.clone(), deadline).await?;
            // others of its connection may have turned out to be long while it waited
            if self.long.has(party.number) {
                break;
            }
            let end = deadline.min(Instant::now() + SLICE);
            let ComputationOutcome { answer, is_late, cpu } =
                self.compute(Arc::clone(&job), place, end, deadline).await?;
            if !is_late || end == deadline {
                return answer.map_err(|status| self.reported(status));
            }
            if cpu.is_none_or(|cpu| cpu >= STARVED) {
                break;
            }
        }
        let _known = self.short.as_ref().map(|_| self.long.enter(party.number));
        let place = self.place_of(&self.places, party, deadline).await?;
        let ComputationOutcome { answer, .. } = self.compute(job, place, deadline, deadline).await?;
        answer.map_err(|status| self.reported(status))
    }

    /// Computes in a place until `end`.
    async fn compute<T: Send + 'static>(
        &self,
        job: Arc<impl Fn(&Budget) -> Result<T, Status> + Send + Sync + 'static>,
        place: Permit,
        end: Instant,
        deadline: Instant,
    ) -> Result<ComputationOutcome<T>, Status> {
        let budget = Budget::new(Allowance { deadline: Some(end), ..of_client(self.allowance.clone()) });
        let guard = CancelOnDrop(budget.clone());
        let (span, client) = (tracing::Span::current(), client());
        let running = tokio::task::spawn_blocking(move || {
            let _place = place;
            let before = budget::thread_cpu();
            let answer = CLIENT.sync_scope(client, || span.in_scope(|| job(&budget)));
            let is_late = budget.is_late();
            let cpu = before.filter(|_| is_late).and_then(|before| Some(budget::thread_cpu()?.saturating_sub(before)));
            ComputationOutcome { answer, is_late, cpu }
        });
        tokio::select! {
            answer = running => answer.map_err(|_| status::fault()),
            () = tokio::time::sleep_until(deadline.into()) => {
                guard.0.expire();
                Err(self.late("computing"))
            }
            () = self.shutdown.ending.cancelled() => Err(status::stopping()),
        }
    }

    /// A computation that noticed its deadline itself says the same as one that did not.
    fn reported(&self, status: Status) -> Status {
        if status.code() == tonic::Code::DeadlineExceeded { self.late("computing") } else { status }
    }

    fn late(&self, doing: &str) -> Status {
        let seconds = self.timeout.as_secs_f64();
        Status::deadline_exceeded(format!("still {doing} after {seconds} s, the limit of this server for one call"))
    }
}

/// The same, drawn on what the client at hand has.
pub(super) fn of_client(allowance: Allowance) -> Allowance {
    Allowance { purse: client().account.and_then(|account| account.purse.clone()), ..allowance }
}

/// Allowance of one computation.
pub(super) fn allowance(limits: &Limits) -> Allowance {
    Allowance {
        bytes: limits.memory,
        unknowns: limits.unknowns,
        mode_work: limits.mode_work,
        cpu: Some(limits.cpu),
        ..Allowance::default()
    }
}

/// Stops a computation when its caller is gone.
pub(super) struct CancelOnDrop(pub(super) Budget);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

/// A stream of results that stops its computation when its reader is gone.
pub(super) struct CancellingStream<S> {
    stream: S,
    _guard: CancelOnDrop,
}

impl<S> CancellingStream<S> {
    /// The results of what runs under `budget`.
    pub(super) fn new(stream: S, budget: Budget) -> Self {
        Self { stream, _guard: CancelOnDrop(budget) }
    }
}

impl<S: Stream + Unpin> Stream for CancellingStream<S> {
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
