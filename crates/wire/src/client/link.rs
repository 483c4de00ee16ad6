//! A connection, the token it shows, and the runtime that drives it while a call runs.

use super::reply_checks;
use crate::address::Address;
use crate::convert::model::bundle_to_wire;
use crate::convert::options::options_to_wire;
use crate::credentials::{Access, AccessError};
use crate::proto::{self, bimorph_client::BimorphClient};
use bimorph_base::Bundle;
use bimorph_model::compile::CompileOptions;
use std::cell::Cell;
use std::future::Future;
use std::net::SocketAddr;
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use tonic::metadata::{Ascii, MetadataValue};
use tonic::service::Interceptor;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Request, Status};

/// Largest reply accepted (byte), as the server's default limit.
const MESSAGE_BYTES: usize = 64 << 20;

/// The calls of a server, with its token.
pub(super) type Rpc = BimorphClient<InterceptedService<Channel, CallToken>>;

/// The token that goes with every call.
#[derive(Debug, Clone)]
pub(super) struct CallToken(Option<MetadataValue<Ascii>>);

impl CallToken {
    fn new(address: &Address, access: &Access) -> Result<Self, Status> {
        let Some(token) = access.token(address).map_err(|error| unusable(&error))? else { return Ok(Self(None)) };
        let mut value: MetadataValue<Ascii> = format!("Bearer {}", token.0)
            .parse()
            .map_err(|_| Status::invalid_argument("the token has characters that no token has"))?;
        value.set_sensitive(true);
        Ok(Self(Some(value)))
    }
}

impl Interceptor for CallToken {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        if let Some(value) = &self.0 {
            request.metadata_mut().insert("authorization", value.clone());
        }
        Ok(request)
    }
}

fn unusable(error: &AccessError) -> Status {
    Status::invalid_argument(error.to_string())
}

/// A connected server.
#[derive(Debug)]
pub(super) struct ServerLink {
    runtime: Runtime,
    pub(super) rpc: Rpc,
    /// Longest time of one call.
    pub(super) deadline: Duration,
    /// When all of what is under way must have ended; none: each call has its own time.
    until: Cell<Option<Instant>>,
}

impl ServerLink {
    /// Connects within the deadline.
    pub(super) fn connect(uri: &str, access: &Access, deadline: Duration) -> Result<Self, Status> {
        if tokio::runtime::Handle::try_current().is_ok() {
            let text = "a blocking client was used from asynchronous code; call it on a thread of its own";
            return Err(Status::failed_precondition(text));
        }
        let address: Address = uri.parse().map_err(|error| Status::invalid_argument(format!("{error}")))?;
        let shown = CallToken::new(&address, access)?;
        let endpoint = Endpoint::from_shared(address.uri())
            .map_err(|error| Status::invalid_argument(error.to_string()))?
            .connect_timeout(deadline)
            .tcp_nodelay(true);
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(|error| Status::internal(format!("no asynchronous runtime: {error}")))?;
        let channel = within(&runtime, deadline, channel(&endpoint, &address, access))?;
        let rpc = BimorphClient::with_interceptor(channel, shown)
            .max_decoding_message_size(MESSAGE_BYTES)
            .max_encoding_message_size(MESSAGE_BYTES);
        Ok(Self { runtime, rpc, deadline, until: Cell::new(None) })
    }

    /// Bounds all calls until the next bound: together they end by then.
    pub(super) fn end_by(&self, until: Instant) {
        self.until.set(Some(until));
    }

    /// Runs one call to its end or to the deadline.
    pub(super) fn call<T>(&self, call: impl Future<Output = Result<T, Status>>) -> Result<T, Status> {
        let left = self.until.get().map(|until| until.saturating_duration_since(Instant::now()));
        let time = left.map_or(self.deadline, |left| left.min(self.deadline));
        let answer = within(&self.runtime, time, call);
        answer.map_err(|status| if left.is_some() && is_late(&status) { late(self.deadline) } else { status })
    }

    /// Compiles a netlist on the server. A netlist with errors returns all of them: a status has no space for that, so
    /// that they are requested.
    pub(super) fn compile(&self, bundle: &Bundle, options: &CompileOptions) -> Result<proto::ModelDescription, Status> {
        let (wire_bundle, wire_options) = (Some(bundle_to_wire(bundle)), Some(options_to_wire(options)));
        let request = proto::CompileRequest { bundle: wire_bundle.clone(), options: wire_options.clone() };
        let mut rpc = self.rpc.clone();
        match self.call(rpc.compile(request)) {
            Ok(response) => {
                let model = response.into_inner().model;
                let model = model.ok_or_else(|| unexpected("it compiled, but described no model"))?;
                reply_checks::model(&model).map_err(|what| unexpected(&what))?;
                Ok(model)
            }
            Err(status) if status.code() == Code::InvalidArgument => {
                let request = proto::CheckRequest { bundle: wire_bundle, options: wire_options };
                match self.call(rpc.check(request)).map(tonic::Response::into_inner) {
                    Ok(checked) if !checked.ok => Err(Status::invalid_argument(checked.rendered)),
                    _ => Err(status),
                }
            }
            Err(status) => Err(status),
        }
    }
}

/// A reply that refuses what the server does not have.
pub(super) fn is_not_found(reply: &proto::device_reply::Kind) -> bool {
    let proto::device_reply::Kind::Fault(proto::Fault { kind: Some(proto::fault::Kind::Refused(refused)), .. }) = reply
    else {
        return false;
    };
    refused.code == Code::NotFound as i32
}

async fn channel(endpoint: &Endpoint, address: &Address, access: &Access) -> Result<Channel, Status> {
    let connected = match address {
        Address::Tls { host, socket } => secured(endpoint, host, *socket, access).await?,
        _ => endpoint.connect().await,
    };
    connected.map_err(|error| {
        // the innermost cause says it all; the layers around it only repeat it
        let mut cause: &dyn std::error::Error = &error;
        while let Some(inner) = cause.source() {
            cause = inner;
        }
        Status::unavailable(format!("no connection: {cause}"))
    })
}

type Connected = Result<Channel, tonic::transport::Error>;

#[cfg(feature = "tls")]
async fn secured(endpoint: &Endpoint, host: &str, socket: SocketAddr, access: &Access) -> Result<Connected, Status> {
    let connect = super::secure::Connect::new(host, socket, access).map_err(|error| unusable(&error))?;
    Ok(endpoint.connect_with_connector(connect).await)
}

#[cfg(not(feature = "tls"))]
#[allow(clippy::unused_async)]
async fn secured(_: &Endpoint, host: &str, socket: SocketAddr, _: &Access) -> Result<Connected, Status> {
    Err(unusable(&AccessError::NoTls(format!("https://{host}:{}", socket.port()))))
}

fn within<T>(
    runtime: &Runtime,
    deadline: Duration,
    call: impl Future<Output = Result<T, Status>>,
) -> Result<T, Status> {
    runtime.block_on(async { tokio::time::timeout(deadline, call).await.unwrap_or_else(|_| Err(late(deadline))) })
}

fn late(deadline: Duration) -> Status {
    Status::deadline_exceeded(format!("{LATE} {} s", deadline.as_secs_f64()))
}

const LATE: &str = "no answer within";

fn is_late(status: &Status) -> bool {
    status.code() == Code::DeadlineExceeded && status.message().starts_with(LATE)
}

/// The status for a reply of an unexpected kind.
pub(super) fn unexpected(what: &str) -> Status {
    Status::internal(format!("unexpected reply: {what}; the server is faulty, of another version, or none of Bimorph"))
}

/// Whether the connection broke: a status that a server sent has no source, one that was made of a broken connection has.
pub(super) fn is_broken(status: &Status) -> bool {
    std::error::Error::source(status).is_some()
}

/// The message: a netlist's diagnostics as they are, anything else with its code.
pub(super) fn reason(status: &Status) -> String {
    reply_checks::text(&said(status))
}

fn said(status: &Status) -> String {
    match status.code() {
        Code::InvalidArgument | Code::FailedPrecondition | Code::DeadlineExceeded | Code::ResourceExhausted => {
            status.message().trim_end().to_owned()
        }
        _ if is_broken(status) => {
            #[cfg(feature = "tls")]
            if let Some(text) = super::secure::refused(status) {
                return text;
            }
            format!("the connection broke: the server was stopped or killed, or crashed ({})", status.message())
        }
        code => format!("{}: {}", code.description().to_lowercase(), status.message()),
    }
}
