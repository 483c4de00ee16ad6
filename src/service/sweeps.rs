//! Sweeps that run while clients come and go.

use super::convert::Violation;
use super::ids::Ids;
use super::limits::Limits;
use super::work::{allowance, caught, of_client};
use super::{proto, status};
use crate::budget::Budget;
use crate::compile::CompileOptions;
use crate::content::Fnv;
use crate::jobs::sweep::{self, SweepError, SweepProgress, SweepSpec, SweepTable};
use crate::netlist::Bundle;
use prost::Message;
use proto::sweep_status::State;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use tokio::runtime::Handle;
use tokio::sync::{Semaphore, watch};
use tonic::Status;

/// Longest name that a client gives to its request [byte].
const LONGEST_REQUEST: usize = 64;

/// What a client calls its request, and what it asked for.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Asked {
    request: String,
    content: Fnv,
}

impl Asked {
    /// Named by the client; none: it gave no name.
    pub(super) fn by(request: &str) -> Result<Option<Self>, Violation> {
        if request.len() > LONGEST_REQUEST || !request.bytes().all(|byte| byte.is_ascii_graphic()) {
            let text =
                format!("expected at most {LONGEST_REQUEST} visible ASCII characters, got {} bytes", request.len());
            return Err(Violation::new("request_id", text));
        }
        Ok((!request.is_empty()).then(|| Self { request: request.to_owned(), content: Fnv::default() }))
    }

    /// For this.
    pub(super) fn with(mut self, spec: Option<&proto::SweepSpec>, bundle: &Bundle, options: &CompileOptions) -> Self {
        self.content.model(bundle, options);
        self.content.bytes(&spec.map(Message::encode_to_vec).unwrap_or_default());
        self
    }
}

/// One sweep, running or finished.
pub(super) struct Sweep {
    asked: Option<Asked>,
    status: watch::Sender<proto::SweepStatus>,
    table: OnceLock<SweepTable>,
    budget: Budget,
    cancelled: AtomicBool,
    used: Mutex<Instant>,
}

impl Sweep {
    /// Its progress, now and later.
    pub(super) fn watch(&self) -> watch::Receiver<proto::SweepStatus> {
        self.status.subscribe()
    }

    /// Its table, once it is done.
    pub(super) fn table(&self) -> Option<&SweepTable> {
        self.table.get()
    }

    /// Where it stands.
    pub(super) fn status(&self) -> proto::SweepStatus {
        self.status.borrow().clone()
    }

    fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
        self.budget.cancel();
    }

    fn progress(&self, progress: SweepProgress) -> bool {
        self.status.send_modify(|status| {
            // Points finish on many threads; the counts a client sees never go back.
            status.done = status.done.max(progress.done);
            status.failed = status.failed.max(progress.failed);
        });
        !self.cancelled.load(Ordering::Relaxed)
    }

    fn finish(&self, outcome: Result<SweepTable, SweepError>) {
        let (state, message) = match outcome {
            Ok(table) => {
                let _ = self.table.set(table);
                (State::Done, String::new())
            }
            Err(SweepError::Cancelled { .. }) => (State::Cancelled, "cancelled".to_owned()),
            Err(error) => (State::Failed, error.to_string()),
        };
        *self.used.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        self.status.send_modify(|status| {
            status.state = state.into();
            status.message = message;
        });
    }

    fn running(&self) -> bool {
        self.status.borrow().state() == State::Running
    }
}

/// The sweeps of a server.
pub(super) struct Sweeps {
    kept: Mutex<BTreeMap<String, Arc<Sweep>>>,
    /// A sweep uses every core, so one runs at a time and the others wait.
    turn: Arc<Semaphore>,
    ids: Ids,
    runtime: Handle,
}

impl Sweeps {
    /// No sweeps yet.
    pub(super) fn new() -> Self {
        let turn = Arc::new(Semaphore::new(1));
        Self { kept: Mutex::default(), turn, ids: Ids::default(), runtime: Handle::current() }
    }

    fn kept(&self) -> MutexGuard<'_, BTreeMap<String, Arc<Sweep>>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The sweep that was asked for before, and its points.
    fn asked(&self, asked: Option<&Asked>) -> Result<Option<(String, u64)>, Status> {
        already(&self.kept(), asked)
    }

    /// Sweeps kept, running or finished.
    pub(super) fn len(&self) -> usize {
        self.kept().len()
    }

    /// Starts a sweep; its id and its points. What was asked before, by the same name, is not started again.
    pub(super) fn submit(
        &self,
        spec: SweepSpec,
        bundle: Bundle,
        options: CompileOptions,
        asked: Option<Asked>,
        limits: &Limits,
    ) -> Result<(String, u64), Status> {
        if let Some(before) = self.asked(asked.as_ref())? {
            return Ok(before);
        }
        let violation = |error: SweepError| status::bad_request(&error.to_string(), [spec_violation(&error)]);
        let points = spec.grid_points().map_err(violation)?;
        if points > limits.sweep_points {
            return Err(status::limit("sweep_points", limits.sweep_points, points));
        }
        let points = spec.point_numbers().map_err(violation)?.len() as u64;
        sweep::check_names(&spec, &bundle, &options).map_err(violation)?;
        let first = proto::SweepStatus { state: State::Running.into(), points, ..Default::default() };
        let sweep = Arc::new(Sweep {
            asked,
            status: watch::Sender::new(first),
            table: OnceLock::new(),
            budget: Budget::new(of_client(allowance(limits))),
            cancelled: AtomicBool::new(false),
            used: Mutex::new(Instant::now()),
        });
        let id = self.ids.make()?;
        {
            let mut kept = self.kept();
            if let Some(before) = already(&kept, sweep.asked.as_ref())? {
                return Ok(before);
            }
            if kept.len() >= limits.sweeps {
                return Err(status::limit("sweeps", limits.sweeps, "one more; cancel one that is no longer needed"));
            }
            kept.insert(id.clone(), Arc::clone(&sweep));
        }
        let turn = Arc::clone(&self.turn);
        self.runtime.spawn(async move {
            let _turn = turn.acquire_owned().await;
            let ran = Arc::clone(&sweep);
            let job = tokio::task::spawn_blocking(move || {
                let run = || sweep::run(&spec, &bundle, &options, &|progress| ran.progress(progress));
                match caught(&ran.budget, run) {
                    Some(Ok(outcome)) => ran.finish(outcome),
                    Some(Err(_)) => ran.finish(Err(SweepError::Cancelled { done: 0, points })),
                    None => ran.finish(Err(SweepError::Threads { reason: "internal fault".to_owned() })),
                }
            });
            let _ = job.await;
        });
        Ok((id, points))
    }

    /// The sweep of that id.
    pub(super) fn get(&self, id: &str) -> Result<Arc<Sweep>, Status> {
        let kept = self.kept();
        let sweep = kept.get(id).cloned().ok_or_else(|| status::not_found("sweep", id))?;
        *sweep.used.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        Ok(sweep)
    }

    /// Stops and forgets a sweep.
    pub(super) fn cancel(&self, id: &str) -> Result<(), Status> {
        let removed = self.kept().remove(id);
        removed.map(|sweep| sweep.cancel()).ok_or_else(|| status::not_found("sweep", id))
    }

    /// Stops all.
    pub(super) fn cancel_all(&self) {
        let kept = self.kept();
        kept.values().for_each(|sweep| sweep.cancel());
    }

    /// Forgets finished sweeps that nobody asked for during `idle`; how many.
    pub(super) fn expire(&self, idle: Duration) -> usize {
        let mut kept = self.kept();
        let before = kept.len();
        kept.retain(|_, sweep| {
            sweep.running() || sweep.used.lock().unwrap_or_else(PoisonError::into_inner).elapsed() < idle
        });
        before - kept.len()
    }
}

/// Among those that are kept, the one that was asked for by the same name.
fn already(kept: &BTreeMap<String, Arc<Sweep>>, asked: Option<&Asked>) -> Result<Option<(String, u64)>, Status> {
    let Some(asked) = asked else { return Ok(None) };
    let same =
        |sweep: &Sweep| sweep.asked.as_ref().filter(|before| before.request == asked.request).map(|b| b == asked);
    match kept.iter().find_map(|(id, sweep)| same(sweep).map(|same| (id, sweep, same))) {
        Some((_, _, false)) => {
            let text = "expected a name of its own, got that of another sweep; choose them at random";
            Err(status::violation(Violation::new("request_id", text)))
        }
        found => Ok(found.map(|(id, sweep, _)| (id.clone(), sweep.status().points))),
    }
}

fn spec_violation(error: &SweepError) -> Violation {
    let field = match error {
        SweepError::BadSpec { what, .. } => format!("spec.{what}"),
        _ => "spec".to_owned(),
    };
    Violation::new(field, error.to_string())
}
