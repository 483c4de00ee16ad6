//! What each client has of a server: its sessions, their unknowns, and what its computations draw on. The limits whose names begin
//! with `client_` bound them; without such limits nothing is counted.

use super::limits::Limits;
use crate::budget::Purse;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tonic::Status;

/// The accounts of a server, by the names of clients.
pub(super) struct Accounts {
    bounds: Option<Bounds>,
    open: Mutex<BTreeMap<String, Arc<Account>>>,
}

/// What one client may have; 0 is any.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    sessions: usize,
    unknowns: usize,
    bytes: usize,
    cpu: Duration,
}

/// What one client has.
#[derive(Debug)]
pub(super) struct Account {
    name: String,
    bounds: Bounds,
    held: Mutex<Held>,
    pub(super) purse: Arc<Purse>,
}

#[derive(Debug, Default, Clone, Copy)]
struct Held {
    sessions: usize,
    unknowns: usize,
}

/// A session in an account; dropped, it is not there any more.
#[derive(Debug)]
pub(super) struct Seat {
    account: Arc<Account>,
    unknowns: usize,
}

impl Accounts {
    /// None yet.
    pub(super) fn new(limits: &Limits) -> Self {
        let Limits {
            client_sessions: sessions, client_unknowns: unknowns, client_bytes: bytes, client_cpu: cpu, ..
        } = *limits;
        let bounded = sessions > 0 || unknowns > 0 || bytes > 0 || !cpu.is_zero();
        Self { bounds: bounded.then_some(Bounds { sessions, unknowns, bytes, cpu }), open: Mutex::default() }
    }

    /// The account of a client; none where nothing is bounded.
    pub(super) fn of(&self, name: &str) -> Option<Arc<Account>> {
        let bounds = self.bounds?;
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(account) = open.get(name) {
            return Some(Arc::clone(account));
        }
        let any = |most: usize| (most > 0).then_some(most);
        let purse = Purse::new(any(bounds.bytes), (!bounds.cpu.is_zero()).then_some(bounds.cpu));
        let account = Account { name: name.to_owned(), bounds, held: Mutex::default(), purse: Arc::new(purse) };
        Some(Arc::clone(open.entry(name.to_owned()).or_insert(Arc::new(account))))
    }
}

impl Account {
    /// A place for a session of so many unknowns.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED with what is used and what is allowed.
    pub(super) fn seat(self: &Arc<Self>, unknowns: usize) -> Result<Seat, Status> {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        for (limit, most, used, more) in [
            ("client_sessions", self.bounds.sessions, held.sessions, 1),
            ("client_unknowns", self.bounds.unknowns, held.unknowns, unknowns),
        ] {
            if most > 0 && used.saturating_add(more) > most {
                let text = format!(
                    "{limit}: at most {most} for client \"{}\", {used} used, {more} more asked for; close a session, or \
                     see Info for the limits of this server",
                    self.name
                );
                return Err(Status::resource_exhausted(text));
            }
        }
        held.sessions += 1;
        held.unknowns += unknowns;
        Ok(Seat { account: Arc::clone(self), unknowns })
    }
}

impl Seat {
    /// What the client's computations draw on.
    pub(super) fn purse(&self) -> Arc<Purse> {
        Arc::clone(&self.account.purse)
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let mut held = self.account.held.lock().unwrap_or_else(PoisonError::into_inner);
        held.sessions -= 1;
        held.unknowns -= self.unknowns;
    }
}
