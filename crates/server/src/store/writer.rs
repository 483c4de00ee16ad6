//! Storage of one session: two files in turn, each with a checksum, one of which is always valid.

use super::SessionStore;
use super::record::SessionRecord;
use bimorph_device::{Device, DeviceError, Token};
use bimorph_wire::proto;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};

/// Keeps the states of one session.
#[derive(Debug)]
pub(crate) struct SessionWriter {
    store: Arc<SessionStore>,
    id: String,
    model: String,
    sequence: u64,
    /// The last accepted state; 0: none yet.
    pub(crate) accepted: u64,
    /// For how long the session is kept without use (ms); 0: as long as any.
    pub(crate) lease_ms: u64,
}

impl SessionWriter {
    /// Of a new session of a model.
    ///
    /// # Errors
    /// The system's error, or the exceeded limit.
    pub(crate) fn new(
        store: &Arc<SessionStore>,
        id: &str,
        model: &str,
        source: &proto::CompileRequest,
    ) -> io::Result<Self> {
        store.begin(id, model, source)?;
        Ok(Self::of(store, id, model, 0, 0, 0))
    }

    /// Of one that continues; it is stored until [`SessionStore::wake`].
    pub(crate) fn after(store: &Arc<SessionStore>, id: &str, model: &str, kept: &SessionRecord) -> Self {
        Self::of(store, id, model, kept.sequence, kept.accepted, kept.lease_ms)
    }

    fn of(store: &Arc<SessionStore>, id: &str, model: &str, sequence: u64, accepted: u64, lease_ms: u64) -> Self {
        Self { store: Arc::clone(store), id: id.to_owned(), model: model.to_owned(), sequence, accepted, lease_ms }
    }

    /// Keeps `sealed`, whose last accepted state is `accepted`. When this returns it is on the disk, or, with syncing
    /// disabled, with the system.
    ///
    /// # Errors
    /// The system's error, or the exceeded limit; the state stored before is still there.
    pub(crate) fn keep(&mut self, accepted: u64, sealed: &[u8]) -> io::Result<()> {
        let sequence = self.sequence + 1;
        let path = self.store.session(&self.id, &self.model, sequence % 2);
        let bytes = SessionRecord::write(sequence, accepted, self.lease_ms, sealed);
        self.store.counted(&path, bytes.len(), || {
            self.store.disk().write(&path, &bytes)?;
            // the name of a new file is kept by its folder
            if sequence <= 2 { self.store.disk().keep_names(&self.store.folder.join("sessions")) } else { Ok(()) }
        })?;
        (self.sequence, self.accepted) = (sequence, accepted);
        Ok(())
    }

    /// Keeps for how long the session is kept without use (ms), beside its states as they are.
    ///
    /// # Errors
    /// As [`Self::keep`]; earlier requests stay in force.
    pub(crate) fn lease(&mut self, lease_ms: u64) -> io::Result<()> {
        let before = std::mem::replace(&mut self.lease_ms, lease_ms);
        let kept = (before != lease_ms).then(|| self.store.load(&self.id, &self.model)).flatten();
        let written = kept.map_or(Ok(()), |kept| self.keep(kept.accepted, &kept.sealed));
        written.inspect_err(|_| self.lease_ms = before)
    }

    /// The stored state waits for a request.
    pub(crate) fn sleep(&self) {
        self.store.sleep(&self.id);
    }

    /// Removes what is kept.
    pub(crate) fn forget(&self) {
        self.store.forget(&self.id);
    }
}

/// Removes the stored state of a closed session. A concurrent write finishes first, and later ones find the session
/// closed.
pub(crate) fn forget(keeper: &Mutex<SessionWriter>) {
    keeper.lock().unwrap_or_else(PoisonError::into_inner).forget();
}

/// A state as bytes, with those that a client may go back to: the one it was tried from, and the one accepted `before`.
/// A client that did not receive the reply to an accept repeats its step, or takes another one, from the last state
/// that it knows.
pub(crate) fn with_those_before(device: &dyn Device, token: Token, before: Token) -> Result<Vec<u8>, DeviceError> {
    let mut tokens = vec![token];
    for other in [device.parent(token), Some(before)].into_iter().flatten() {
        if other.0 != 0 && !tokens.contains(&other) {
            tokens.insert(0, other);
        }
    }
    loop {
        match device.save(Some(&tokens)) {
            // one that is not held any more
            Err(DeviceError::UnknownToken(unknown)) if unknown != token && tokens.contains(&unknown) => {
                tokens.retain(|token| *token != unknown);
            }
            saved => return saved,
        }
    }
}
