//! The Trial stream: a state machine that answers each request where it arrives.
//!
//! A trial of a small model takes microseconds, less than handing it to another task. So the reply stream polls the
//! request stream and computes in between; nothing is spawned and nothing crosses a channel. What takes longer after all
//! is stopped there and asked again on a blocking thread, as are models above
//! [`Limits::inline_unknowns`](super::limits::Limits::inline_unknowns), one at a time, which keeps replies in order.

use super::answerable::answerable;
use super::question::Question;
use super::session::{Session, refused};
use super::shared::Shared;
use super::turns::{CLIENT, client};
use super::{proto, status};
use crate::budget::Budget;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as RequestKind;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::task::{Context, Poll, ready};
use tokio_stream::Stream;
use tokio_util::sync::WaitForCancellationFutureOwned;
use tonic::{Status, Streaming};

/// Requests without a reply (accepts) answered before other tasks get their turn.
const BURST: usize = 64;

/// What is awaited.
type Running<T> = Pin<Box<dyn Future<Output = T> + Send>>;

/// The replies of one stream.
pub(super) struct TrialStream {
    shared: Arc<Shared>,
    requests: Streaming<proto::DeviceRequest>,
    ending: Pin<Box<WaitForCancellationFutureOwned>>,
    session: Option<Arc<Session>>,
    /// Its number among the streams of that session.
    number: u64,
    /// Whether the session ends with this stream.
    owned: bool,
    /// A session that is being woken, to be joined.
    waking: Option<Running<Result<Arc<Session>, Status>>>,
    running: Option<Running<Option<ReplyKind>>>,
    finished: bool,
    client: u64,
}

impl TrialStream {
    pub(super) fn new(shared: Arc<Shared>, requests: Streaming<proto::DeviceRequest>) -> Self {
        let ending = Box::pin(shared.shutdown.ending.clone().cancelled_owned());
        Self {
            shared,
            requests,
            ending,
            session: None,
            number: 0,
            owned: false,
            waking: None,
            running: None,
            finished: false,
            client: client(),
        }
    }

    /// Starts on a request: a reply at once, none (an accept), or a thread in `running`.
    fn take(&mut self, request: proto::DeviceRequest) -> Option<ReplyKind> {
        self.shared.metrics.trials.fetch_add(1, Ordering::Relaxed);
        let question = match request.kind {
            Some(RequestKind::Open(open)) => {
                return self.enter(&open).map_or_else(|s| Some(refused(&s)), |()| self.ask(Question::Open(open)));
            }
            Some(RequestKind::Attach(attach)) => return self.attach(attach.session),
            Some(RequestKind::Trial(trial)) => Question::Trial(trial),
            Some(RequestKind::Accept(accept)) => Question::Accept(accept, self.number),
            Some(RequestKind::Linearize(request)) => {
                let limits = &self.shared.limits;
                let bound = |session: &Arc<Session>| session.bound_small_signals(1, request.noise, limits);
                if let Some(Err(status)) = self.session.as_ref().map(bound) {
                    return Some(refused(&status));
                }
                Question::Linearize(request)
            }
            None => return Some(refused(&Status::invalid_argument("a request without a kind"))),
        };
        self.ask(question)
    }

    fn ask(&mut self, question: Question) -> Option<ReplyKind> {
        let Some(session) = &self.session else {
            let fault = super::convert::device::fault_to_wire(&crate::device::DeviceError::NotOpen);
            return (!question.is_silent()).then_some(ReplyKind::Fault(fault));
        };
        if let Ok(reply) = session.answer_at_once(&question) {
            return reply;
        }
        let later = later(Arc::clone(&self.shared), Arc::clone(session), question);
        self.running = Some(Box::pin(CLIENT.scope(self.client, later)));
        None
    }

    /// Makes sure there is a session for this model: a second open of the same model is only a new epoch.
    fn enter(&mut self, open: &proto::OpenRequest) -> Result<(), Status> {
        let shared = Arc::clone(&self.shared);
        let limits = &shared.limits;
        answerable(open, 0, limits)?;
        let alive = |session: &Arc<Session>| session.model().id() == open.model && !session.is_closed();
        if self.session.as_ref().is_some_and(alive) {
            return Ok(());
        }
        self.leave();
        let model = shared.models.get(&open.model)?;
        answerable(open, model.compiled.parts.system.electrics.ports, limits)?;
        let session = Session::new(shared.sessions.id(limits)?, None, &model, shared.make, limits)?;
        let session = shared.sessions.admit(session, limits)?;
        self.number = session.usage.hold();
        self.session = Some(session);
        self.owned = true;
        Ok(())
    }

    /// Joins a session: at once where it is here, else when it has been woken.
    fn attach(&mut self, id: String) -> Option<ReplyKind> {
        let here = self.shared.sessions.get(&id);
        if here.is_ok() || self.shared.store.is_none() {
            return Some(self.join(here));
        }
        let shared = Arc::clone(&self.shared);
        let woken = async move { shared.session(&id).await };
        self.waking = Some(Box::pin(CLIENT.scope(self.client, woken)));
        None
    }

    fn join(&mut self, session: Result<Arc<Session>, Status>) -> ReplyKind {
        match session {
            Ok(session) => {
                self.leave();
                // first: what an earlier stream accepts from here on is refused, and not told
                self.number = session.usage.hold();
                let opened = session.opened();
                self.session = Some(session);
                ReplyKind::Opened(opened)
            }
            Err(status) => refused(&status),
        }
    }

    fn leave(&mut self) {
        if let Some(session) = self.session.take() {
            session.usage.release();
            if self.owned {
                self.shared.sessions.close(session.id());
            }
        }
        self.owned = false;
    }
}

/// Answers on a thread, in the session's turn. Dropped, it stops the computation.
async fn later(shared: Arc<Shared>, session: Arc<Session>, question: Question) -> Option<ReplyKind> {
    let turn = match session.turn().await {
        Ok(turn) => turn,
        Err(status) => return Some(refused(&status)),
    };
    let silent = question.is_silent();
    let job = move |budget: &Budget| {
        let _turn = turn;
        Ok(session.answer(&question, budget))
    };
    shared.trials.run_with(job).await.unwrap_or_else(|status| (!silent).then(|| refused(&status)))
}

impl Drop for TrialStream {
    fn drop(&mut self) {
        self.leave();
    }
}

impl Stream for TrialStream {
    type Item = Result<proto::DeviceReply, Status>;

    fn poll_next(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        let this = self.get_mut();
        if this.finished {
            return Poll::Ready(None);
        }
        if this.ending.as_mut().poll(cx).is_ready() {
            this.finished = true;
            return Poll::Ready(Some(Err(status::stopping())));
        }
        for _ in 0..BURST {
            let reply = if let Some(waking) = &mut this.waking {
                let woken = ready!(waking.as_mut().poll(cx));
                this.waking = None;
                Some(this.join(woken))
            } else if let Some(running) = &mut this.running {
                let reply = ready!(running.as_mut().poll(cx));
                this.running = None;
                reply
            } else {
                match ready!(Pin::new(&mut this.requests).poll_next(cx)) {
                    Some(Ok(request)) => this.take(request),
                    Some(Err(error)) => {
                        this.finished = true;
                        return Poll::Ready(Some(Err(error)));
                    }
                    None => {
                        this.finished = true;
                        return Poll::Ready(None);
                    }
                }
            };
            if reply.is_some() {
                return Poll::Ready(Some(Ok(proto::DeviceReply { kind: reply })));
            }
        }
        cx.waker().wake_by_ref();
        Poll::Pending
    }
}
