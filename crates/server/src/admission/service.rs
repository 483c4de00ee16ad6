//! Admission control: counts calls and request bytes, and bounds pauses, before a handler runs.
//!
//! A client may announce a large message and send little of it, begin many and finish none, or send more at once than
//! the server can hold. Every call therefore enters here. It counts among the calls of the server and of its
//! connection. Its bytes count from the first: those of a stream until each message is complete, those of a unary
//! request until its reply. A message must not pause for long. Unauthorized calls are rejected here. Health calls need
//! no authorization and use a few small permits of their own, so that they cannot block other calls.

use super::body::{RequestBody, ResponseBody};
use super::counters::{AdmissionCounters, OPEN, REQUEST_ID};
use crate::fair_semaphore::{CLIENT, TaskOwner};
use crate::metrics;
use crate::status;
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

/// A service whose calls enter through an [`AdmissionCounters`].
#[derive(Clone)]
pub(crate) struct AdmissionService<S> {
    service: S,
    gate: Arc<AdmissionCounters>,
}

impl<S> AdmissionService<S> {
    pub(crate) fn new(service: S, gate: &Arc<AdmissionCounters>) -> Self {
        Self { service, gate: Arc::clone(gate) }
    }
}

impl<S: NamedService> NamedService for AdmissionService<S> {
    const NAME: &'static str = S::NAME;
}

/// Whether a request says that it is gRPC with messages of Protocol Buffers.
fn is_grpc(headers: &http::HeaderMap) -> bool {
    let kind = headers.get(http::header::CONTENT_TYPE).and_then(|value| value.to_str().ok());
    let rest = kind.and_then(|kind| kind.strip_prefix("application/grpc"));
    rest.is_some_and(|rest| {
        let rest = rest.strip_prefix("+proto").unwrap_or(rest);
        rest.is_empty() || rest.starts_with(';')
    })
}

/// 415 for any other request, as the gRPC protocol over HTTP/2 says.
fn not_grpc() -> http::Response<Body> {
    let mut response = http::Response::new(Body::empty());
    *response.status_mut() = http::StatusCode::UNSUPPORTED_MEDIA_TYPE;
    response.headers_mut().insert("accept", http::HeaderValue::from_static("application/grpc"));
    response
}

type ResponseFuture = Pin<Box<dyn Future<Output = Result<http::Response<Body>, Infallible>> + Send>>;

impl<S> Service<http::Request<Body>> for AdmissionService<S>
where
    S: Service<http::Request<Body>, Response = http::Response<Body>, Error = Infallible> + NamedService,
    S::Future: Send + 'static,
{
    type Response = http::Response<Body>;
    type Error = Infallible;
    type Future = ResponseFuture;

    fn poll_ready(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        self.service.poll_ready(cx)
    }

    fn call(&mut self, request: http::Request<Body>) -> ResponseFuture {
        if !is_grpc(request.headers()) {
            return Box::pin(std::future::ready(Ok(not_grpc())));
        }
        let call = Arc::new(self.gate.enter(&request, S::NAME == OPEN));
        let id = self.gate.request_id(request.headers());
        let admitted = self.gate.admit(&call, request.headers());
        let name = metrics::name(call.place);
        let span = tracing::error_span!(
            "request",
            id = id.to_str().unwrap_or_default(),
            call = name,
            client = admitted.as_ref().map_or("refused", |account| account.name()),
        );
        let account = match admitted {
            Ok(account) => account,
            Err(status) => {
                span.in_scope(|| tracing::warn!(reason = status.message(), "refused"));
                call.code.store(status.code() as i32, Ordering::Relaxed);
                let mut response = status.into_http();
                response.headers_mut().insert(REQUEST_ID, id);
                return Box::pin(std::future::ready(Ok(response)));
            }
        };
        let stream = STREAMS.iter().any(|name| request.uri().path().ends_with(name));
        let number = call.presence.as_ref().map_or(0, |presence| presence.number());
        let name = account.name().into();
        let received = RequestBody::new(Arc::clone(&call), Arc::clone(&account), stream);
        let client = TaskOwner { number, account: Some(account), name };
        let request = request.map(|body| Body::new(received.of(body)));
        let answer = CLIENT.scope(client, self.service.call(request)).instrument(span.clone());
        Box::pin(async move {
            let mut response = answer.await?;
            status::say_undecodable(response.headers_mut());
            response.headers_mut().insert(REQUEST_ID, id);
            call.hear(response.headers());
            Ok(response.map(|body| Body::new(ResponseBody { body, call, span })))
        })
    }
}
