//! Trial requests to one device on a server, as bytes: the counterpart of the server's channel in process. For programs in
//! other languages, whose own gRPC is slower.
//!
//! The waiting thread drives a connection, and a thread of its own drives it between requests
//! ([`super::driven_runtime`]).

use super::driven_runtime::DrivenRuntime;
use super::link::{is_broken, reason, unexpected};
use crate::address::Address;
use crate::proto;
use crate::waiting::{decoded, not_asynchronous};
use prost::Message;
use proto::bimorph_client::BimorphClient;
use proto::device_request::Kind;
use std::collections::BTreeMap;
use std::future::Future;
use std::io;
use std::pin::pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::metadata::{Ascii, MetadataValue};
use tonic::transport::{Channel, Endpoint};
use tonic::{Request, Status, Streaming};

/// Requests in progress: accepts, whose replies are not awaited, and one trial.
const QUEUE: usize = 64;
/// A server is asked this often whether it is there, while anything is under way; and has so long to say so.
const PING: Duration = Duration::from_millis(2000);
const PONG: Duration = Duration::from_millis(2500);

/// Connections to servers without TLS, by address and number: a server takes only so many streams on each.
pub struct TrialConnections {
    runtime: Arc<DrivenRuntime>,
    open: Mutex<BTreeMap<(String, usize), Channel>>,
}

/// A Trial stream.
pub struct TrialChannel {
    runtime: Arc<DrivenRuntime>,
    requests: mpsc::Sender<proto::DeviceRequest>,
    replies: Streaming<proto::DeviceReply>,
    /// Replies to come.
    owed: usize,
}

impl TrialConnections {
    /// None yet.
    ///
    /// # Errors
    /// A system that gives no thread.
    pub fn new() -> io::Result<Self> {
        Ok(Self { runtime: DrivenRuntime::new()?, open: Mutex::default() })
    }

    /// A stream to the server at `uri` (`unix:///path`, `host:port`), showing `authorization`, on the connection of that `number`, which is
    /// shared with others. Waits at most for `patience`, while `waits` says that it is still wanted.
    ///
    /// # Errors
    /// UNAVAILABLE where there is no server; what it refuses.
    pub fn open(
        &self,
        (uri, number): (&str, usize),
        authorization: Option<&str>,
        patience: Duration,
        waits: &dyn Fn() -> bool,
    ) -> Result<TrialChannel, Status> {
        not_asynchronous()?;
        let value = authorization.map(str::parse::<MetadataValue<Ascii>>).transpose();
        let value = value.map_err(|_| Status::invalid_argument("a token has characters that no token has"))?;
        let asked = Instant::now();
        let still = || waits() && asked.elapsed() < patience;
        let begin = || {
            let (requests, queue) = mpsc::channel(QUEUE);
            let mut request = Request::new(ReceiverStream::new(queue));
            if let Some(value) = &value {
                request.metadata_mut().insert("authorization", value.clone());
            }
            let mut rpc = BimorphClient::new(self.channel(uri, number)?).max_decoding_message_size(usize::MAX);
            Ok((self.runtime.wait(rpc.trial(request), &still)?, requests))
        };
        // a connection that broke while idle fails at the next request, which may be repeated
        let begun = begin().or_else(|status| {
            if !is_broken(&status) {
                return Err(status);
            }
            self.open.lock().unwrap_or_else(PoisonError::into_inner).remove(&(uri.to_owned(), number));
            begin()
        });
        let (replies, requests) = begun.map_err(|status: Status| said(&status, asked, patience))?;
        Ok(TrialChannel { runtime: Arc::clone(&self.runtime), requests, replies: replies.into_inner(), owed: 0 })
    }

    fn channel(&self, uri: &str, number: usize) -> Result<Channel, Status> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(channel) = open.get(&(uri.to_owned(), number)) {
            return Ok(channel.clone());
        }
        let address: Address = uri.parse().map_err(|error| Status::invalid_argument(format!("{error}")))?;
        let endpoint = Endpoint::from_shared(address.uri()).map_err(|e| Status::invalid_argument(e.to_string()))?;
        let _within = self.runtime.enter();
        let channel = endpoint
            .tcp_nodelay(true)
            .connect_timeout(PONG)
            .http2_keep_alive_interval(PING)
            .keep_alive_timeout(PONG)
            .connect_lazy();
        open.insert((uri.to_owned(), number), channel.clone());
        Ok(channel)
    }
}

impl Drop for TrialConnections {
    fn drop(&mut self) {
        self.runtime.end();
    }
}

impl TrialChannel {
    /// The reply to a request, within `patience`; `None` for an accept without a reply. After an abandoned request the
    /// next one still gets its own reply.
    ///
    /// # Errors
    /// UNAVAILABLE, DEADLINE_EXCEEDED, CANCELLED. An error of the device is a reply.
    pub fn ask(
        &mut self,
        request: &[u8],
        patience: Duration,
        waits: &dyn Fn() -> bool,
    ) -> Result<Option<Vec<u8>>, Status> {
        not_asynchronous()?;
        let request = decoded::<proto::DeviceRequest>(request)?.into_inner();
        let is_silent = matches!(&request.kind, Some(Kind::Accept(accept)) if !accept.answer);
        let asked = Instant::now();
        let still = || waits() && asked.elapsed() < patience;
        let Self { runtime, requests, replies, owed } = self;
        if *owed == 0 {
            // a reply without a request would be taken for that to this one
            match pin!(replies.message()).poll(&mut Context::from_waker(Waker::noop())) {
                Poll::Ready(Ok(Some(_))) => return Err(unexpected("no request is open")),
                Poll::Ready(Err(status)) => return Err(said(&status, asked, patience)),
                Poll::Ready(Ok(None)) => return Err(said(&ended(), asked, patience)),
                Poll::Pending => {}
            }
        }
        let sent = async { requests.reserve().await.map_err(|_| Status::unknown("")) };
        // reserve a slot first: a request dropped before it was not sent
        match runtime.wait(sent, &still) {
            Ok(place) => place.send(request),
            // the stream has ended, and says why
            Err(status) if status.code() == tonic::Code::Unknown => {
                let why = runtime.wait(async { replies.message().await }, &still).err();
                return Err(said(&why.unwrap_or_else(ended), asked, patience));
            }
            Err(status) => return Err(said(&status, asked, patience)),
        }
        if is_silent {
            return runtime.flush().map(|()| None);
        }
        *owed += 1;
        let reply = async {
            loop {
                let reply = replies.message().await?.ok_or_else(ended)?;
                *owed -= 1;
                if *owed == 0 {
                    return Ok(reply);
                }
            }
        };
        let reply = runtime.wait(reply, &still).map_err(|status| said(&status, asked, patience))?;
        Ok(Some(reply.encode_to_vec()))
    }
}

fn ended() -> Status {
    Status::unavailable("the stream has ended")
}

/// A status as reported: UNAVAILABLE for a broken connection, with a message for a timeout.
fn said(status: &Status, asked: Instant, patience: Duration) -> Status {
    if status.code() == tonic::Code::Cancelled && asked.elapsed() >= patience {
        return Status::deadline_exceeded(format!("no answer within {} s", patience.as_secs_f64()));
    }
    if is_broken(status) { Status::unavailable(reason(status)) } else { status.clone() }
}
