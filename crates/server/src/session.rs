//! One open device with its states: access to it, and its storage.

use super::accounts::SessionLease;
use super::fair_semaphore::client;
use super::limits::Limits;
use super::models::NamedModel;
use super::server::MakeDevice;
use super::small_signal::small_signal;
use super::snapshots;
use super::status;
use super::store::writer::{SessionWriter, forget, with_those_before};
use super::stream_request::StreamRequest;
use super::usage::Usage;
use super::work::caught;
use bimorph_base::budget::{Allowance, Budget, OwnerQuota, Stopped};
use bimorph_device::{Device, Token, TrialReply};
use bimorph_wire::convert::device as wire;
use bimorph_wire::convert::model::diagnostic_to_wire;
use bimorph_wire::proto;
use proto::device_reply::Kind as ReplyKind;
use std::panic::catch_unwind;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tonic::{Code, Status};

/// One device with its states.
pub(super) struct Session {
    pub(super) id: String,
    /// Held, so that it is here as long as the session is.
    model: Arc<NamedModel>,
    pub(super) device: Mutex<Box<dyn Device>>,
    pub(super) description: Mutex<proto::DeviceDescription>,
    /// Whether a trial is likely to be short enough to run where its request arrives.
    inline: bool,
    /// Requests that go to a thread before the next inline attempt.
    slow: AtomicU32,
    /// Held during long work on the device.
    turn: Arc<Semaphore>,
    pub(super) usage: Usage,
    /// Budget of the current run of this session.
    run: Mutex<Option<Budget>>,
    closed: AtomicBool,
    /// Its lease in the account of the client that opened it, where that is bounded.
    pub(super) seat: Mutex<Option<SessionLease>>,
    /// Quota of its trials.
    purse: Option<Arc<OwnerQuota>>,
    /// Where its accepted states are kept, if they are to outlive the server.
    keeper: Option<Arc<Mutex<SessionWriter>>>,
    /// The last accepted state that is kept; 0: none yet.
    accepted: AtomicU64,
    /// An accepted state that could not be stored, and was not reported yet; 0: none.
    due: AtomicU64,
    /// Warnings of accepted states for the next reply, and the state that was evaluated last (0: none).
    warnings: Mutex<(Vec<proto::Diagnostic>, u64)>,
}

/// A request that needs a thread.
pub(super) struct NeedsThread;

/// Longest computation where requests arrive.
const SLICE: Duration = Duration::from_millis(5);
/// Most warnings that wait for a reply.
const MAX_WARNINGS: usize = 64;
/// After a long one, so many requests go to a thread at once.
const AFTER_SLOW: u32 = 64;

impl Session {
    /// A session with a device that is not open yet; with a keeper its accepted states are kept. It is unreachable
    /// until it is in [`super::sessions::SessionRegistry`].
    pub(super) fn new(
        id: String,
        keeper: Option<SessionWriter>,
        model: &Arc<NamedModel>,
        make: MakeDevice,
        limits: &Limits,
    ) -> Result<Arc<Self>, Status> {
        let device = catch_unwind(|| make(Arc::clone(&model.in_circuit))).map_err(|_| status::fault())?;
        let seat = client().account.map(|account| account.seat(model.unknowns())).transpose()?;
        Ok(Arc::new(Self {
            id,
            purse: seat.as_ref().and_then(SessionLease::purse),
            seat: Mutex::new(seat),
            accepted: AtomicU64::new(keeper.as_ref().map_or(0, |keeper| keeper.accepted)),
            keeper: keeper.map(|keeper| Arc::new(Mutex::new(keeper))),
            model: Arc::clone(model),
            device: Mutex::new(device),
            description: Mutex::default(),
            slow: AtomicU32::new(0),
            turn: Arc::new(Semaphore::new(1)),
            inline: model.unknowns() <= limits.inline_unknowns,
            usage: Usage::default(),
            run: Mutex::default(),
            closed: AtomicBool::new(false),
            due: AtomicU64::new(0),
            warnings: Mutex::default(),
        }))
    }

    /// A run under this budget begins, and ends another one that is under way: its next steps would push out the states of this one.
    pub(super) fn begin_run(&self, budget: &Budget) {
        let before = self.run_under_way().replace(budget.clone());
        before.iter().for_each(Budget::cancel);
    }

    /// Ends a run in progress where its next steps would evict the requested state.
    fn end_run_for(&self, question: &StreamRequest) {
        if matches!(question, StreamRequest::Trial(_)) {
            self.run_under_way().take().iter().for_each(Budget::cancel);
        }
    }

    /// The run under this budget has ended.
    pub(super) fn finish_run(&self, budget: &Budget) {
        let mut run = self.run_under_way();
        if run.as_ref().is_some_and(|run| run.is_same(budget)) {
            *run = None;
        }
    }

    fn run_under_way(&self) -> MutexGuard<'_, Option<Budget>> {
        self.run.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn id(&self) -> &str {
        &self.id
    }

    pub(super) fn model(&self) -> &Arc<NamedModel> {
        &self.model
    }

    /// Handles one request; `None` for an accept. Waits for the device. A fault inside closes this session and no
    /// other. A stop by the budget is an error, and the session continues.
    pub(super) fn answer(&self, question: &StreamRequest, budget: &Budget) -> Option<ReplyKind> {
        self.end_run_for(question);
        let device = self.device.lock().unwrap_or_else(PoisonError::into_inner);
        self.answer_with(device, question, budget).unwrap_or_else(|why| self.refuse(question, &status::stopped(why)))
    }

    /// The same where requests arrive, for which nothing may wait: answers only if the device is free and the answer takes
    /// less than `SLICE`.
    ///
    /// # Errors
    /// [`NeedsThread`]: to be asked again with [`Session::answer`], on a thread. Trials are pure, so nothing has happened.
    pub(super) fn answer_at_once(&self, question: &StreamRequest) -> Result<Option<ReplyKind>, NeedsThread> {
        // what waits for the disk waits elsewhere
        let keeps = matches!(question, StreamRequest::Open(_) | StreamRequest::Accept(..))
            || self.due.load(Ordering::Relaxed) != 0;
        if keeps && self.keeper.is_some()
            || !self.inline
            || self.slow.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1)).is_ok()
        {
            return Err(NeedsThread);
        }
        self.end_run_for(question);
        let device = match self.device.try_lock() {
            Ok(device) => device,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return Err(NeedsThread),
        };
        let deadline = Some(Instant::now() + SLICE);
        let slice = Budget::new(Allowance { deadline, ..Allowance::default() });
        // a state that was computed is accepted whatever is left
        let purse = self.purse.as_ref().filter(|_| !question.is_accept());
        if let Some(Err(why)) = purse.map(|purse| purse.check_cpu()) {
            return Ok(self.refuse(question, &status::stopped(why)));
        }
        let started = purse.map(|purse| (purse, Instant::now()));
        let answer = self.answer_with(device, question, &slice);
        // nothing waits here, so that time is processor time
        started.into_iter().for_each(|(purse, at)| purse.charge_cpu(at.elapsed()));
        answer.map_err(|_| {
            self.slow.store(AFTER_SLOW, Ordering::Relaxed);
            NeedsThread
        })
    }

    fn answer_with(
        &self,
        mut device: MutexGuard<'_, Box<dyn Device>>,
        question: &StreamRequest,
        budget: &Budget,
    ) -> Result<Option<ReplyKind>, Stopped> {
        if self.is_closed() {
            return Ok(self.refuse(question, &status::not_found("session", &self.id)));
        }
        self.usage.touch();
        match caught(budget, || self.ask(device.as_mut(), question)) {
            Some(Ok(reply)) => Ok(reply),
            Some(Err(why)) => {
                device.recover();
                Err(why)
            }
            None => {
                self.fault();
                Ok(self.refuse(question, &status::fault()))
            }
        }
    }

    fn refuse(&self, question: &StreamRequest, status: &Status) -> Option<ReplyKind> {
        (!question.is_silent()).then(|| refused(status))
    }

    fn ask(&self, device: &mut dyn Device, question: &StreamRequest) -> Option<ReplyKind> {
        if let Err(status) = self.make_up(device, question) {
            return self.refuse(question, &status);
        }
        let answer = match question {
            StreamRequest::Open(request) => {
                let own = self.model.compiled.parts.system.electrics.ports;
                let ports = if request.ports.is_empty() { own } else { request.ports.len() };
                if let Err(status) = self.take_memory(ports) {
                    return self.refuse(question, &status);
                }
                let request = wire::open_from_wire(request);
                device.open(&request).map(|description| {
                    let description = wire::description_to_wire(&description);
                    *self.description.lock().unwrap_or_else(PoisonError::into_inner) = description;
                    self.keep(device, None).map_or_else(|s| refused(&s), |_| ReplyKind::Opened(self.opened()))
                })
            }
            StreamRequest::Trial(request) => {
                let mut reply = TrialReply::default();
                wire::trial_from_wire(request)
                    .and_then(|trial| device.trial(&trial, &mut reply))
                    .map(|()| ReplyKind::Trial(wire::reply_to_wire(&mut reply)))
            }
            StreamRequest::Accept(accept, stream) => return self.accept(device, accept, *stream),
            StreamRequest::Linearize(request) => {
                small_signal(device, Token(request.token), request.omega, request.noise).map(ReplyKind::Linearized)
            }
        };
        Some(answer.unwrap_or_else(|error| ReplyKind::Fault(wire::fault_to_wire(&error))))
    }

    /// Accepts a state and keeps it. Only the last attached stream may accept: delayed messages of an earlier one must
    /// not undo later accepts.
    fn accept(&self, device: &mut dyn Device, accept: &proto::Accept, stream: u64) -> Option<ReplyKind> {
        let proto::Accept { token, answer, warn } = *accept;
        if !self.usage.is_last(stream) {
            return answer.then(|| refused(&status::overtaken(&self.id)));
        }
        device.accept(Token(token));
        let kept = self.keep(device, Some(Token(token)));
        if let Err(status) = &kept {
            tracing::warn!(session = self.id, reason = status.message(), "an accepted state is not kept");
        }
        self.due.store(if kept.is_err() && !answer { token } else { 0 }, Ordering::Relaxed);
        if warn {
            self.evaluate_warnings(device, token);
        }
        let accepted = |kept| ReplyKind::Accepted(proto::Accepted { token, kept });
        answer.then(|| kept.map_or_else(|status| refused(&status), accepted))
    }

    /// Evaluates the warnings of an accepted state, once where it is accepted again.
    fn evaluate_warnings(&self, device: &mut dyn Device, token: u64) {
        let mut pending = self.warnings.lock().unwrap_or_else(PoisonError::into_inner);
        if pending.1 != token {
            let left = MAX_WARNINGS.saturating_sub(pending.0.len());
            let found = device.warns(Token(token));
            pending.0.extend(found.iter().take(left).map(diagnostic_to_wire));
            pending.1 = token;
        }
    }

    /// Warnings of accepted states since the last call.
    pub(super) fn take_warnings(&self) -> Vec<proto::Diagnostic> {
        std::mem::take(&mut self.warnings.lock().unwrap_or_else(PoisonError::into_inner).0)
    }

    /// Keeps now what an accept without an answer could not: until that is done its stream has no later reply but the refusal.
    fn make_up(&self, device: &dyn Device, question: &StreamRequest) -> Result<(), Status> {
        let due = self.due.load(Ordering::Relaxed);
        if due == 0 || matches!(question, StreamRequest::Open(_) | StreamRequest::Accept(..)) {
            return Ok(());
        }
        let kept = self.keep(device, Some(Token(due)));
        // a state that is not held any more can never be stored: this is reported once
        if kept.as_ref().map_or_else(|status| status.code() == Code::NotFound, |_| true) {
            self.due.store(0, Ordering::Relaxed);
        }
        kept.map(|_| ())
    }

    /// Keeps an accepted state and those that a client may go back to which has not heard of it, where states are kept; without
    /// a token all that are held. Whether it did.
    fn keep(&self, device: &dyn Device, token: Option<Token>) -> Result<bool, Status> {
        let Some(keeper) = &self.keeper else { return Ok(false) };
        let mut keeper = keeper.lock().unwrap_or_else(PoisonError::into_inner);
        if self.is_closed() {
            return Err(status::not_found("session", &self.id));
        }
        let states = match token {
            None => device.save(None),
            Some(token) => with_those_before(device, token, Token(keeper.accepted)),
        };
        let states = states.map_err(|error| status::device(&error))?;
        let sealed = snapshots::seal(self.model.id(), &states);
        let accepted = token.map_or(0, |token| token.0);
        keeper.keep(accepted, &sealed).map_err(|error| status::not_kept("the state is", &error))?;
        self.accepted.store(accepted, Ordering::Relaxed);
        Ok(true)
    }

    /// Keeps it for so long without use (ms), 0: as long as any; in the server after this one too. Waits for the disk.
    pub(super) fn lease(&self, millis: u64) -> Result<(), Status> {
        if let Some(keeper) = &self.keeper {
            let mut keeper = keeper.lock().unwrap_or_else(PoisonError::into_inner);
            if self.is_closed() {
                return Err(status::not_found("session", &self.id));
            }
            keeper.lease(millis).map_err(|error| status::not_kept("the state is", &error))?;
        }
        self.usage.lease(millis);
        Ok(())
    }

    /// Keeps all states that are held, where states are kept.
    pub(super) fn keep_all(&self) -> Result<(), Status> {
        let device = self.lock()?;
        self.keep(&**device, None).map(|_| ())
    }

    pub(super) fn lock(&self) -> Result<MutexGuard<'_, Box<dyn Device>>, Status> {
        if self.is_closed() {
            return Err(status::not_found("session", &self.id));
        }
        Ok(self.device.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Waits for exclusive access to the session, without a thread; long work on its device holds it.
    pub(super) async fn acquire(&self) -> Result<OwnedSemaphorePermit, Status> {
        Arc::clone(&self.turn).acquire_owned().await.map_err(|_| status::fault())
    }

    /// Description from the last open; empty before the first.
    pub(super) fn opened(&self) -> proto::OpenResponse {
        let device = self.description.lock().unwrap_or_else(PoisonError::into_inner).clone();
        proto::OpenResponse {
            session: self.id.clone(),
            device: Some(device),
            kept: self.keeper.is_some(),
            accepted: self.accepted.load(Ordering::Relaxed),
        }
    }

    pub(super) fn is_closed(&self) -> bool {
        self.closed.load(Ordering::Relaxed)
    }

    fn end(&self) {
        self.closed.store(true, Ordering::Relaxed);
        drop(self.seat.lock().unwrap_or_else(PoisonError::into_inner).take());
    }

    /// Closes after a panic: its states may be half made. Its stored states stay, and are restored on request.
    pub(super) fn fault(&self) {
        tracing::error!(session = self.id, model = self.model.id(), "internal fault: the session is closed");
        self.end();
        if let Some(keeper) = &self.keeper {
            keeper.lock().unwrap_or_else(PoisonError::into_inner).sleep();
        }
    }

    /// Closes it; what is kept of it goes soon after.
    pub(super) fn close(&self) {
        self.end();
        let Some(keeper) = self.keeper.clone() else { return };
        let forget = move || forget(&keeper);
        match tokio::runtime::Handle::try_current() {
            Ok(runtime) => drop(runtime.spawn_blocking(forget)),
            Err(_) => forget(),
        }
    }

    /// Removes what is kept of a closed session. Waits for the disk.
    pub(super) fn forget(&self) {
        if let Some(keeper) = &self.keeper {
            forget(keeper);
        }
    }
}

/// A status as a fault on a stream that continues.
pub(super) fn refused(status: &Status) -> ReplyKind {
    let kind = proto::fault::Kind::Refused(proto::Refused { code: status.code() as i32 });
    ReplyKind::Fault(proto::Fault { kind: Some(kind), message: status.message().to_owned() })
}
