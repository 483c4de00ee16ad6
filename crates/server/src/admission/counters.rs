//! Counters of admission: calls in progress, bytes of their requests, and the check of tokens.

use crate::accounts::{Account, Accounts, CountLease};
use crate::authentication::Guard;
use crate::limits::Limits;
use crate::metrics::{self, Metrics};
use crate::peer::Peer;
use crate::status;
use bimorph_wire::ids::Ids;
use std::sync::atomic::{AtomicI32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use tonic::body::Body;
use tonic::codegen::http;
use tonic::{Code, Status};

/// Counts for all services of a server.
pub(crate) struct AdmissionCounters {
    pub(crate) calls: AtomicUsize,
    /// Calls of health: those answered at once, and streams.
    pub(crate) health: [AtomicUsize; 2],
    pub(crate) held: AtomicUsize,
    pub(crate) most_calls: usize,
    pub(crate) most_held: usize,
    /// Bytes of requests of one connection, by the lengths that they announce.
    most_announced: usize,
    /// Bytes of one message.
    most_message: usize,
    pub(crate) pause: Duration,
    pub(crate) guard: Arc<Guard>,
    pub(crate) accounts: Arc<Accounts>,
    pub(crate) metrics: Arc<Metrics>,
    /// Prefix of the ids of requests, before their number.
    pub(crate) name: String,
    pub(crate) requests: AtomicU64,
}

/// Header with the name of a request, which the client may choose.
pub(crate) const REQUEST_ID: &str = "x-request-id";
/// Longest name that is taken from a client.
const LONGEST_ID: usize = 64;

/// A service without tokens, since monitoring has none.
pub(crate) const OPEN: &str = "grpc.health.v1.Health";
/// Calls of it at once of each kind: `Check`, and the stream `Watch`.
const HEALTH_CALLS: usize = 64;
/// Bytes of a request of it.
const HEALTH_BYTES: usize = 1 << 10;

impl AdmissionCounters {
    pub(crate) fn new(
        limits: &Limits,
        guard: Arc<Guard>,
        metrics: Arc<Metrics>,
        accounts: &Arc<Accounts>,
    ) -> Arc<Self> {
        let name = Ids::default().make().map_or_else(|_| "request".to_owned(), |id| id[..8].to_owned());
        Arc::new(Self {
            calls: AtomicUsize::new(0),
            health: Default::default(),
            held: AtomicUsize::new(0),
            most_calls: limits.calls,
            most_held: limits.held_bytes,
            most_announced: limits.connection_bytes.max(limits.message_bytes),
            most_message: limits.message_bytes,
            pause: limits.request_pause,
            guard,
            accounts: Arc::clone(accounts),
            metrics,
            name,
            requests: AtomicU64::new(1),
        })
    }

    /// Calls under way.
    pub(crate) fn calls(&self) -> usize {
        self.calls.load(Ordering::Relaxed)
    }

    /// Bytes of requests that are held.
    pub(crate) fn held(&self) -> usize {
        self.held.load(Ordering::Relaxed)
    }

    /// The name of a request: the client's, or the next one of this server.
    pub(crate) fn request_id(&self, headers: &http::HeaderMap) -> http::HeaderValue {
        let is_name = |value: &&http::HeaderValue| {
            (1..=LONGEST_ID).contains(&value.len()) && value.as_bytes().iter().all(u8::is_ascii_graphic)
        };
        headers.get(REQUEST_ID).filter(is_name).cloned().unwrap_or_else(|| {
            let number = self.requests.fetch_add(1, Ordering::Relaxed);
            let name = http::HeaderValue::try_from(format!("{}-{number}", self.name));
            name.unwrap_or(http::HeaderValue::from_static("request"))
        })
    }

    pub(crate) fn enter(self: &Arc<Self>, request: &http::Request<Body>, is_health: bool) -> AdmittedCall {
        let path = request.uri().path();
        let call = AdmittedCall {
            gate: Arc::clone(self),
            presence: request.extensions().get().cloned(),
            health: is_health.then(|| usize::from(path.ends_with("/Watch"))),
            held: AtomicUsize::new(0),
            announced: Mutex::default(),
            counted: OnceLock::new(),
            place: metrics::place(path),
            started: Instant::now(),
            // for a call that is dropped before its end
            code: AtomicI32::new(Code::Cancelled as i32),
        };
        // a connection with health calls alone is idle, and yields to others
        if let (Some(presence), None) = (&call.presence, call.health) {
            presence.begin();
        }
        // from here the call gives back what it took when it is dropped
        call.count().fetch_add(1, Ordering::Relaxed);
        call
    }

    /// Whether a call is admitted, and its account.
    pub(crate) fn admit(&self, call: &AdmittedCall, headers: &http::HeaderMap) -> Result<Arc<Account>, Status> {
        let presence =
            call.presence.as_ref().ok_or_else(|| Status::unauthenticated("the client of this call is unknown"))?;
        let (most, name) = if call.is_health() { (HEALTH_CALLS, "health") } else { (self.most_calls, "calls") };
        if call.count().load(Ordering::Relaxed) > most {
            return Err(status::limit(name, most, "one more; end some"));
        }
        let known = if call.is_health() { self.guard.hear(presence) } else { self.guard.admit(presence, headers) };
        let account = self.accounts.of(&known?.to_string());
        if !call.is_health() {
            if presence.counted.get().is_none() {
                let _ = presence.counted.set(account.connection()?);
            }
            let _ = call.counted.set(account.call()?);
        }
        Ok(account)
    }
}

/// One call, from its first byte until its answer is sent.
pub(crate) struct AdmittedCall {
    pub(crate) gate: Arc<AdmissionCounters>,
    pub(crate) presence: Option<Arc<Peer>>,
    /// Its kind among those of health; none: any other.
    pub(crate) health: Option<usize>,
    pub(crate) held: AtomicUsize,
    /// Bytes that its request announces, and whose account has them.
    announced: Mutex<(usize, Option<Arc<Account>>)>,
    /// Its place in the account of its client.
    counted: OnceLock<CountLease>,
    /// Its place among the calls that are counted.
    pub(crate) place: usize,
    pub(crate) started: Instant,
    /// How it ended.
    pub(crate) code: AtomicI32,
}

impl AdmittedCall {
    /// The count that it is in.
    pub(crate) fn count(&self) -> &AtomicUsize {
        self.health.map_or(&self.gate.calls, |kind| &self.gate.health[kind])
    }

    /// Whether it is a health call.
    pub(crate) fn is_health(&self) -> bool {
        self.health.is_some()
    }

    /// How long its request may pause.
    pub(crate) fn longest_pause(&self) -> Duration {
        self.gate.pause
    }

    /// How it ended, as far as is known.
    pub(crate) fn code(&self) -> Code {
        Code::from_i32(self.code.load(Ordering::Relaxed))
    }

    /// How long it has taken so far.
    pub(crate) fn time(&self) -> Duration {
        self.started.elapsed()
    }

    /// Takes note of the code in headers or trailers.
    pub(crate) fn hear(&self, headers: &http::HeaderMap) {
        let code = headers.get("grpc-status").and_then(|value| value.to_str().ok()).and_then(|text| text.parse().ok());
        if let Some(code) = code {
            self.code.store(code, Ordering::Relaxed);
        }
    }

    /// More of its request has come.
    pub(crate) fn hold(&self, bytes: usize) -> Result<(), Status> {
        let own = self.held.fetch_add(bytes, Ordering::Relaxed) + bytes;
        if self.is_health() {
            return if own > HEALTH_BYTES { Err(long_health()) } else { Ok(()) };
        }
        let held = self.gate.held.fetch_add(bytes, Ordering::Relaxed) + bytes;
        if held > self.gate.most_held {
            return Err(status::limit("held_bytes", self.gate.most_held, held));
        }
        Ok(())
    }

    /// A message of its request announces its length, which counts before any of it has come.
    pub(crate) fn announce(&self, bytes: usize, account: &Arc<Account>) -> Result<(), Status> {
        if self.is_health() {
            return if bytes > HEALTH_BYTES { Err(long_health()) } else { Ok(()) };
        }
        if bytes > self.gate.most_message {
            return Err(status::limit("message_bytes", self.gate.most_message, bytes));
        }
        let mut announced = self.announced.lock().unwrap_or_else(PoisonError::into_inner);
        account.announce(bytes)?;
        if let Some(presence) = &self.presence {
            let all = presence.requests.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
            if all > self.gate.most_announced {
                presence.requests.fetch_sub(bytes, Ordering::Relaxed);
                account.release(bytes);
                return Err(status::limit("connection_bytes", self.gate.most_announced, all));
            }
        }
        announced.0 += bytes;
        announced.1 = Some(Arc::clone(account));
        Ok(())
    }

    /// Releases the received and announced bytes.
    pub(crate) fn release(&self) {
        let announced = std::mem::take(&mut *self.announced.lock().unwrap_or_else(PoisonError::into_inner));
        if let (bytes, Some(account)) = announced {
            account.release(bytes);
            self.presence.iter().for_each(|presence| {
                presence.requests.fetch_sub(bytes, Ordering::Relaxed);
            });
        }
        let bytes = self.held.swap(0, Ordering::Relaxed);
        if !self.is_health() {
            self.gate.held.fetch_sub(bytes, Ordering::Relaxed);
        }
    }
}

fn long_health() -> Status {
    Status::resource_exhausted(format!("a request of health has at most {HEALTH_BYTES} bytes"))
}

impl Drop for AdmittedCall {
    fn drop(&mut self) {
        self.release();
        self.count().fetch_sub(1, Ordering::Relaxed);
        self.gate.metrics.ended(self.place, self.code(), self.time());
        if let (Some(presence), None) = (&self.presence, self.health) {
            presence.end();
        }
    }
}
