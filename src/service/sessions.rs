//! Open devices: who may ask them, how many there are, and when one is forgotten.

use super::convert::device as wire;
use super::ids::Ids;
use super::keeper::{Keeper, Kept};
use super::limits::Limits;
use super::models::Model;
use super::server::MakeDevice;
use super::snapshots;
use super::store::Store;
use super::work::caught;
use super::{proto, status};
use crate::budget::{self, Allowance, Budget, Stopped};
use crate::device::{Device, DeviceError, SmallSignal, Token, TrialReply};
use proto::device_reply::Kind as ReplyKind;
use std::collections::BTreeMap;
use std::panic::catch_unwind;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tonic::Status;

/// One device with its states.
pub(super) struct Session {
    id: String,
    model: String,
    device: Mutex<Box<dyn Device>>,
    description: Mutex<proto::DeviceDescription>,
    /// Whether a trial is likely to be short enough to run where its request arrives.
    inline: bool,
    /// Questions that go to a thread before the next try.
    slow: AtomicU32,
    /// Held by who works on the device for long.
    turn: Arc<Semaphore>,
    started: Instant,
    used_ms: AtomicU64,
    /// 0: none was asked for.
    lease_ms: AtomicU64,
    closed: AtomicBool,
    /// Streams that hold this session.
    streams: AtomicUsize,
    /// Where its accepted states are kept, if they are to outlive the server.
    keeper: Option<Arc<Mutex<Keeper>>>,
    /// The last accepted state that is kept; 0: none yet.
    accepted: AtomicU64,
}

/// A question that needs a thread.
pub(super) struct Later;

/// Longest computation where requests arrive.
const SLICE: Duration = Duration::from_millis(5);
/// After one that took longer, so many questions go to a thread at once.
const AFTER_SLOW: u32 = 64;

/// What a stream asks of its session.
pub(super) enum Question {
    Open(proto::OpenRequest),
    Trial(proto::TrialRequest),
    Accept(proto::Accept),
    Linearize(proto::SmallSignalRequest),
}

impl Question {
    /// Whether it has no answer.
    pub(super) fn is_silent(&self) -> bool {
        matches!(self, Self::Accept(accept) if !accept.answer)
    }
}

impl Session {
    pub(super) fn id(&self) -> &str {
        &self.id
    }

    pub(super) fn model(&self) -> &str {
        &self.model
    }

    /// Answers one question; none for an accept. Waits for the device. A fault inside closes this session and no other;
    /// what the budget stops is refused, and the session goes on.
    pub(super) fn answer(&self, question: &Question, budget: &Budget) -> Option<ReplyKind> {
        let device = self.device.lock().unwrap_or_else(PoisonError::into_inner);
        self.answer_with(device, question, budget).unwrap_or_else(|why| self.refuse(question, &status::stopped(why)))
    }

    /// The same where requests arrive, for which nothing may wait: answers only if the device is free and the answer takes
    /// less than `SLICE`.
    ///
    /// # Errors
    /// [`Later`]: to be asked again with [`Session::answer`], on a thread. Trials are pure, so nothing has happened.
    pub(super) fn answer_at_once(&self, question: &Question) -> Result<Option<ReplyKind>, Later> {
        // what waits for the disk waits elsewhere
        let kept = self.keeper.is_some() && matches!(question, Question::Open(_) | Question::Accept(_));
        if kept
            || !self.inline
            || self.slow.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1)).is_ok()
        {
            return Err(Later);
        }
        let device = match self.device.try_lock() {
            Ok(device) => device,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return Err(Later),
        };
        let deadline = Some(Instant::now() + SLICE);
        let slice = Budget::new(Allowance { deadline, ..Allowance::default() });
        self.answer_with(device, question, &slice).map_err(|_| {
            self.slow.store(AFTER_SLOW, Ordering::Relaxed);
            Later
        })
    }

    fn answer_with(
        &self,
        mut device: MutexGuard<'_, Box<dyn Device>>,
        question: &Question,
        budget: &Budget,
    ) -> Result<Option<ReplyKind>, Stopped> {
        if self.is_closed() {
            return Ok(self.refuse(question, &status::not_found("session", &self.id)));
        }
        self.touch();
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

    fn refuse(&self, question: &Question, status: &Status) -> Option<ReplyKind> {
        (!question.is_silent()).then(|| refused(status))
    }

    fn ask(&self, device: &mut dyn Device, question: &Question) -> Option<ReplyKind> {
        let answer = match question {
            Question::Open(request) => {
                let request = wire::open_from_wire(request);
                device.open(&request).map(|description| {
                    let description = wire::description_to_wire(&description);
                    *self.description.lock().unwrap_or_else(PoisonError::into_inner) = description;
                    self.keep(device, None).map_or_else(|s| refused(&s), |_| ReplyKind::Opened(self.opened()))
                })
            }
            Question::Trial(request) => {
                let mut reply = TrialReply::default();
                wire::trial_from_wire(request)
                    .and_then(|trial| device.trial(&trial, &mut reply))
                    .map(|()| ReplyKind::Trial(wire::reply_to_wire(&mut reply)))
            }
            Question::Accept(proto::Accept { token, answer }) => {
                device.accept(Token(*token));
                let kept = self.keep(device, Some(Token(*token)));
                if let Err(status) = &kept {
                    tracing::warn!(session = self.id, reason = status.message(), "an accepted state is not kept");
                }
                let accepted = |kept| ReplyKind::Accepted(proto::Accepted { token: *token, kept });
                return answer.then(|| kept.map_or_else(|status| refused(&status), accepted));
            }
            Question::Linearize(request) => {
                small_signal(device, Token(request.token), request.omega, request.noise).map(ReplyKind::Linearized)
            }
        };
        Some(answer.unwrap_or_else(|error| ReplyKind::Fault(wire::fault_to_wire(&error))))
    }

    /// Keeps the accepted state and the one before, where states are kept; without a token all that are held. Whether it did.
    fn keep(&self, device: &dyn Device, token: Option<Token>) -> Result<bool, Status> {
        let Some(keeper) = &self.keeper else { return Ok(false) };
        let mut keeper = keeper.lock().unwrap_or_else(PoisonError::into_inner);
        if self.is_closed() {
            return Err(status::not_found("session", &self.id));
        }
        let before = Token(keeper.accepted);
        let states = match token {
            None => device.save(None),
            Some(token) => match device.save(Some(&[before, token])) {
                // the first one, or a state that is not held any more
                Err(DeviceError::UnknownToken(unknown)) if unknown == before => device.save(Some(&[token])),
                saved => saved,
            },
        };
        let states = states.map_err(|error| status::device(&error))?;
        let sealed = snapshots::seal(&self.model, &states);
        let accepted = token.map_or(0, |token| token.0);
        keeper.keep(accepted, &sealed).map_err(|error| status::not_kept(&error))?;
        self.accepted.store(accepted, Ordering::Relaxed);
        Ok(true)
    }

    /// Keeps all states that are held, where states are kept.
    pub(super) fn keep_all(&self) -> Result<(), Status> {
        let device = self.lock()?;
        self.keep(&**device, None).map(|_| ())
    }

    /// Its states as a sealed snapshot.
    pub(super) fn snapshot(&self, only: Option<Token>) -> Result<Vec<u8>, Status> {
        self.touch();
        let states =
            self.lock()?.save(only.as_ref().map(std::slice::from_ref)).map_err(|error| status::device(&error))?;
        Ok(snapshots::seal(&self.model, &states))
    }

    /// Starts with the states of a sealed snapshot.
    pub(super) fn restore(&self, sealed: &[u8]) -> Result<proto::OpenResponse, Status> {
        let states = snapshots::open(&self.model, sealed)?;
        let described = self.lock()?.load(states).map_err(|error| status::device(&error))?;
        *self.description.lock().unwrap_or_else(PoisonError::into_inner) = wire::description_to_wire(&described);
        Ok(self.opened())
    }

    fn lock(&self) -> Result<MutexGuard<'_, Box<dyn Device>>, Status> {
        if self.is_closed() {
            return Err(status::not_found("session", &self.id));
        }
        Ok(self.device.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Keeps it for `lease` without use, or for as long as the server keeps any.
    pub(super) fn lease(&self, lease: Option<Duration>) {
        self.touch();
        let millis = lease.map_or(0, |lease| u64::try_from(lease.as_millis()).unwrap_or(u64::MAX).max(1));
        self.lease_ms.store(millis, Ordering::Relaxed);
    }

    /// For how long it is kept without use.
    fn kept(&self, limits: &Limits) -> Duration {
        match self.lease_ms.load(Ordering::Relaxed) {
            _ if self.streams.load(Ordering::Relaxed) > 0 => limits.stream_idle,
            0 => limits.idle,
            lease => Duration::from_millis(lease),
        }
    }

    /// Waits for this session's turn, without a thread: who works on its device for long holds it.
    pub(super) async fn turn(&self) -> Result<OwnedSemaphorePermit, Status> {
        Arc::clone(&self.turn).acquire_owned().await.map_err(|_| status::fault())
    }

    /// Small-signal answers at several frequencies, for the unary call, which runs under a budget of its own.
    pub(super) fn linearize(
        &self,
        token: Token,
        omega: &[f64],
        noise: bool,
    ) -> Result<Vec<proto::SmallSignal>, Status> {
        self.touch();
        let mut device = self.device.lock().unwrap_or_else(PoisonError::into_inner);
        let budget = budget::current().unwrap_or_else(|| Budget::new(Allowance::default()));
        let one = |&omega: &f64, device: &mut dyn Device| small_signal(device, token, omega, noise);
        match caught(&budget, || omega.iter().map(|omega| one(omega, device.as_mut())).collect::<Result<_, _>>()) {
            Some(Ok(answer)) => answer.map_err(|error| status::device(&error)),
            Some(Err(why)) => {
                device.recover();
                Err(status::stopped(why))
            }
            None => {
                self.fault();
                Err(status::fault())
            }
        }
    }

    /// Checks that so many small-signal answers make a message that may be sent.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED.
    pub(super) fn bound_small_signals(&self, count: usize, noise: bool, limits: &Limits) -> Result<(), Status> {
        /// What an answer takes beside its numbers.
        const HEAD: usize = 64;
        let (ports, signals) = {
            let opened = self.description.lock().unwrap_or_else(PoisonError::into_inner);
            (opened.ports.len(), opened.signals.len())
        };
        let answers = ports + signals;
        let numbers = answers.saturating_mul(if noise { answers } else { ports });
        let bytes = count.saturating_mul(numbers.saturating_mul(2 * size_of::<f64>()).saturating_add(HEAD));
        if bytes > limits.message_bytes {
            let got = format!("{bytes} for {count} small-signal answers of {ports} ports and {signals} signals");
            return Err(status::limit("message_bytes", limits.message_bytes, got));
        }
        Ok(())
    }

    /// What the last open said; an empty description before any.
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

    /// Closes after a panic: its states may be half made.
    fn fault(&self) {
        tracing::error!(session = self.id, model = self.model, "internal fault: the session is closed");
        self.close();
    }

    fn close(&self) {
        self.closed.store(true, Ordering::Relaxed);
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

    /// A stream takes hold of this session.
    pub(super) fn hold(&self) {
        self.streams.fetch_add(1, Ordering::Relaxed);
    }

    /// A stream lets go of it.
    pub(super) fn release(&self) {
        self.touch();
        self.streams.fetch_sub(1, Ordering::Relaxed);
    }

    fn touch(&self) {
        self.used_ms.store(self.age_ms(), Ordering::Relaxed);
    }

    fn age_ms(&self) -> u64 {
        u64::try_from(self.started.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    fn idle(&self) -> Duration {
        Duration::from_millis(self.age_ms().saturating_sub(self.used_ms.load(Ordering::Relaxed)))
    }
}

/// Whoever keeps at this moment is waited for, and then finds the session closed.
fn forget(keeper: &Mutex<Keeper>) {
    keeper.lock().unwrap_or_else(PoisonError::into_inner).forget();
}

fn small_signal(
    device: &mut dyn Device,
    token: Token,
    omega: f64,
    noise: bool,
) -> Result<proto::SmallSignal, DeviceError> {
    if !omega.is_finite() {
        let (expected, got) = ("a finite angular frequency [rad/s]".to_owned(), omega.to_string());
        return Err(DeviceError::BadRequest { what: "omega", expected, got });
    }
    if noise {
        let mut densities = Vec::new();
        device.noise(token, omega, &mut densities)?;
        return Ok(wire::noise_to_wire(&densities));
    }
    let mut answer = SmallSignal::default();
    device.linearize(token, omega, &mut answer)?;
    Ok(wire::small_signal_to_wire(&answer))
}

/// A status as a fault on a stream that goes on.
pub(super) fn refused(status: &Status) -> ReplyKind {
    let kind = proto::fault::Kind::Refused(proto::Refused { code: status.code() as i32 });
    ReplyKind::Fault(proto::Fault { kind: Some(kind), message: status.message().to_owned() })
}

/// The sessions of a server.
#[derive(Default)]
pub(super) struct Sessions {
    open: Mutex<BTreeMap<String, Arc<Session>>>,
    ids: Ids,
}

impl Sessions {
    /// Makes a session with a device that is not open yet.
    pub(super) fn create(&self, model: &Model, make: MakeDevice, limits: &Limits) -> Result<Arc<Session>, Status> {
        self.admit(self.ids.make()?, None, model, make, limits)
    }

    /// The same whose accepted states are kept. Waits for the disk.
    pub(super) fn create_kept(
        &self,
        store: &Arc<Store>,
        model: &Model,
        make: MakeDevice,
        limits: &Limits,
    ) -> Result<Arc<Session>, Status> {
        let id = self.ids.make()?;
        let keeper = Keeper::new(store, &id, model.id(), &model.source());
        let keeper = keeper.map_err(|error| status::not_kept(&error))?;
        self.admit(id.clone(), Some(keeper), model, make, limits).inspect_err(|_| store.forget(&id))
    }

    /// A session of an earlier server goes on with what was kept of it. Waits for the disk.
    pub(super) fn wake(
        &self,
        (store, id, kept): (&Arc<Store>, &str, &Kept),
        model: &Model,
        make: MakeDevice,
        limits: &Limits,
    ) -> Result<Arc<Session>, Status> {
        // bytes that do not fit leave what is kept as it is
        snapshots::open(model.id(), &kept.sealed)?;
        let keeper = Keeper::after(store, id, model.id(), kept);
        let session = self.admit(id.to_owned(), Some(keeper), model, make, limits);
        let session = session.inspect_err(|_| store.sleep(id))?;
        session.restore(&kept.sealed).inspect_err(|_| {
            self.open.lock().unwrap_or_else(PoisonError::into_inner).remove(id);
            store.sleep(id);
        })?;
        Ok(session)
    }

    fn admit(
        &self,
        id: String,
        keeper: Option<Keeper>,
        model: &Model,
        make: MakeDevice,
        limits: &Limits,
    ) -> Result<Arc<Session>, Status> {
        let device = catch_unwind(|| make(Arc::clone(&model.compiled))).map_err(|_| status::fault())?;
        let session = Arc::new(Session {
            id,
            accepted: AtomicU64::new(keeper.as_ref().map_or(0, |keeper| keeper.accepted)),
            keeper: keeper.map(|keeper| Arc::new(Mutex::new(keeper))),
            model: model.id().to_owned(),
            device: Mutex::new(device),
            description: Mutex::default(),
            slow: AtomicU32::new(0),
            turn: Arc::new(Semaphore::new(1)),
            inline: model.unknowns() <= limits.inline_unknowns,
            started: Instant::now(),
            used_ms: AtomicU64::new(0),
            lease_ms: AtomicU64::new(0),
            closed: AtomicBool::new(false),
            streams: AtomicUsize::new(0),
        });
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.retain(|_, session| !session.is_closed());
        if open.len() >= limits.sessions {
            return Err(status::limit("sessions", limits.sessions, "one more; close one"));
        }
        open.insert(session.id.clone(), Arc::clone(&session));
        tracing::debug!(session = session.id, model = session.model, open = open.len(), "session");
        Ok(session)
    }

    /// The session of that id.
    pub(super) fn get(&self, id: &str) -> Result<Arc<Session>, Status> {
        let open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let found = open.get(id).filter(|session| !session.is_closed());
        found.cloned().ok_or_else(|| status::not_found("session", id))
    }

    /// Forgets a session, if there is one; what is kept of it goes soon after.
    pub(super) fn close(&self, id: &str) -> Option<Arc<Session>> {
        let session = self.open.lock().unwrap_or_else(PoisonError::into_inner).remove(id);
        session.inspect(|session| session.close())
    }

    /// Forgets sessions that were not used for long; how many.
    pub(super) fn expire(&self, limits: &Limits) -> usize {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let before = open.len();
        open.retain(|_, session| {
            let keep = session.idle() < session.kept(limits);
            if !keep {
                session.close();
            }
            keep
        });
        before - open.len()
    }

    /// Sessions open now.
    pub(super) fn len(&self) -> usize {
        self.open.lock().unwrap_or_else(PoisonError::into_inner).len()
    }
}
