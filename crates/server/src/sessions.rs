//! The open sessions: their number, and their expiry.

use super::limits::Limits;
use super::session::Session;
use super::status;
use bimorph_wire::ids::Ids;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tonic::Status;

/// The sessions of a server.
#[derive(Default)]
pub(super) struct SessionRegistry {
    open: Mutex<BTreeMap<String, Arc<Session>>>,
    ids: Ids,
}

impl SessionRegistry {
    fn open(&self) -> MutexGuard<'_, BTreeMap<String, Arc<Session>>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// An id for one more.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED where there is no room for it.
    pub(super) fn id(&self, limits: &Limits) -> Result<String, Status> {
        self.room(limits)?;
        self.ids.make()
    }

    /// Whether there is room for one more.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED.
    pub(super) fn room(&self, limits: &Limits) -> Result<(), Status> {
        let open = self.open().values().filter(|session| !session.is_closed()).count();
        if open >= limits.sessions { Err(full(limits)) } else { Ok(()) }
    }

    /// Takes in a session, which from now on is found by its id.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED.
    pub(super) fn admit(&self, session: Arc<Session>, limits: &Limits) -> Result<Arc<Session>, Status> {
        let mut open = self.open();
        open.retain(|_, session| !session.is_closed());
        if open.len() >= limits.sessions {
            return Err(full(limits));
        }
        open.insert(session.id().to_owned(), Arc::clone(&session));
        tracing::debug!(session = session.id(), model = session.model().id(), open = open.len(), "session");
        Ok(session)
    }

    /// The session of that id.
    pub(super) fn get(&self, id: &str) -> Result<Arc<Session>, Status> {
        let open = self.open();
        let found = open.get(id).filter(|session| !session.is_closed());
        found.cloned().ok_or_else(|| status::not_found("session", id))
    }

    /// Closes a session, if there is one; its stored files are removed soon after.
    pub(super) fn close(&self, id: &str) -> Option<Arc<Session>> {
        let session = self.open().remove(id);
        session.inspect(|session| session.close())
    }

    /// Removes sessions that were unused for long; returns their number.
    pub(super) fn expire(&self, limits: &Limits) -> usize {
        let mut open = self.open();
        // what is kept of one that is closed already is not its own any more
        open.retain(|_, session| !session.is_closed());
        let old: Vec<_> = open.values().filter(|session| session.usage.is_over(limits)).cloned().collect();
        for session in &old {
            open.remove(session.id());
        }
        drop(open);
        old.iter().for_each(|session| session.close());
        old.len()
    }

    /// Sessions open now.
    pub(super) fn len(&self) -> usize {
        self.open().len()
    }
}

fn full(limits: &Limits) -> Status {
    status::limit("sessions", limits.sessions, "one more; close one")
}
