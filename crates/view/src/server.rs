//! HTTP/1.1 on loopback: the page, its scripts, requests and events.
//!
//! | path behind the token | method | reply |
//! |---|---|---|
//! | empty | GET | the page |
//! | `bench.js`, `bench.css` | GET | scripts and style of the page |
//! | `ask` | POST | 200 with an answer, 422 with a refusal, 409 where a newer request of the channel came |
//! | `events` | GET | server-sent events: `progress` of long requests, `file` when the netlist changes on disk |

use crate::bench::{Bench, MAX_TEXT};
use crate::channels::Channels;
use crate::export;
use crate::guard::{Origins, PageGuard};
use crate::page;
use crate::question::{Ask, Question};
use crate::refusal::Refusal;
use bimorph_http::HttpLimits;
use http_body_util::{BodyExt, Limited};
use hyper::body::{Body, Bytes, Frame, Incoming};
use hyper::header::{HeaderMap, HeaderName, HeaderValue};
use hyper::{Method, Request, Response, StatusCode};
use std::convert::Infallible;
use std::fmt::{Debug, Formatter};
use std::io;
use std::net::Ipv4Addr;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant, SystemTime};
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::sync::{broadcast, mpsc};

/// Limits of connections. They stay open: a page sends many requests and reads events.
const LIMITS: HttpLimits =
    HttpLimits { connections: 64, head: Duration::from_secs(10), head_bytes: 64 * 1024, whole: None };
/// Longest time until the body of a request has come.
const BODY_PATIENCE: Duration = Duration::from_secs(20);
/// Largest body of a request (bytes): the edited netlist, escaped, and the rest.
const MAX_BODY: usize = 2 * MAX_TEXT;
/// Time between two reports of progress.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(100);
/// Time between two checks whether the netlist has changed on disk, while a page is open.
const FILE_INTERVAL: Duration = Duration::from_secs(2);
/// Events that wait for a page.
const WAITING_EVENTS: usize = 64;

/// Headers of every reply. Scripts and styles come from this server alone, and no other page may show or read a reply.
const HEADERS: [(&str, &str); 7] = [
    (
        "content-security-policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data: blob:; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'none'",
    ),
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cache-control", "no-store"),
    ("cross-origin-resource-policy", "same-origin"),
    ("cross-origin-opener-policy", "same-origin"),
    ("permissions-policy", "camera=(), microphone=(), geolocation=()"),
];

/// Why there is no server.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ViewServerError {
    /// The port cannot be opened.
    #[error("cannot listen at 127.0.0.1:{port}: {reason}")]
    Listen {
        /// The port; 0: any.
        port: u16,
        /// Why.
        reason: io::Error,
    },
    /// The system gives no random numbers.
    #[error("the system gives no random numbers for the token of the page")]
    NoToken,
}

/// The server of one bench.
pub struct ViewServer {
    runtime: tokio::runtime::Runtime,
    listener: TcpListener,
    service: Arc<Service>,
}

impl Debug for ViewServer {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ViewServer").finish_non_exhaustive()
    }
}

struct Service {
    bench: Arc<Bench>,
    guard: PageGuard,
    channels: Channels,
    events: broadcast::Sender<Bytes>,
}

impl ViewServer {
    /// Opens a port on loopback; 0: any free one.
    ///
    /// # Errors
    /// [`ViewServerError`]
    pub fn bind(bench: Bench, port: u16) -> Result<Self, ViewServerError> {
        let failed = |reason| ViewServerError::Listen { port, reason };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
        let listener = runtime.block_on(TcpListener::bind((Ipv4Addr::LOCALHOST, port))).map_err(failed)?;
        let bound = listener.local_addr().map_err(failed)?.port();
        let guard = PageGuard::new(bound).ok_or(ViewServerError::NoToken)?;
        let (events, _) = broadcast::channel(WAITING_EVENTS);
        let service = Service { bench: Arc::new(bench), guard, channels: Channels::default(), events };
        Ok(Self { runtime, listener, service: Arc::new(service) })
    }

    /// Address of the page, with its token.
    pub fn url(&self) -> String {
        self.service.guard.url()
    }

    /// Serves until the process ends.
    pub fn run(self) {
        let Self { runtime, listener, service } = self;
        runtime.block_on(bimorph_http::serve(listener, LIMITS, move |request| {
            let service = Arc::clone(&service);
            async move { service.reply(request).await }
        }));
    }
}

impl Service {
    async fn reply(self: &Arc<Self>, request: Request<Incoming>) -> Response<ReplyBody> {
        let headers = request.headers();
        let text = |name: &str| single(headers, name);
        let navigates = request.method() == Method::GET && text("sec-fetch-dest") == Ok(Some("document"));
        let from = match (text("host"), text("origin"), text("sec-fetch-site")) {
            (Ok(host), Ok(origin), Ok(site)) => Origins { host, origin, site, navigates },
            _ => return plain(StatusCode::BAD_REQUEST, "a header is given twice or is no text\n"),
        };
        if !self.guard.admits(&from) {
            return plain(StatusCode::FORBIDDEN, "this address serves its own page alone\n");
        }
        let Some(place) = self.guard.place(request.uri().path()) else {
            return plain(
                StatusCode::FORBIDDEN,
                "the token is missing or wrong: use the address that the command printed\n",
            );
        };
        match (request.method(), place) {
            (&Method::GET, "") => whole(StatusCode::OK, "text/html; charset=utf-8", page::html(&self.bench.title())),
            (&Method::GET, "bench.js") => whole(StatusCode::OK, "text/javascript; charset=utf-8", page::script()),
            (&Method::GET, "bench.css") => whole(StatusCode::OK, "text/css; charset=utf-8", page::STYLE.to_owned()),
            (&Method::GET, "events") => self.events(),
            (&Method::POST, "ask") => self.ask(request).await,
            (_, "" | "bench.js" | "bench.css" | "events" | "ask") => {
                plain(StatusCode::METHOD_NOT_ALLOWED, "expected GET, and POST for ask\n")
            }
            _ => plain(StatusCode::NOT_FOUND, "there is nothing here\n"),
        }
    }

    async fn ask(self: &Arc<Self>, request: Request<Incoming>) -> Response<ReplyBody> {
        if single(request.headers(), "content-type").ok().flatten() != Some("application/json") {
            return plain(StatusCode::UNSUPPORTED_MEDIA_TYPE, "expected application/json\n");
        }
        if request.body().size_hint().lower() > MAX_BODY as u64 {
            return plain(StatusCode::PAYLOAD_TOO_LARGE, "the request is too large\n");
        }
        let body = Limited::new(request.into_body(), MAX_BODY).collect();
        let body = match tokio::time::timeout(BODY_PATIENCE, body).await {
            Ok(Ok(body)) => body.to_bytes(),
            Ok(Err(_)) => return plain(StatusCode::PAYLOAD_TOO_LARGE, "the request is too large\n"),
            Err(_) => return plain(StatusCode::REQUEST_TIMEOUT, "the request did not come in time\n"),
        };
        let question: Question = match serde_json::from_slice(&body) {
            Ok(question) => question,
            Err(error) => return refused(StatusCode::BAD_REQUEST, &Refusal::of(error)),
        };
        let channel = question.channel.clone();
        let (bench, events) = (Arc::clone(&self.bench), self.events.clone());
        let name = channel.clone();
        let found = self
            .channels
            .run(&channel, move |_| {
                let progress = throttled(name, events);
                match &question.ask {
                    Ask::Export { asks, view } => {
                        Ok(export::export(&bench, &question.state, asks, view, &progress).into_bytes())
                    }
                    _ => bench.answer(&question, &progress).map(crate::answer::Answer::bytes),
                }
            })
            .await;
        match found {
            Ok(bytes) => whole(StatusCode::OK, "application/octet-stream", bytes),
            Err(refusal) if refusal.superseded => refused(StatusCode::CONFLICT, &refusal),
            Err(refusal) => refused(StatusCode::UNPROCESSABLE_ENTITY, &refusal),
        }
    }

    /// A stream of events, as long as the page reads it.
    fn events(self: &Arc<Self>) -> Response<ReplyBody> {
        let (sender, receiver) = mpsc::channel(WAITING_EVENTS);
        let mut events = self.events.subscribe();
        let file = self.bench.options.file.clone();
        tokio::spawn(async move {
            let changed =
                |file: &std::path::Path| -> Option<SystemTime> { std::fs::metadata(file).ok()?.modified().ok() };
            let mut known = changed(&file);
            if sender.send(Bytes::from_static(b": open\n\n")).await.is_err() {
                return;
            }
            loop {
                let event = tokio::select! {
                    event = events.recv() => match event {
                        Ok(event) => event,
                        Err(broadcast::error::RecvError::Lagged(_)) => continue,
                        Err(broadcast::error::RecvError::Closed) => return,
                    },
                    () = sender.closed() => return,
                    () = tokio::time::sleep(FILE_INTERVAL) => {
                        let now = changed(&file);
                        if now == known {
                            continue;
                        }
                        known = now;
                        Bytes::from_static(b"event: file\ndata: {}\n\n")
                    }
                };
                if sender.send(event).await.is_err() {
                    return;
                }
            }
        });
        let mut response = Response::new(ReplyBody::Events(receiver));
        headers(response.headers_mut(), "text/event-stream");
        response
    }
}

/// Reports the completed fraction now and then; always continues, since the budget stops the work.
fn throttled(channel: String, events: broadcast::Sender<Bytes>) -> impl Fn(f64) -> bool + Sync {
    let last = Mutex::new(Instant::now());
    move |fraction| {
        let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.elapsed() >= PROGRESS_INTERVAL {
            *last = Instant::now();
            let data = serde_json::json!({ "channel": channel, "fraction": fraction.clamp(0.0, 1.0) });
            let _ = events.send(Bytes::from(format!("event: progress\ndata: {data}\n\n")));
        }
        true
    }
}

/// Value of a header that may be given once.
fn single<'h>(headers: &'h HeaderMap, name: &str) -> Result<Option<&'h str>, ()> {
    let mut values = headers.get_all(name).iter();
    match (values.next(), values.next()) {
        (None, _) => Ok(None),
        (Some(value), None) => value.to_str().map(Some).map_err(|_| ()),
        _ => Err(()),
    }
}

/// Body of a reply.
enum ReplyBody {
    Whole(Option<Bytes>),
    Events(mpsc::Receiver<Bytes>),
}

impl Body for ReplyBody {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        match &mut *self {
            Self::Whole(bytes) => Poll::Ready(bytes.take().map(|bytes| Ok(Frame::data(bytes)))),
            Self::Events(receiver) => receiver.poll_recv(cx).map(|event| event.map(|bytes| Ok(Frame::data(bytes)))),
        }
    }

    fn size_hint(&self) -> hyper::body::SizeHint {
        match self {
            Self::Whole(bytes) => hyper::body::SizeHint::with_exact(bytes.as_ref().map_or(0, |b| b.len() as u64)),
            Self::Events(_) => hyper::body::SizeHint::default(),
        }
    }
}

fn headers(map: &mut HeaderMap, kind: &'static str) {
    map.insert("content-type", HeaderValue::from_static(kind));
    for (name, value) in HEADERS {
        map.insert(HeaderName::from_static(name), HeaderValue::from_static(value));
    }
}

fn whole(status: StatusCode, kind: &'static str, bytes: impl Into<Bytes>) -> Response<ReplyBody> {
    let mut response = Response::new(ReplyBody::Whole(Some(bytes.into())));
    *response.status_mut() = status;
    headers(response.headers_mut(), kind);
    response
}

/// A refusal without a result, after which the connection closes.
fn plain(status: StatusCode, text: &'static str) -> Response<ReplyBody> {
    let mut response = whole(status, "text/plain; charset=utf-8", text);
    response.headers_mut().insert("connection", HeaderValue::from_static("close"));
    response
}

fn refused(status: StatusCode, refusal: &Refusal) -> Response<ReplyBody> {
    whole(status, "application/json", serde_json::to_vec(refusal).unwrap_or_default())
}
