//! What comes in before anyone looks at it: how many calls there are, what their requests hold, and how long one may pause.
//!
//! A client may announce a large message and send little of it, begin many and finish none, or ask for more at once than
//! the server can hold. So every call enters here: it counts among the calls of the server and of its connection, its
//! bytes count from the first (those of a stream until each message is whole, those of a unary request until it is
//! answered), and a message that was begun must go on. Who may not ask is refused here; whether the server is well may be
//! asked by everybody, in a few small places of its own, so that nobody is in the way of others by asking that.

use super::bodies::{Answering, Received};
use super::connection::Presence;
use super::guard::Guard;
use super::ids::Ids;
use super::limits::Limits;
use super::metrics::{self, Metrics};
use super::status;
use super::turns::CLIENT;
use std::convert::Infallible;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, AtomicU64, AtomicUsize, Ordering};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tonic::body::Body;
use tonic::codegen::{Service, http};
use tonic::server::NamedService;
use tonic::{Code, Status};
use tracing::Instrument;

/// Calls whose requests are streams: silence between two messages is no pause.
const STREAMS: [&str; 2] = ["/Trial", "/ServerReflectionInfo"];

/// Counts for all services of a server.
pub(super) struct Gate {
    calls: AtomicUsize,
    /// Calls of health: those that are answered at once, and those that go on.
    health: [AtomicUsize; 2],
    held: AtomicUsize,
    most_calls: usize,
    most_held: usize,
    pause: Duration,
    guard: Arc<Guard>,
    metrics: Arc<Metrics>,
    /// What requests of this server are called, before their number.
    name: String,
    requests: AtomicU64,
}

/// Header with the name of a request, which the client may choose.
const REQUEST_ID: &str = "x-request-id";
/// Longest name that is taken from a client.
const LONGEST_ID: usize = 64;

/// A service without tokens: who watches over servers has none.
const OPEN: &str = "grpc.health.v1.Health";
/// Calls of it at once of each kind: `Check`, and `Watch`, which goes on.
const HEALTH_CALLS: usize = 64;
/// Bytes of a request of it.
const HEALTH_BYTES: usize = 1 << 10;

impl Gate {
    pub(super) fn new(limits: &Limits, guard: Arc<Guard>, metrics: Arc<Metrics>) -> Arc<Self> {
        let name = Ids::default().make().map_or_else(|_| "request".to_owned(), |id| id[..8].to_owned());
        Arc::new(Self {
            calls: AtomicUsize::new(0),
            health: Default::default(),
            held: AtomicUsize::new(0),
            most_calls: limits.calls,
            most_held: limits.held_bytes,
            pause: limits.request_pause,
            guard,
            metrics,
            name,
            requests: AtomicU64::new(1),
        })
    }

    /// Calls under way.
    pub(super) fn calls(&self) -> usize {
        self.calls.load(Ordering::Relaxed)
    }

    /// Bytes of requests that are held.
    pub(super) fn held(&self) -> usize {
        self.held.load(Ordering::Relaxed)
    }

    /// The name of a request: the client's, or the next one of this server.
    fn request_id(&self, headers: &http::HeaderMap) -> http::HeaderValue {
        let is_name = |value: &&http::HeaderValue| {
            (1..=LONGEST_ID).contains(&value.len()) && value.as_bytes().iter().all(u8::is_ascii_graphic)
        };
        headers.get(REQUEST_ID).filter(is_name).cloned().unwrap_or_else(|| {
            let number = self.requests.fetch_add(1, Ordering::Relaxed);
            let name = http::HeaderValue::try_from(format!("{}-{number}", self.name));
            name.unwrap_or(http::HeaderValue::from_static("request"))
        })
    }

    fn enter(self: &Arc<Self>, request: &http::Request<Body>, is_health: bool) -> Call {
        let path = request.uri().path();
        let call = Call {
            gate: Arc::clone(self),
            presence: request.extensions().get().cloned(),
            health: is_health.then(|| usize::from(path.ends_with("/Watch"))),
            held: AtomicUsize::new(0),
            place: metrics::place(path),
            started: Instant::now(),
            // of who goes away before the end
            code: AtomicI32::new(Code::Cancelled as i32),
        };
        // a connection that asks for health alone is idle, and makes room for others
        if let (Some(presence), None) = (&call.presence, call.health) {
            presence.begin();
        }
        // from here the call gives back what it took when it is dropped
        call.count().fetch_add(1, Ordering::Relaxed);
        call
    }

    /// Whether a call may go on, and whose it is.
    fn admit(&self, call: &Call, headers: &http::HeaderMap) -> Result<String, Status> {
        let presence = call.presence.as_ref().ok_or_else(|| Status::unauthenticated("nobody is known to ask"))?;
        let (most, name) = if call.is_health() { (HEALTH_CALLS, "health") } else { (self.most_calls, "calls") };
        if call.count().load(Ordering::Relaxed) > most {
            return Err(status::limit(name, most, "one more; end some"));
        }
        let known = if call.is_health() { self.guard.hear(presence) } else { self.guard.admit(presence, headers) };
        known.map(|who| who.to_string())
    }
}

/// One call, from its first byte until its answer is sent.
pub(super) struct Call {
    gate: Arc<Gate>,
    presence: Option<Arc<Presence>>,
    /// Its kind among those of health; none: any other.
    health: Option<usize>,
    held: AtomicUsize,
    /// Its place among the calls that are counted.
    place: usize,
    started: Instant,
    /// How it ended.
    code: AtomicI32,
}

impl Call {
    /// The count that it is in.
    fn count(&self) -> &AtomicUsize {
        self.health.map_or(&self.gate.calls, |kind| &self.gate.health[kind])
    }

    /// Whether it asks for the health of this server.
    pub(super) fn is_health(&self) -> bool {
        self.health.is_some()
    }

    /// How long its request may pause.
    pub(super) fn longest_pause(&self) -> Duration {
        self.gate.pause
    }

    /// How it ended, as far as is known.
    pub(super) fn code(&self) -> Code {
        Code::from_i32(self.code.load(Ordering::Relaxed))
    }

    /// How long it has taken so far.
    pub(super) fn time(&self) -> Duration {
        self.started.elapsed()
    }

    /// Takes note of the code in headers or trailers.
    pub(super) fn hear(&self, headers: &http::HeaderMap) {
        let code = headers.get("grpc-status").and_then(|value| value.to_str().ok()).and_then(|text| text.parse().ok());
        if let Some(code) = code {
            self.code.store(code, Ordering::Relaxed);
        }
    }

    /// More of its request has come.
    pub(super) fn hold(&self, bytes: usize) -> Result<(), Status> {
        let own = self.held.fetch_add(bytes, Ordering::Relaxed) + bytes;
        if self.is_health() {
            let refused =
                || Status::resource_exhausted(format!("a request of health has at most {HEALTH_BYTES} bytes"));
            return if own > HEALTH_BYTES { Err(refused()) } else { Ok(()) };
        }
        let held = self.gate.held.fetch_add(bytes, Ordering::Relaxed) + bytes;
        if held > self.gate.most_held {
            return Err(status::limit("held_bytes", self.gate.most_held, held));
        }
        Ok(())
    }

    /// What has come is not held any more.
    pub(super) fn release(&self) {
        let bytes = self.held.swap(0, Ordering::Relaxed);
        if !self.is_health() {
            self.gate.held.fetch_sub(bytes, Ordering::Relaxed);
        }
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        self.release();
        self.count().fetch_sub(1, Ordering::Relaxed);
        self.gate.metrics.ended(self.place, self.code(), self.time());
        if let (Some(presence), None) = (&self.presence, self.health) {
            presence.end();
        }
    }
}

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
        if let Err(status) = admitted {
            span.in_scope(|| tracing::warn!(reason = status.message(), "refused"));
            call.code.store(status.code() as i32, Ordering::Relaxed);
            let mut response = status.into_http();
            response.headers_mut().insert(REQUEST_ID, id);
            return Box::pin(std::future::ready(Ok(response)));
        }
        let stream = STREAMS.iter().any(|name| request.uri().path().ends_with(name));
        let client = call.presence.as_ref().map_or(0, |presence| presence.number());
        let received = Arc::clone(&call);
        let request = request.map(|body| Body::new(Received::new(body, received, stream)));
        let answer = CLIENT.scope(client, self.service.call(request)).instrument(span.clone());
        Box::pin(async move {
            let mut response = answer.await?;
            response.headers_mut().insert(REQUEST_ID, id);
            call.hear(response.headers());
            Ok(response.map(|body| Body::new(Answering { body, call, span })))
        })
    }
}
