//! Sessions that outlive streams, and the server where states are kept: how they begin, wake, and end.
//!
//! A session becomes reachable only when it is complete. A restore that stops, by its budget or by a fault, leaves
//! nothing behind, and the stored session stays stored.

use super::models::{NamedModel, check_size};
use super::session::Session;
use super::shared::ServerState;
use super::status;
use super::store::writer::SessionWriter;
use super::store::{ModelLoss, SessionStore};
use bimorph_wire::convert::{model as text, options as options_wire};
use std::sync::Arc;
use tonic::Status;

/// Stored files of a session under construction: removed unless it is completed.
struct RestoreGuard<'a> {
    store: Option<&'a SessionStore>,
    id: &'a str,
}

impl Drop for RestoreGuard<'_> {
    fn drop(&mut self) {
        if let Some(store) = self.store {
            store.forget(self.id);
        }
    }
}

impl ServerState {
    /// A new session, kept where states are kept, and what `start` says of it. Waits for the disk.
    pub(super) fn created<T>(
        &self,
        model: &Arc<NamedModel>,
        start: impl FnOnce(&Session) -> Result<T, Status>,
    ) -> Result<T, Status> {
        let id = self.sessions.id(&self.limits)?;
        let mut unfinished = RestoreGuard { store: self.store.as_deref(), id: &id };
        let keeper =
            self.store.as_ref().map(|store| SessionWriter::new(store, &id, model.id(), &model.source())).transpose();
        let keeper = keeper.map_err(|error| status::not_kept("the state is", &error))?;
        let session = Session::new(id.clone(), keeper, model, self.make, &self.limits)?;
        let said = start(&session)?;
        self.sessions.admit(session, &self.limits)?;
        unfinished.store = None;
        Ok(said)
    }

    /// A session with the states of a snapshot.
    pub(super) fn restored(
        &self,
        model: &Arc<NamedModel>,
        snapshot: &[u8],
    ) -> Result<bimorph_wire::proto::OpenResponse, Status> {
        self.created(model, |session| {
            let opened = session.restore(snapshot, &self.limits)?;
            session.keep_all().map(|()| opened)
        })
    }

    /// The session of that id, here or kept by an earlier server.
    pub(super) async fn session(self: &Arc<Self>, id: &str) -> Result<Arc<Session>, Status> {
        if let Ok(session) = self.sessions.get(id) {
            return Ok(session);
        }
        let Some(store) = self.store.clone().filter(|store| store.asleep(id).is_some()) else {
            // it may have woken meanwhile
            return self.sessions.get(id);
        };
        let (shared, id) = (Arc::clone(self), id.to_owned());
        self.desk.run(move || shared.wake(&store, &id)).await
    }

    /// Restores a stored session. Non-blocking: the first caller with matching states restores the session. If it was
    /// closed or continued meanwhile, the lookup is repeated.
    fn wake(&self, store: &Arc<SessionStore>, id: &str) -> Result<Arc<Session>, Status> {
        loop {
            let Some(asleep) = store.asleep(id) else { return self.sessions.get(id) };
            self.sessions.room(&self.limits)?;
            let kept = store.load(id, &asleep.model).ok_or_else(|| {
                match [0, 1].iter().any(|slot| store.session(id, &asleep.model, *slot).exists()) {
                    true => status::damaged("session", id, "open a new one"),
                    false => status::not_found("session", id),
                }
            })?;
            let model = self.model_of(store, &asleep.model)?;
            let keeper = SessionWriter::after(store, id, model.id(), &kept);
            let session = Session::new(id.to_owned(), Some(keeper), &model, self.make, &self.limits)?;
            session.restore(&kept.sealed, &self.limits)?;
            let longest = u64::try_from(self.limits.stream_idle.as_millis()).unwrap_or(u64::MAX);
            session.usage.lease(kept.lease_ms.min(longest));
            if let Some(woken) = store.wake(id, &asleep, || self.sessions.admit(session, &self.limits)) {
                return woken;
            }
        }
    }

    /// The model of a session that sleeps, compiled again where it is not here.
    fn model_of(&self, store: &SessionStore, id: &str) -> Result<Arc<NamedModel>, Status> {
        self.models.get(id).or_else(|_| {
            let source = store.model(id).map_err(|loss| match loss {
                ModelLoss::Missing => status::not_found("model", id),
                ModelLoss::Damaged => status::damaged("model", id, "compile it again, and open a new session"),
            })?;
            let bundle = text::bundle_from_wire(source.bundle).map_err(status::violation)?;
            check_size(&bundle, &self.limits)?;
            let options = options_wire::options_from_wire(source.options).map_err(status::violation)?;
            self.models.compile(bundle, options, &self.limits, self.make)
        })
    }

    /// Ends a session, open or asleep, and removes what is kept of it.
    pub(super) async fn close(&self, id: &str) -> Result<(), Status> {
        if let Some(store) = self.store.clone().filter(|store| store.asleep(id).is_some()) {
            let id = id.to_owned();
            if self.desk.run(move || Ok(store.forget_asleep(&id))).await? {
                return Ok(());
            }
        }
        let session = self.sessions.close(id).ok_or_else(|| status::not_found("session", id))?;
        if self.store.is_some() {
            let forget = move || {
                session.forget();
                Ok(())
            };
            self.desk.run(forget).await?;
        }
        Ok(())
    }
}
