//! Accounts of clients: sessions, their unknowns, bytes of requests, and the quota of computations. The limits whose
//! names begin with `client_` bound them.

use super::limits::Limits;
use super::status;
use bimorph_base::budget::OwnerQuota;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tonic::Status;

/// The accounts of a server, by the names of clients.
pub(super) struct Accounts {
    bounds: Bounds,
    /// Bytes of all open sessions.
    sessions: Arc<SessionByteQuota>,
    open: Mutex<BTreeMap<String, Arc<Account>>>,
}

/// Limits of one client; 0: unlimited.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    sessions: usize,
    unknowns: usize,
    bytes: usize,
    cpu: Duration,
    held: usize,
    memory: usize,
    calls: usize,
    streams: usize,
    connections: usize,
}

/// Account of one client.
#[derive(Debug)]
pub(super) struct Account {
    name: String,
    bounds: Bounds,
    held: Mutex<AccountUsage>,
    sessions: Arc<SessionByteQuota>,
    /// Calls under way.
    calls: AtomicUsize,
    /// Transients and tables that are being sent.
    streams: AtomicUsize,
    /// Connections with calls.
    connections: AtomicUsize,
    /// Bytes of its requests, by the lengths that they announce.
    requests: AtomicUsize,
    /// Quota of its computations, where it is bounded.
    pub(super) purse: Option<Arc<OwnerQuota>>,
}

/// Bytes of the sessions of all clients, as they are counted.
#[derive(Debug)]
struct SessionByteQuota {
    most: usize,
    used: Mutex<usize>,
}

/// Bytes of a session for each unknown of its model: a device with its factorization and a few states of a grid of 15 500 unknowns takes
/// 55 MB.
const SESSION_BYTES: usize = 4 << 10;
/// The same for each port and unknown: sensitivities in all stages of a step.
const PORT_BYTES: usize = 176;

#[derive(Debug, Default, Clone, Copy)]
struct AccountUsage {
    sessions: usize,
    unknowns: usize,
    /// Bytes of its sessions, as they are counted.
    bytes: usize,
}

/// A session in an account; dropped, it is not there any more.
#[derive(Debug)]
pub(super) struct SessionLease {
    account: Arc<Account>,
    unknowns: usize,
    bytes: usize,
}

impl Accounts {
    /// None yet.
    pub(super) fn new(limits: &Limits) -> Self {
        let bounds = Bounds {
            sessions: limits.client_sessions,
            unknowns: limits.client_unknowns,
            bytes: limits.client_bytes,
            cpu: limits.client_cpu,
            held: limits.client_held_bytes,
            memory: limits.client_session_memory,
            calls: limits.client_calls,
            streams: limits.client_result_streams,
            connections: limits.client_connections,
        };
        let sessions = Arc::new(SessionByteQuota { most: limits.session_memory, used: Mutex::default() });
        Self { bounds, sessions, open: Mutex::default() }
    }

    /// The account of a client.
    pub(super) fn of(&self, name: &str) -> Arc<Account> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(account) = open.get(name) {
            return Arc::clone(account);
        }
        let bounds = self.bounds;
        let any = |most: usize| (most > 0).then_some(most);
        let (bytes, cpu) = (any(bounds.bytes), (!bounds.cpu.is_zero()).then_some(bounds.cpu));
        let purse = (bytes.is_some() || cpu.is_some()).then(|| Arc::new(OwnerQuota::new(bytes, cpu)));
        let account = Arc::new(Account {
            name: name.to_owned(),
            bounds,
            held: Mutex::default(),
            sessions: Arc::clone(&self.sessions),
            calls: AtomicUsize::new(0),
            streams: AtomicUsize::new(0),
            connections: AtomicUsize::new(0),
            requests: AtomicUsize::new(0),
            purse,
        });
        open.insert(name.to_owned(), Arc::clone(&account));
        account
    }
}

impl Account {
    /// Name of the client.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// A place for a session of so many unknowns.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED with what is used and what is allowed.
    pub(super) fn seat(self: &Arc<Self>, unknowns: usize) -> Result<SessionLease, Status> {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        for (limit, most, used, more) in [
            ("client_sessions", self.bounds.sessions, held.sessions, 1),
            ("client_unknowns", self.bounds.unknowns, held.unknowns, unknowns),
        ] {
            if most > 0 && used.saturating_add(more) > most {
                return Err(self.refused(limit, most, (used, more), "close a session"));
            }
        }
        held.sessions += 1;
        held.unknowns += unknowns;
        drop(held);
        let mut seat = SessionLease { account: Arc::clone(self), unknowns, bytes: 0 };
        seat.open(0)?;
        Ok(seat)
    }

    fn refused(&self, limit: &str, most: usize, (used, more): (usize, usize), way_out: &str) -> Status {
        Status::resource_exhausted(format!(
            "{limit}: at most {most} for client \"{}\", {used} used, {more} more requested; {way_out}, or see Info for the \
             limits of this server",
            self.name
        ))
    }

    /// One more call.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED; then it is not counted.
    pub(super) fn call(self: &Arc<Self>) -> Result<CountLease, Status> {
        self.count(|account| &account.calls, "client_calls", self.bounds.calls, "wait for others")
    }

    /// One more transient or table that is being sent.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED; then it is not counted.
    pub(super) fn stream(self: &Arc<Self>) -> Result<CountLease, Status> {
        let way_out = "read or end those that are open";
        self.count(|account| &account.streams, "client_result_streams", self.bounds.streams, way_out)
    }

    /// One more connection with calls.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED; then it is not counted.
    pub(super) fn connection(self: &Arc<Self>) -> Result<CountLease, Status> {
        self.count(
            |account| &account.connections,
            "client_connections",
            self.bounds.connections,
            "use one of those that are open",
        )
    }

    fn count(
        self: &Arc<Self>,
        of: fn(&Self) -> &AtomicUsize,
        limit: &str,
        most: usize,
        way_out: &str,
    ) -> Result<CountLease, Status> {
        let used = of(self).fetch_add(1, Ordering::Relaxed);
        let counted = CountLease { account: Arc::clone(self), of };
        if most > 0 && used >= most { Err(self.refused(limit, most, (used, 1), way_out)) } else { Ok(counted) }
    }

    /// Takes the bytes of a request that was announced.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED; then none are taken.
    pub(super) fn announce(&self, bytes: usize) -> Result<(), Status> {
        let used = self.requests.fetch_add(bytes, Ordering::Relaxed);
        if self.bounds.held == 0 || used.saturating_add(bytes) <= self.bounds.held {
            return Ok(());
        }
        self.release(bytes);
        Err(self.refused("client_held_bytes", self.bounds.held, (used, bytes), "wait for the answers to others"))
    }

    /// Gives bytes of requests back.
    pub(super) fn release(&self, bytes: usize) {
        self.requests.fetch_sub(bytes, Ordering::Relaxed);
    }
}

/// A call or a connection of a client; dropped, it is not there any more.
#[derive(Debug)]
pub(super) struct CountLease {
    account: Arc<Account>,
    of: fn(&Account) -> &AtomicUsize,
}

impl Drop for CountLease {
    fn drop(&mut self) {
        (self.of)(&self.account).fetch_sub(1, Ordering::Relaxed);
    }
}

impl SessionLease {
    /// Takes the bytes of a device with so many ports.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED; then what was taken before stays.
    pub(super) fn open(&mut self, ports: usize) -> Result<(), Status> {
        let bytes = SESSION_BYTES.saturating_add(PORT_BYTES.saturating_mul(ports)).saturating_mul(self.unknowns);
        let account = &self.account;
        let mut held = account.held.lock().unwrap_or_else(PoisonError::into_inner);
        let others = held.bytes.saturating_sub(self.bytes);
        let (most, all) = (account.bounds.memory, others.saturating_add(bytes));
        if most > 0 && all > most {
            return Err(account.refused("client_session_memory", most, (others, bytes), "close a session"));
        }
        let mut used = account.sessions.used.lock().unwrap_or_else(PoisonError::into_inner);
        let whole = used.saturating_sub(self.bytes).saturating_add(bytes);
        if whole > account.sessions.most {
            return Err(status::limit(
                "session_memory",
                account.sessions.most,
                format!("{whole} bytes; close a session"),
            ));
        }
        (*used, held.bytes, self.bytes) = (whole, all, bytes);
        Ok(())
    }

    /// Quota of the client's computations, where it is bounded.
    pub(super) fn purse(&self) -> Option<Arc<OwnerQuota>> {
        self.account.purse.clone()
    }
}

impl Drop for SessionLease {
    fn drop(&mut self) {
        let mut held = self.account.held.lock().unwrap_or_else(PoisonError::into_inner);
        held.sessions -= 1;
        held.unknowns -= self.unknowns;
        let mut used = self.account.sessions.used.lock().unwrap_or_else(PoisonError::into_inner);
        *used = used.saturating_sub(self.bytes);
        held.bytes = held.bytes.saturating_sub(self.bytes);
    }
}
