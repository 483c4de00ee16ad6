//! What comes in before anyone looks at it: how many calls there are, what their requests hold, and how long one may pause.
//!
//! A client may announce a large message and send little of it, begin many and finish none, or ask for more at once than
//! the server can hold. So every call enters here: it counts among the calls of the server and of its connection, its
//! bytes count from the first (those of a stream until each message is whole, those of a unary request until it is
//! answered), and a message that was begun must go on. Who may not ask is refused here; whether the server is well may be
//! asked by everybody, in a few small places of its own, so that nobody is in the way of others by asking that.

use super::bodies::{Answering, Received};
use super::gate::{Gate, OPEN, REQUEST_ID};
use super::metrics::{self};
use super::status;
use super::turns::{CLIENT, Client};
use std::convert::Infallible;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::task::{Context, Poll};
use tonic::body::Body;
use tonic::codegen::{Service, http};
use tonic::server::NamedService;
use tracing::Instrument;

/// Calls whose requests are streams: silence between two messages is no pause.
const STREAMS: [&str; 2] = ["/Trial", "/ServerReflectionInfo"];

/// A service whose calls enter through a [`Gate`].
#[derive(Clone)]
pub(super) struct Intake<S> {
    service: S,
    gate: Arc<Gate>,
}

impl<S> Intake<S> {
    pub(super) fn new(service: S, gate: &Arc<Gate>) -> Self {
        Self { service, gate: Arc::clone(gate) }
    }
}

impl<S: NamedService> NamedService for Intake<S> {
    const NAME: &'static str = S::NAME;
}

type Answer = Pin<Box<dyn Future<Output = Result<http::Response<Body>, Infallible>> + Send>>;

impl<S> Service<http::Request<Body>> for Intake<S>
where
    S: Service<http::Request<Body>, Response = http::Response<Body>, Error = Infallible> + NamedService,
    S::Future: Send + 'static,
{
    type Response = http::Response<Body>;
    type Error = Infallible;
    type Future = Answer;

    fn poll_ready(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        self.service.poll_ready(cx)
    }

    fn call(&mut self, request: http::Request<Body>) -> Answer {
        let call = Arc::new(self.gate.enter(&request, S::NAME == OPEN));
        let id = self.gate.request_id(request.headers());
        let admitted = self.gate.admit(&call, request.headers());
        let name = metrics::name(call.place);
        let span = tracing::error_span!(
            "request",
            id = id.to_str().unwrap_or_default(),
            call = name,
            client = admitted.as_deref().unwrap_or("refused"),
        );
        if let Err(status) = &admitted {
            span.in_scope(|| tracing::warn!(reason = status.message(), "refused"));
            call.code.store(status.code() as i32, Ordering::Relaxed);
            let mut response = status.clone().into_http();
            response.headers_mut().insert(REQUEST_ID, id);
            return Box::pin(std::future::ready(Ok(response)));
        }
        let stream = STREAMS.iter().any(|name| request.uri().path().ends_with(name));
        let number = call.presence.as_ref().map_or(0, |presence| presence.number());
        let account = admitted.as_ref().ok().and_then(|name| self.gate.accounts.of(name));
        let client = Client { number, account, name: admitted.unwrap_or_default().into() };
        let received = Arc::clone(&call);
        let request = request.map(|body| Body::new(Received::new(body, received, stream)));
        let answer = CLIENT.scope(client, self.service.call(request)).instrument(span.clone());
        Box::pin(async move {
            let mut response = answer.await?;
            status::say_undecodable(response.headers_mut());
            response.headers_mut().insert(REQUEST_ID, id);
            call.hear(response.headers());
            Ok(response.map(|body| Body::new(Answering { body, call, span })))
        })
    }
}
