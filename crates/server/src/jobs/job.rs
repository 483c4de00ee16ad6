//! One job: what it found so far, where it stands, and its files.
//!
//! A row is finished when it is on the disk, if there is one. Only then is it reported, counted and sent. Rows that
//! come while the disk is waited for go there together.

use super::super::status;
use super::folder::{JobFile, JobOutcome};
use super::holders::JobHolders;
use super::job_origin::{JobOrigin, now_ms};
use super::job_state::{JobState, JobStopReason, state_of};
use super::rows::FinishedRows;
use super::wire;
use bimorph_base::budget::{Budget, Stopped};
use bimorph_jobs::sweep::journal::JournalRow;
use bimorph_jobs::sweep::{SweepError, SweepSpec, SweepTable};
use bimorph_wire::proto;
use proto::job_metadata::State;
use std::collections::BTreeSet;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak};
use std::time::{Duration, Instant};
use tokio::runtime::Handle;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;
use tonic::{Code, Status};

/// Pause between two waits for the disk: rows that come meanwhile go there together.
const BATCH: Duration = Duration::from_millis(20);
/// One job, running or finished.
#[derive(Debug)]
pub(super) struct Job {
    pub(super) id: String,
    pub(super) asked: JobOrigin,
    pub(super) spec: SweepSpec,
    pub(super) budget: Budget,
    options: Option<proto::CompileOptions>,
    pub(super) standing: watch::Sender<JobState>,
    /// None: on the disk alone.
    pub(super) rows: Mutex<Option<FinishedRows>>,
    /// Its table, while somebody reads it.
    pub(super) table: Mutex<Weak<SweepTable>>,
    waiting: Mutex<UnwrittenRows>,
    /// Where it is kept; none: nowhere, or not any more.
    pub(super) file: Mutex<Option<JobFile>>,
    kept: bool,
    stop: OnceLock<JobStopReason>,
    pub(super) stopped: CancellationToken,
    pub(super) used: Mutex<Instant>,
    holders: Mutex<JobHolders>,
}

/// Rows on their way to the disk.
#[derive(Debug, Default)]
struct UnwrittenRows {
    rows: Vec<JournalRow>,
    /// Whether somebody takes them there.
    carried: bool,
}

pub(super) fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Job {
    /// With the rows that it has; none: they are on the disk alone.
    pub(super) fn new(
        id: String,
        (asked, spec, options): (JobOrigin, SweepSpec, Option<proto::CompileOptions>),
        budget: Budget,
        file: Option<JobFile>,
        (rows, standing): (Option<FinishedRows>, JobState),
    ) -> Arc<Self> {
        Arc::new(Self {
            id,
            asked,
            spec,
            budget,
            options,
            standing: watch::Sender::new(standing),
            rows: Mutex::new(rows),
            table: Mutex::default(),
            waiting: Mutex::default(),
            kept: file.is_some(),
            file: Mutex::new(file),
            stop: OnceLock::new(),
            stopped: CancellationToken::new(),
            used: Mutex::new(Instant::now()),
            holders: Mutex::default(),
        })
    }

    /// Where it stands, now and later.
    pub(super) fn watch(&self) -> watch::Receiver<JobState> {
        self.standing.subscribe()
    }

    /// Where it stands.
    pub(super) fn standing(&self) -> JobState {
        self.standing.borrow().clone()
    }

    /// Whether a folder has it.
    pub(super) fn is_kept(&self) -> bool {
        self.kept
    }

    /// Whether it is running, or has ended with all of its rows, and is not being stopped.
    pub(super) fn lives(&self) -> bool {
        match self.standing.borrow().state {
            State::Done => !matches!(self.stop.get(), Some(JobStopReason::Deleted)),
            State::Cancelled | State::Failed => false,
            State::Waiting | State::Running | State::Unspecified => self.stop.get().is_none(),
        }
    }

    /// Whether this server has no more use for it: it has ended, and is not left for another one to continue.
    pub(super) fn is_over(&self) -> bool {
        let standing = self.standing.borrow();
        standing.end.is_some() && !standing.refused
    }

    /// Whether it has ended.
    pub(super) fn has_ended(&self) -> bool {
        self.standing.borrow().end.is_some()
    }

    /// A client requests it, by a connection.
    pub(super) fn touch(&self, connection: u64) {
        *held(&self.used) = Instant::now();
        held(&self.holders).take(connection);
    }

    /// Time since it was last requested.
    pub(super) fn idle(&self) -> Duration {
        held(&self.used).elapsed()
    }

    /// Cancels it where its client is gone for longer than its limit; a request in process has no limit.
    pub(super) fn check_client(&self, open: &BTreeSet<u64>) {
        let Some(release) = self.asked.release().filter(|_| !self.has_ended()) else { return };
        // a reader or a watcher keeps it
        if self.is_watched() {
            held(&self.holders).are_there();
        } else if held(&self.holders).are_gone(open).is_some_and(|time| time >= release) {
            self.stop(JobStopReason::Released(release));
        }
    }

    /// Stops it; the first reason holds.
    pub(super) fn stop(&self, why: JobStopReason) {
        // set before its points are stopped: their later results are not its rows
        let _ = self.stop.set(why);
        self.budget.cancel();
        self.stopped.cancel();
    }

    /// Keeps on the disk that it was cancelled, for a server that ends before its points have.
    ///
    /// # Errors
    /// The system's error.
    pub(super) fn keep_cancelled(&self) -> io::Result<()> {
        let file = held(&self.file);
        let standing = self.standing();
        let Some(file) = file.as_ref().filter(|_| standing.end.is_none() || standing.refused) else { return Ok(()) };
        let end = self.ending(&standing, Code::Cancelled, "cancelled".to_owned());
        file.end(&end)?;
        if standing.refused {
            self.standing.send_modify(|standing| {
                (standing.state, standing.refused) = (State::Cancelled, false);
                standing.end = Some(end);
            });
        }
        Ok(())
    }

    /// Its first point is begun.
    pub(super) fn begin(&self) {
        self.standing.send_if_modified(|standing| {
            let waits = standing.state == State::Waiting && standing.end.is_none();
            standing.state = if waits { State::Running } else { standing.state };
            waits
        });
    }

    /// A point is finished; returns whether to continue.
    pub(super) fn found(self: &Arc<Self>, kept: JournalRow, runtime: &Handle) -> bool {
        if self.stop.get().is_some() {
            return false;
        }
        if !self.kept {
            self.publish(vec![kept]);
            return true;
        }
        let mut waiting = held(&self.waiting);
        waiting.rows.push(kept);
        if !std::mem::replace(&mut waiting.carried, true) {
            let job = Arc::clone(self);
            runtime.spawn_blocking(move || job.carry());
        }
        true
    }

    /// Takes rows to the disk as long as some come.
    fn carry(&self) {
        loop {
            self.settle();
            std::thread::sleep(BATCH);
            let mut waiting = held(&self.waiting);
            if waiting.rows.is_empty() {
                waiting.carried = false;
                return;
            }
        }
    }

    /// Takes all rows to the disk that came until now. Waits for it.
    pub(super) fn settle(&self) {
        let file = held(&self.file);
        let rows = std::mem::take(&mut held(&self.waiting).rows);
        let Some(file) = file.as_ref().filter(|_| !rows.is_empty()) else { return };
        match file.append(&rows) {
            Ok(()) => self.publish(rows),
            Err(error) => {
                tracing::warn!(%error, job = self.id, "its rows cannot be kept");
                self.stop(JobStopReason::Disk(error));
            }
        }
    }

    fn publish(&self, found: Vec<JournalRow>) {
        let mut rows = held(&self.rows);
        let rows = rows.get_or_insert_default();
        found.into_iter().for_each(|kept| rows.push(kept));
        let (all, failed) = (rows.len(), rows.failed());
        self.standing.send_modify(|standing| (standing.rows, standing.failed) = (all, failed));
    }

    /// Points that have a row; the bytes of these rows are taken from its budget.
    ///
    /// # Errors
    /// [`SweepError`] where it has no room for them.
    pub(super) fn points(&self) -> Result<BTreeSet<usize>, SweepError> {
        let rows = held(&self.rows);
        let bytes = rows.iter().map(FinishedRows::bytes).sum();
        self.budget.take(bytes).map_err(|why| match why {
            Stopped::Bytes { most, .. } => SweepError::TooLarge { most },
            why => SweepError::Owner(why),
        })?;
        Ok(rows.iter().flat_map(FinishedRows::points).collect())
    }

    fn ending(&self, standing: &JobState, code: Code, message: String) -> JobOutcome {
        let JobState { rows, failed, .. } = *standing;
        JobOutcome { code: code as i32, message, rows, failed, ended_ms: now_ms(), bytes: 0 }
    }

    /// It is over: with all of its rows, for the reason that it was stopped for, or for what `why` says.
    pub(super) fn finish(&self, why: Option<Status>) {
        self.settle();
        let standing = self.standing();
        let stop = self.stop.get();
        let failure = match (stop, why) {
            _ if standing.rows == self.asked.points => None,
            (Some(JobStopReason::Suspended), _) if self.kept => {
                self.standing.send_modify(|standing| standing.suspended = true);
                return;
            }
            (Some(stop), _) => Some(stop.reported()),
            (None, Some(status)) => Some(status),
            (None, None) => Some(status::fault()),
        };
        let failure = failure.unwrap_or_else(|| Status::new(Code::Ok, ""));
        self.end(self.ending(&standing, failure.code(), failure.message().to_owned()));
    }

    /// It has ended so. Its reported rows are on the disk by then, as far as there is space.
    pub(super) fn end(&self, end: JobOutcome) {
        // held until it is reported, so that no other outcome is stored after this one
        let mut file = held(&self.file);
        if let Some(file) = file.as_mut() {
            if let Err(error) = file.end(&end) {
                tracing::warn!(%error, job = self.id, "its end cannot be kept: after a restart it continues");
            }
            file.close();
        }
        *held(&self.used) = Instant::now();
        self.standing.send_modify(|standing| {
            standing.state = state_of(end.code);
            standing.end = Some(end);
        });
        drop(file);
        self.unload();
    }

    /// This server does not continue it. That is not kept: another one may.
    pub(super) fn refuse(&self, why: &Status) {
        let end = self.ending(&self.standing(), why.code(), why.message().to_owned());
        if let Some(file) = held(&self.file).as_mut() {
            file.close();
        }
        self.standing.send_modify(|standing| {
            (standing.state, standing.refused) = (state_of(end.code), true);
            standing.end = Some(end);
        });
        self.unload();
    }

    /// Comes back when nothing of it is computed any more.
    pub(super) async fn quiet(&self) {
        let over = |standing: &JobState| standing.end.is_some() || standing.suspended;
        // the sender is there as long as the job
        let _ = self.watch().wait_for(over).await;
    }

    /// Releases its files, which another server may take over.
    pub(super) fn release(&self) {
        drop(held(&self.file).take());
    }

    /// Stops and removes it, with its files.
    pub(super) fn delete(&self) {
        self.stop(JobStopReason::Deleted);
        if let Some(file) = held(&self.file).take() {
            file.remove();
        }
        self.standing.send_modify(|standing| standing.gone = true);
    }

    /// True while a stream of its rows, or of where it stands, is open.
    pub(super) fn is_watched(&self) -> bool {
        self.standing.receiver_count() > 0
    }

    /// As it travels, without the options of the model, which may be long.
    pub(super) fn to_wire(&self) -> proto::Job {
        let provenance = wire::provenance(&self.asked, &self.spec);
        wire::job(&self.id, &self.asked, provenance, (&self.standing(), self.kept))
    }

    /// As it travels, with all that it comes from.
    pub(super) fn to_wire_whole(&self) -> proto::Job {
        let provenance =
            proto::Provenance { options: self.options.clone(), ..wire::provenance(&self.asked, &self.spec) };
        wire::job(&self.id, &self.asked, provenance, (&self.standing(), self.kept))
    }
}
