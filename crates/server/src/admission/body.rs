//! Bodies of requests and replies in admission: request bytes are counted, and the end of a reply is recorded.

use super::counters::AdmittedCall;
use crate::accounts::Account;
use crate::framing::Framing;
use http_body::{Frame, SizeHint};
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use tokio::time::{Instant, Sleep};
use tonic::body::Body;
use tonic::codegen::Bytes;
use tonic::{Code, Status};
use tracing::Span;

/// The body of a request: counted, and passed on by whole messages.
pub(crate) struct RequestBody {
    body: Body,
    call: Arc<AdmittedCall>,
    account: Arc<Account>,
    framing: Framing,
    /// Silence between two messages is no pause.
    stream: bool,
    pause: Option<Pin<Box<Sleep>>>,
}

impl RequestBody {
    /// Of no body yet.
    pub(crate) fn new(call: Arc<AdmittedCall>, account: Arc<Account>, stream: bool) -> Self {
        Self { body: Body::empty(), call, account, framing: Framing::default(), stream, pause: None }
    }

    /// The same of a body.
    pub(crate) fn of(self, body: Body) -> Self {
        Self { body, ..self }
    }

    /// Counts what has come.
    fn take(&mut self, data: Bytes) -> Result<(), Status> {
        self.call.hold(data.len())?;
        let (call, account) = (&self.call, &self.account);
        self.framing.take(data, |length| call.announce(length, account))?;
        if self.stream && self.framing.is_between() {
            self.call.release();
        }
        Ok(())
    }
}

impl http_body::Body for RequestBody {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        let this = &mut *self;
        loop {
            if let Some(part) = this.framing.next() {
                return Poll::Ready(Some(Ok(Frame::data(part))));
            }
            match Pin::new(&mut this.body).poll_frame(cx) {
                Poll::Ready(Some(Ok(frame))) => {
                    // health calls share one pause limit in all
                    if !this.call.is_health() {
                        this.pause = None;
                    }
                    match frame.into_data() {
                        Ok(data) => this.take(data)?,
                        Err(trailers) => return Poll::Ready(Some(Ok(trailers))),
                    }
                }
                Poll::Ready(None) if !this.framing.is_between() => {
                    let text = "expected messages of the protocol (proto/bimorph): the request ended within one";
                    return Poll::Ready(Some(Err(Status::invalid_argument(text))));
                }
                Poll::Ready(end) => return Poll::Ready(end),
                Poll::Pending if this.stream && this.framing.is_between() => return Poll::Pending,
                Poll::Pending => {
                    let longest = this.call.longest_pause();
                    let pause =
                        this.pause.get_or_insert_with(|| Box::pin(tokio::time::sleep_until(Instant::now() + longest)));
                    if pause.as_mut().poll(cx).is_ready() {
                        let text = format!("request_pause: a request was begun and did not continue for {longest:?}");
                        return Poll::Ready(Some(Err(Status::new(Code::DeadlineExceeded, text))));
                    }
                    return Poll::Pending;
                }
            }
        }
    }

    fn is_end_stream(&self) -> bool {
        self.framing.is_empty() && self.framing.is_between() && self.body.is_end_stream()
    }
}

/// The body of an answer; the call is over when it is dropped.
pub(crate) struct ResponseBody {
    pub(crate) body: Body,
    pub(crate) call: Arc<AdmittedCall>,
    pub(crate) span: Span,
}

impl Drop for ResponseBody {
    fn drop(&mut self) {
        let code = self.call.code();
        let ms = self.call.time().as_secs_f64() * 1e3;
        self.span.in_scope(|| tracing::info!(?code, ms, "answered"));
    }
}

impl http_body::Body for ResponseBody {
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
