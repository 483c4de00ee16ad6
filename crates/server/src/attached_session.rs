//! The session of a trial stream: opened by it, or attached.

use super::reply_size::answerable;
use super::session::{Session, refused};
use super::shared::ServerState;
use super::stream_request::StreamRequest;
use bimorph_wire::proto;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as RequestKind;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use tonic::Status;

/// The session of a stream; left when this goes away.
pub(super) struct AttachedSession {
    shared: Arc<ServerState>,
    session: Option<Arc<Session>>,
    /// The stream's number among those of the session.
    number: u64,
    /// Whether the session ends with the stream.
    owned: bool,
}

/// Action for a request.
pub(super) enum RequestAction {
    /// To be asked of this session.
    Ask(Arc<Session>, StreamRequest),
    /// To join the session of that id.
    Attach(String),
    /// A refusal; none of what has no answer.
    Answered(Option<ReplyKind>),
}

impl AttachedSession {
    /// None yet.
    pub(super) fn none(shared: &Arc<ServerState>) -> Self {
        Self { shared: Arc::clone(shared), session: None, number: 0, owned: false }
    }

    /// Action for a request. One that opens has a session when this returns.
    pub(super) fn next(&mut self, request: proto::DeviceRequest) -> RequestAction {
        self.shared.metrics.trials.fetch_add(1, Ordering::Relaxed);
        let question = match request.kind {
            Some(RequestKind::Open(open)) => self.enter(&open).map(|()| StreamRequest::Open(open)),
            Some(RequestKind::Attach(attach)) => return RequestAction::Attach(attach.session),
            Some(RequestKind::Trial(trial)) => Ok(StreamRequest::Trial(trial)),
            Some(RequestKind::Accept(accept)) => Ok(StreamRequest::Accept(accept, self.number)),
            Some(RequestKind::Linearize(request)) => {
                let limits = &self.shared.limits;
                let bound = self.session.as_ref().map(|session| session.bound_small_signals(1, request.noise, limits));
                bound.unwrap_or(Ok(())).map(|()| StreamRequest::Linearize(request))
            }
            None => Err(Status::invalid_argument("a request without a kind")),
        };
        match (question, &self.session) {
            (Ok(question), Some(session)) => RequestAction::Ask(Arc::clone(session), question),
            (Ok(question), None) => {
                let fault = bimorph_wire::convert::device::fault_to_wire(&bimorph_device::DeviceError::NotOpen);
                RequestAction::Answered((!question.is_silent()).then_some(ReplyKind::Fault(fault)))
            }
            (Err(status), _) => RequestAction::Answered(Some(refused(&status))),
        }
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

    /// New warnings of the session's accepted states.
    pub(super) fn warnings(&self) -> Vec<proto::Diagnostic> {
        self.session.as_ref().map_or_else(Vec::new, |session| session.take_warnings())
    }

    /// Continues with a session, in the place of the one before.
    pub(super) fn join(&mut self, session: Result<Arc<Session>, Status>) -> ReplyKind {
        match session {
            Ok(session) => {
                self.leave();
                // first: accepts of an earlier stream are rejected from here on, without a reply
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

impl Drop for AttachedSession {
    fn drop(&mut self) {
        self.leave();
    }
}
