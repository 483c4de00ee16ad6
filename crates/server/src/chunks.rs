//! Long answers in messages of at most 1 MiB.

use super::fair_semaphore::{Permit, Waiter};
use super::pace::{CHUNK_BYTES, HEARTBEAT};
use super::shared::ServerState;
use super::status;
use bimorph_analysis::chosen_run::{FittedRun, run_as_chosen};
use bimorph_analysis::mesh;
use bimorph_analysis::step_error::{self, with_step_error};
use bimorph_analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph_analysis::{AnalysisError, ProgressCallback};
use bimorph_model::compile::CompiledModel;
use bimorph_wire::convert::analysis::summary_to_wire;
use bimorph_wire::proto;
use proto::transient_event::Kind;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::runtime::Handle;
use tokio::sync::mpsc;
use tonic::Status;

/// Samples are sent at least this often, so that a slow run is seen to move.
const LIVELINESS: Duration = Duration::from_millis(200);

/// Where the messages of a stream go: one at a time, never waiting for a silent client longer than the idle limit.
pub(super) struct MessageSink<T> {
    sender: mpsc::Sender<Result<T, Status>>,
    shared: Arc<ServerState>,
    runtime: Handle,
    /// Permit of the computation; released while a reader is slow, so that others continue.
    place: Option<Permit>,
    pub(super) open: bool,
}

impl<T> MessageSink<T> {
    /// An outlet, used from a blocking thread, and what the client reads.
    pub(super) fn new(shared: Arc<ServerState>) -> (Self, mpsc::Receiver<Result<T, Status>>) {
        let (sender, receiver) = mpsc::channel(2);
        (Self { sender, shared, runtime: Handle::current(), place: None, open: true }, receiver)
    }

    /// The same for a computation that takes a place.
    pub(super) fn with_place(self, place: Permit) -> Self {
        Self { place: Some(place), ..self }
    }

    /// Sends an item, or detects that the receiver is gone.
    pub(super) fn send(&mut self, item: Result<T, Status>) {
        let (sender, shared) = (&self.sender, &self.shared);
        let item = match sender.try_send(item) {
            Ok(()) => return,
            Err(mpsc::error::TrySendError::Full(item)) => item,
            Err(mpsc::error::TrySendError::Closed(_)) => {
                self.open = false;
                return;
            }
        };
        let party = self.place.take().map(|place| place.party());
        self.open = self.open
            && self.runtime.block_on(async {
                tokio::select! {
                    sent = sender.send_timeout(item, shared.limits.idle) => sent.is_ok(),
                    () = shared.shutdown.ending.cancelled() => false,
                }
            });
        let shared = Arc::clone(shared);
        if let Some(party) = party.filter(|_| self.open) {
            self.place_again(party);
        }
        if shared.shutdown.ending.is_cancelled() {
            let _ = self.sender.try_send(Err(status::stopping()));
        }
    }

    fn place_again(&mut self, party: Waiter) {
        let (sender, shared) = (&self.sender, &self.shared);
        self.place = self.runtime.block_on(async {
            tokio::select! {
                place = shared.work.again(party) => place,
                () = sender.closed() => None,
            }
        });
    }

    /// Lets waiting tasks run before it continues.
    pub(super) fn give_way(&mut self) {
        if self.shared.work.waiting() > 0
            && let Some(place) = self.place.take()
        {
            let party = place.party();
            drop(place);
            self.place_again(party);
        }
    }

    /// A second sender to the same reader, for messages after the first is gone.
    pub(super) fn also(&self) -> Self {
        Self {
            sender: self.sender.clone(),
            shared: Arc::clone(&self.shared),
            runtime: self.runtime.clone(),
            place: None,
            open: true,
        }
    }

    /// Whether anyone still reads.
    pub(super) fn wanted(&self) -> bool {
        self.open && !self.sender.is_closed() && !self.shared.shutdown.ending.is_cancelled()
    }
}

/// Runs a transient and sends its samples as they come.
pub(super) fn send_transient(
    compiled: &CompiledModel,
    options: &TransientOptions<'_>,
    outlet: MessageSink<proto::TransientEvent>,
) {
    let width = options.signals.len();
    let rows = (CHUNK_BYTES / 2 / (8 * (width + 1))).max(1);
    let outlet = std::cell::RefCell::new(outlet);
    let progress = std::cell::Cell::new(0.0);
    let quiet = std::cell::Cell::new(Instant::now());
    let mut pending = Pending { t: Vec::new(), columns: vec![Vec::new(); width], since: Instant::now() };
    let mut sample = |t: f64, values: &[f64]| {
        pending.push(t, values);
        if pending.t.len() >= rows || pending.since.elapsed() >= LIVELINESS {
            quiet.set(Instant::now());
            outlet.borrow_mut().send(Ok(pending.take(progress.get())));
        }
    };
    let mut watch = |fraction: f64| {
        progress.set(fraction);
        if quiet.get().elapsed() >= HEARTBEAT {
            quiet.set(Instant::now());
            outlet.borrow_mut().send(Ok(proto::TransientEvent { kind: None, progress: fraction }));
        }
        outlet.borrow().wanted()
    };
    let mut attempt = |FittedRun { moving, start, .. }: FittedRun,
                       sample: &mut dyn FnMut(f64, &[f64]),
                       watch: ProgressCallback<'_>| {
        let options = options.with_release(start.as_ref());
        let run: step_error::RunFunction<'_, ()> =
            &mut |options, sample, watch| transient(&moving, options, sample, watch).map(|r| (r, ()));
        let (mut result, ()) = with_step_error(&options, &moving, run, sample, watch)?;
        result.warnings.extend(mesh::warnings(&moving));
        Ok((result, ()))
    };
    let result = run_as_chosen(compiled, options, &mut attempt, &mut sample, &mut watch).map(|(result, ())| result);
    let mut outlet = outlet.into_inner();
    if !pending.t.is_empty() {
        outlet.send(Ok(pending.take(progress.get())));
    }
    outlet.send(finish(result, &outlet));
}

fn finish(
    result: Result<TransientResult, AnalysisError>,
    outlet: &MessageSink<proto::TransientEvent>,
) -> Result<proto::TransientEvent, Status> {
    match result {
        Ok(result) => Ok(proto::TransientEvent { kind: Some(Kind::Finished(summary_to_wire(&result))), progress: 1.0 }),
        Err(AnalysisError::Cancelled) if outlet.shared.shutdown.ending.is_cancelled() => Err(status::stopping()),
        Err(error) => Err(status::analysis(error)),
    }
}

/// Samples not yet sent.
struct Pending {
    t: Vec<f64>,
    columns: Vec<Vec<f64>>,
    since: Instant,
}

impl Pending {
    fn push(&mut self, t: f64, values: &[f64]) {
        self.t.push(t);
        for (column, value) in self.columns.iter_mut().zip(values) {
            column.push(*value);
        }
    }

    fn take(&mut self, progress: f64) -> proto::TransientEvent {
        self.since = Instant::now();
        let t = std::mem::take(&mut self.t);
        let signals = self.columns.iter_mut().map(|column| proto::Column { values: std::mem::take(column) }).collect();
        proto::TransientEvent { kind: Some(Kind::Samples(proto::Samples { t, signals })), progress }
    }
}
