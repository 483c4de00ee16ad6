//! What comes in before anyone looks at it: how many calls there are, what their requests hold, and how long one may pause.
//!
//! A client may announce a large message and send little of it, begin many and finish none, or ask for more at once than
//! the server can hold. So every call enters here: it counts among the calls of the server and of its connection, its
//! bytes count from the first (those of a stream until each message is whole, those of a unary request until it is
//! answered), and a message that was begun must go on. Who may not ask is refused here; whether the server is well may be
//! asked by everybody.

use super::connection::Presence;
use super::framing::Framing;
use super::guard::Guard;
use super::ids::Ids;
use super::limits::Limits;
use super::metrics::{self, Metrics};
use super::status;
use super::turns::CLIENT;
use http_body::{Frame, SizeHint};
use std::convert::Infallible;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, AtomicU64, AtomicUsize, Ordering};
use std::task::{Context, Poll};
use std::time::{Duration, Instant as Moment};
use tokio::time::{Instant, Sleep};
use tonic::body::Body;
use tonic::codegen::{Bytes, Service, http};
use tonic::server::NamedService;
use tonic::{Code, Status};
use tracing::{Instrument, Span};

/// Calls whose requests are streams: silence between two messages is no pause.
const STREAMS: [&str; 2] = ["/Trial", "/ServerReflectionInfo"];

/// Counts for all services of a server.
pub(super) struct Gate {
    calls: AtomicUsize,
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

impl Gate {
    pub(super) fn new(limits: &Limits, guard: Arc<Guard>, metrics: Arc<Metrics>) -> Arc<Self> {
        let name = Ids::default().make().map_or_else(|_| "request".to_owned(), |id| id[..8].to_owned());
        Arc::new(Self {
            calls: AtomicUsize::new(0),
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

    fn enter(self: &Arc<Self>, presence: Option<Arc<Presence>>, path: &str) -> Call {
        let call = Call {
            gate: Arc::clone(self),
            presence,
            held: AtomicUsize::new(0),
            place: metrics::place(path),
            started: Moment::now(),
            // of who goes away before the end
            code: AtomicI32::new(Code::Cancelled as i32),
        };
        if let Some(presence) = &call.presence {
            presence.begin();
        }
        // from here the call gives back what it took when it is dropped
        self.calls.fetch_add(1, Ordering::Relaxed);
        call
    }

    /// Whether a call may go on, and whose it is.
    fn admit(&self, call: &Call, request: &http::Request<Body>, open: bool) -> Result<String, Status> {
        if self.calls() > self.most_calls {
            return Err(status::limit("calls", self.most_calls, "one more; end some"));
        }
        match &call.presence {
            Some(presence) if !open => Ok(self.guard.admit(presence, request.headers())?.to_string()),
            _ => Ok("unknown".to_owned()),
        }
    }
}

/// One call, from its first byte until its answer is sent.
struct Call {
    gate: Arc<Gate>,
    presence: Option<Arc<Presence>>,
    held: AtomicUsize,
    /// Its place among the calls that are counted.
    place: usize,
    started: Moment,
    /// How it ended.
    code: AtomicI32,
}

impl Call {
    /// Takes note of the code in headers or trailers.
    fn hear(&self, headers: &http::HeaderMap) {
        let code = headers.get("grpc-status").and_then(|value| value.to_str().ok()).and_then(|text| text.parse().ok());
        if let Some(code) = code {
            self.code.store(code, Ordering::Relaxed);
        }
    }

    fn hold(&self, bytes: usize) -> Result<(), Status> {
        self.held.fetch_add(bytes, Ordering::Relaxed);
        let held = self.gate.held.fetch_add(bytes, Ordering::Relaxed) + bytes;
        if held > self.gate.most_held {
            return Err(status::limit("held_bytes", self.gate.most_held, held));
        }
        Ok(())
    }

    fn release(&self) {
        let bytes = self.held.swap(0, Ordering::Relaxed);
        self.gate.held.fetch_sub(bytes, Ordering::Relaxed);
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        self.release();
        self.gate.calls.fetch_sub(1, Ordering::Relaxed);
        let (code, time) = (Code::from_i32(self.code.load(Ordering::Relaxed)), self.started.elapsed());
        self.gate.metrics.ended(self.place, code, time);
        if let Some(presence) = &self.presence {
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
        let call = Arc::new(self.gate.enter(request.extensions().get().cloned(), request.uri().path()));
        let id = self.gate.request_id(request.headers());
        let admitted = self.gate.admit(&call, &request, S::NAME == OPEN);
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
        let request = request
            .map(|body| Body::new(Received { body, call: received, framing: Framing::default(), stream, pause: None }));
        let answer = CLIENT.scope(client, self.service.call(request)).instrument(span.clone());
        Box::pin(async move {
            let mut response = answer.await?;
            response.headers_mut().insert(REQUEST_ID, id);
            call.hear(response.headers());
            Ok(response.map(|body| Body::new(Answering { body, call, span })))
        })
    }
}

/// The body of a request, counted.
struct Received {
    body: Body,
    call: Arc<Call>,
    framing: Framing,
    stream: bool,
    pause: Option<Pin<Box<Sleep>>>,
}

impl http_body::Body for Received {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        let this = &mut *self;
        match Pin::new(&mut this.body).poll_frame(cx) {
            Poll::Ready(Some(Ok(frame))) => {
                this.pause = None;
                if let Some(data) = frame.data_ref() {
                    this.call.hold(data.len())?;
                    this.framing.take(data);
                    if this.stream && this.framing.whole() {
                        this.call.release();
                    }
                }
                Poll::Ready(Some(Ok(frame)))
            }
            Poll::Ready(end) => Poll::Ready(end),
            Poll::Pending => {
                if this.stream && this.framing.whole() {
                    return Poll::Pending;
                }
                let longest = this.call.gate.pause;
                let pause =
                    this.pause.get_or_insert_with(|| Box::pin(tokio::time::sleep_until(Instant::now() + longest)));
                if pause.as_mut().poll(cx).is_ready() {
                    let text = format!("request_pause: a request was begun and did not go on for {longest:?}");
                    return Poll::Ready(Some(Err(Status::new(Code::DeadlineExceeded, text))));
                }
                Poll::Pending
            }
        }
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// The body of an answer; the call is over when it is dropped.
struct Answering {
    body: Body,
    call: Arc<Call>,
    span: Span,
}

impl Drop for Answering {
    fn drop(&mut self) {
        let code = Code::from_i32(self.call.code.load(Ordering::Relaxed));
        let ms = self.call.started.elapsed().as_secs_f64() * 1e3;
        self.span.in_scope(|| tracing::info!(?code, ms, "answered"));
    }
}

impl http_body::Body for Answering {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        let this = &mut *self;
        let frame = this.span.in_scope(|| Pin::new(&mut this.body).poll_frame(cx));
        if let Poll::Ready(Some(Ok(frame))) = &frame
            && let Some(trailers) = frame.trailers_ref()
        {
            this.call.hear(trailers);
        }
        frame
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
