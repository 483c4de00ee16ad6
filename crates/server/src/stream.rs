//! The Trial stream: a state machine that answers each request where it arrives.
//!
//! A trial of a small model takes microseconds, less than handing it to another task. So the reply stream polls the
//! request stream and computes in between; nothing is spawned and nothing crosses a channel. A trial that takes longer
//! is stopped there and repeated on a blocking thread. Models above
//! [`Limits::inline_unknowns`](super::limits::Limits::inline_unknowns) start there. Trials run one at a time, so that
//! replies stay in order.

use super::attached_session::{AttachedSession, RequestAction};
use super::fair_semaphore::{CLIENT, TaskOwner, client};
use super::session::{Session, refused};
use super::shared::ServerState;
use super::status;
use super::stream_request::StreamRequest;
use bimorph_base::budget::{Allowance, Budget};
use bimorph_wire::proto;
use proto::device_reply::Kind as ReplyKind;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use tokio_stream::Stream;
use tokio_util::sync::WaitForCancellationFutureOwned;
use tonic::{Status, Streaming};

/// Requests without a reply (accepts) answered before other tasks get their turn.
const BURST: usize = 64;

/// The awaited reply.
type PendingReply<T> = Pin<Box<dyn Future<Output = T> + Send>>;

/// The replies of one stream.
pub(super) struct TrialStream {
    shared: Arc<ServerState>,
    requests: Streaming<proto::DeviceRequest>,
    ending: Pin<Box<WaitForCancellationFutureOwned>>,
    joined: AttachedSession,
    /// A session that is being woken, to be joined.
    waking: Option<PendingReply<Result<Arc<Session>, Status>>>,
    running: Option<PendingReply<Option<ReplyKind>>>,
    finished: bool,
    client: TaskOwner,
}

impl TrialStream {
    pub(super) fn new(shared: Arc<ServerState>, requests: Streaming<proto::DeviceRequest>) -> Self {
        let ending = Box::pin(shared.shutdown.ending.clone().cancelled_owned());
        Self {
            joined: AttachedSession::none(&shared),
            shared,
            requests,
            ending,
            waking: None,
            running: None,
            finished: false,
            client: client(),
        }
    }

    /// Starts on a request: a reply at once, none (an accept), or a thread in `running`.
    fn take(&mut self, request: proto::DeviceRequest) -> Option<ReplyKind> {
        match CLIENT.sync_scope(self.client.clone(), || self.joined.next(request)) {
            RequestAction::Ask(session, question) => self.ask(session, question),
            RequestAction::Attach(id) => self.attach(id),
            RequestAction::Answered(reply) => reply,
        }
    }

    fn ask(&mut self, session: Arc<Session>, question: StreamRequest) -> Option<ReplyKind> {
        if let Ok(reply) = session.answer_at_once(&question) {
            return reply;
        }
        let later = later(Arc::clone(&self.shared), session, question);
        self.running = Some(Box::pin(CLIENT.scope(self.client.clone(), later)));
        None
    }

    /// Joins a session: at once where it is here, else when it has been woken.
    fn attach(&mut self, id: String) -> Option<ReplyKind> {
        let here = self.shared.sessions.get(&id);
        if here.is_ok() || self.shared.store.is_none() {
            return Some(self.joined.join(here));
        }
        let shared = Arc::clone(&self.shared);
        let woken = async move { shared.session(&id).await };
        self.waking = Some(Box::pin(CLIENT.scope(self.client.clone(), woken)));
        None
    }
}

/// Answers on a thread, in the session's turn. Dropped, it stops the computation.
async fn later(shared: Arc<ServerState>, session: Arc<Session>, question: StreamRequest) -> Option<ReplyKind> {
    let turn = match session.acquire().await {
        Ok(turn) => turn,
        Err(status) => return Some(refused(&status)),
    };
    let silent = question.is_silent();
    let job = move |budget: &Budget| {
        let _turn = &turn;
        // a state that was computed is accepted whatever is left
        let free = Budget::new(Allowance::default());
        Ok(session.answer(&question, if question.is_accept() { &free } else { budget }))
    };
    shared.trials.run_with(job).await.unwrap_or_else(|status| (!silent).then(|| refused(&status)))
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
                Some(this.joined.join(woken))
            } else if let Some(running) = &mut this.running {
                let reply = ready!(running.as_mut().poll(cx));
                this.running = None;
                reply
            } else {
                match ready!(Pin::new(&mut this.requests).poll_next(cx)) {
                    Some(Ok(request)) => this.take(request),
                    Some(Err(error)) => {
                        this.finished = true;
                        return Poll::Ready(Some(Err(status::undecodable(&error))));
                    }
                    None => {
                        this.finished = true;
                        return Poll::Ready(None);
                    }
                }
            };
            if reply.is_some() {
                let warnings = this.joined.warnings();
                return Poll::Ready(Some(Ok(proto::DeviceReply { kind: reply, warnings })));
            }
        }
        cx.waker().wake_by_ref();
        Poll::Pending
    }
}
