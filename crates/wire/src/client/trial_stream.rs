//! The Trial stream of a device: a request, its reply, and what was opened.

use super::link::unexpected;
use super::reply_order::TrialOrder;
use crate::proto;
use bimorph_device::OpenRequest;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as RequestKind;
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::task::Poll;
use tokio::sync::mpsc;
use tonic::{Status, Streaming};

/// Most warnings of states that wait to be read.
const MAX_WARNINGS: usize = 64;

/// A stream and what is open on it.
#[derive(Debug)]
pub(super) struct OpenTrialStream {
    requests: mpsc::Sender<proto::DeviceRequest>,
    replies: Streaming<proto::DeviceReply>,
    /// Ports and signals of the device; none: it is not open.
    shape: Option<(usize, usize)>,
    pub(super) order: TrialOrder,
    /// Id of the session that is open; empty: none.
    pub(super) session: String,
    /// Warnings of accepted states that came with replies.
    pub(super) warnings: Vec<proto::Diagnostic>,
}

impl OpenTrialStream {
    /// One on which nothing is open yet.
    pub(super) fn new(requests: mpsc::Sender<proto::DeviceRequest>, replies: Streaming<proto::DeviceReply>) -> Self {
        let (order, session, warnings) = (TrialOrder::default(), String::new(), Vec::new());
        Self { requests, replies, shape: None, order, session, warnings }
    }

    /// A device was opened on it.
    pub(super) fn open(&mut self, session: &str, device: &proto::DeviceDescription) {
        session.clone_into(&mut self.session);
        self.shape = Some((device.ports.len(), device.signals.len()));
        self.order = TrialOrder::default();
    }

    /// Whether a device is open on it.
    pub(super) fn is_open(&self) -> bool {
        self.shape.is_some()
    }

    /// Ports and signals of the device.
    pub(super) fn shape(&self) -> (usize, usize) {
        self.shape.unwrap_or_default()
    }

    /// One request and its reply.
    pub(super) async fn ask(&mut self, request: RequestKind) -> Result<ReplyKind, Status> {
        let replies = &mut self.replies;
        // a reply without a request would be taken for that to this request, and all after it for those before
        match poll_fn(|cx| Poll::Ready(pin!(replies.message()).poll(cx))).await {
            Poll::Pending => {}
            Poll::Ready(Ok(Some(_))) => return Err(unexpected("no request is open")),
            Poll::Ready(Ok(None)) => return Err(ended()),
            Poll::Ready(Err(status)) => return Err(status),
        }
        let request = proto::DeviceRequest { kind: Some(request) };
        if self.requests.send(request).await.is_err() {
            // The stream has ended: its status says why.
            return Err(replies.message().await.err().unwrap_or_else(ended));
        }
        let reply = replies.message().await?.ok_or_else(ended)?;
        let left = MAX_WARNINGS.saturating_sub(self.warnings.len());
        self.warnings.extend(reply.warnings.into_iter().take(left));
        reply.kind.ok_or_else(|| unexpected("one of a kind that is not known, or of none"))
    }

    /// Says what has no reply. Advisory: when the queue is full, the next one says as much.
    pub(super) fn report(&self, request: RequestKind) {
        let _ = self.requests.try_send(proto::DeviceRequest { kind: Some(request) });
    }
}

/// Opens a device of a model.
pub(super) fn open_request(model: &str, request: &OpenRequest) -> RequestKind {
    RequestKind::Open(proto::OpenRequest {
        model: model.to_owned(),
        ports: request.ports.clone(),
        signals: request.signals.clone(),
        noise: request.noise.map(|noise| proto::Agitation { seed: noise.seed, band_hz: noise.band }),
    })
}

/// The status of a stream that has ended.
pub(super) fn ended() -> Status {
    Status::unavailable("the server ended the stream")
}
