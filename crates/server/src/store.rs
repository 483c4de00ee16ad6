//! States that outlive the server: a folder with the accepted states of every session that a unary call opened.
//!
//! Each session has two files, `sessions/ID.0` and `ID.1`, written in turn: when one is being written, the other holds
//! what was accepted before, so that whatever moment the server ends at, one of them is whole. A file holds the last
//! two accepted states, as a client may not have heard of the last one. Beside them `models/ID` holds each netlist with
//! its options and a checksum, from which the model is compiled again; `jobs` has files of its own (`jobs::folder`). Only the owner
//! can read any of it.
//!
//! The folder is bounded: two files a session, and `state_bytes` in all, jobs among them.

mod model_record;
pub(super) mod record;
pub mod scan;
pub(super) mod writer;

use super::byte_quota::ByteQuota;
use bimorph_jobs::durable::disk::{Disk, private_file};
use bimorph_wire::proto;
use record::SessionRecord;
use scan::{StoreError, StoreScan};
use std::collections::BTreeMap;
use std::fs::{self, DirBuilder, File};
use std::io;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How long a folder that another holds is waited for.
const PATIENCE: Duration = Duration::from_secs(1);

/// The folder of a server.
#[derive(Debug)]
pub(super) struct SessionStore {
    pub(super) folder: PathBuf,
    /// Held as long as the server runs.
    _lock: File,
    disk: Disk,
    room: ByteQuota,
    /// Every session that is kept.
    sessions: Mutex<BTreeMap<String, StoredSession>>,
    /// Held while models are written or removed.
    files: Mutex<()>,
}

/// A session that is kept.
#[derive(Debug)]
struct StoredSession {
    model: String,
    /// Since when it waits for a request; `None`: it is in use.
    asleep: Option<Instant>,
}

/// Why there is no netlist of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ModelLoss {
    /// There is no file that can be read.
    Missing,
    /// The file is damaged, or of another version.
    Damaged,
}

/// A session that waits for a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct WaitingSession {
    /// The id of its model.
    pub(super) model: String,
    since: Instant,
}

impl SessionStore {
    /// Opens or makes the folder, and finds what an earlier server left there. It stays, however old it is: the time without use
    /// counts from here.
    ///
    /// # Errors
    /// [`StoreError`].
    pub(super) fn open(folder: &Path, sync: bool, most: usize) -> Result<Self, StoreError> {
        Self::open_on(Disk::new(sync), folder, most)
    }

    /// The same on this disk.
    pub(super) fn open_on(disk: Disk, folder: &Path, most: usize) -> Result<Self, StoreError> {
        let wrong = |reason| StoreError::Folder { path: folder.to_owned(), reason };
        for path in [folder.to_owned(), folder.join("sessions"), folder.join("models"), folder.join("jobs")] {
            DirBuilder::new().recursive(true).mode(0o700).create(path).map_err(wrong)?;
        }
        // the names of new folders are kept by those that they are in
        let above = folder.parent().filter(|path| !path.as_os_str().is_empty()).unwrap_or(Path::new("."));
        [folder, above].iter().try_for_each(|folder| disk.keep_names(folder)).map_err(wrong)?;
        let lock = private_file().open(folder.join("lock")).map_err(wrong)?;
        // one that is about to end, or a process that it was about to begin, may still hold it
        let patience = Instant::now() + PATIENCE;
        loop {
            match lock.try_lock() {
                Ok(()) => break,
                Err(fs::TryLockError::WouldBlock) if Instant::now() < patience => std::thread::sleep(PATIENCE / 50),
                Err(fs::TryLockError::WouldBlock) => return Err(StoreError::InUse { path: folder.to_owned() }),
                Err(fs::TryLockError::Error(reason)) => return Err(wrong(reason)),
            }
        }
        let found = StoreScan::of(folder).map_err(wrong)?;
        for path in found.left {
            let _ = fs::remove_file(path);
        }
        let asleep = Some(Instant::now());
        let sessions = found.sessions.into_iter().map(|(id, model)| (id, StoredSession { model, asleep })).collect();
        Ok(Self {
            folder: folder.to_owned(),
            _lock: lock,
            disk,
            room: ByteQuota::new(most, found.bytes),
            sessions: Mutex::new(sessions),
            files: Mutex::default(),
        })
    }

    fn entries(&self) -> MutexGuard<'_, BTreeMap<String, StoredSession>> {
        self.sessions.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Held while models are written or removed.
    fn hold(&self) -> MutexGuard<'_, ()> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a session waits for a request.
    pub(super) fn asleep(&self, id: &str) -> Option<WaitingSession> {
        let entries = self.entries();
        let StoredSession { model, asleep } = entries.get(id)?;
        asleep.map(|since| WaitingSession { model: model.clone(), since })
    }

    /// Ends the sleep of a session that still sleeps as it did, where `admit` has room for it; none: it woke or ended meanwhile.
    pub(super) fn wake<T, E>(
        &self,
        id: &str,
        as_it_did: &WaitingSession,
        admit: impl FnOnce() -> Result<T, E>,
    ) -> Option<Result<T, E>> {
        let mut entries = self.entries();
        let entry = entries.get_mut(id).filter(|entry| entry.asleep == Some(as_it_did.since))?;
        Some(admit().inspect(|_| entry.asleep = None))
    }

    /// A session waits for a request from now on.
    pub(super) fn sleep(&self, id: &str) {
        if let Some(entry) = self.entries().get_mut(id) {
            entry.asleep = Some(Instant::now());
        }
    }

    /// Where all of it is written.
    pub(super) fn disk(&self) -> &Disk {
        &self.disk
    }

    /// Sessions that are kept.
    pub(super) fn len(&self) -> usize {
        self.entries().len()
    }

    /// Bytes of all that is kept.
    pub(super) fn used(&self) -> usize {
        self.room.used()
    }

    /// Room for what others keep here.
    pub(super) fn room(&self) -> &ByteQuota {
        &self.room
    }

    /// Removes sessions without a request in `time`; returns their number.
    pub(super) fn expire(&self, time: Duration) -> usize {
        let is_old = |entry: &StoredSession| entry.asleep.is_some_and(|since| since.elapsed() >= time);
        let old: Vec<String> = self.entries().iter().filter(|(_, e)| is_old(e)).map(|(id, _)| id.clone()).collect();
        // a client may request one of them just now
        old.iter().filter(|id| self.forget_where(id, is_old)).count()
    }

    /// The stored state of a session: the newer of its valid files.
    pub(super) fn load(&self, id: &str, model: &str) -> Option<SessionRecord> {
        let read = |slot| {
            let bytes = fs::read(self.session(id, model, slot)).ok()?;
            let kept = SessionRecord::read(&bytes);
            if kept.is_none() {
                let text =
                    "a file of its states is not whole: a write was cut off, or it is damaged; the one before it holds";
                tracing::warn!(session = id, slot, "{text}");
            }
            kept
        };
        [read(0), read(1)].into_iter().flatten().max_by_key(|kept| kept.sequence)
    }

    /// Removes what is kept of a session, and its model where no other session has it.
    pub(super) fn forget(&self, id: &str) {
        self.forget_where(id, |_| true);
    }

    /// The same of a session that is asleep; whether it was.
    pub(super) fn forget_asleep(&self, id: &str) -> bool {
        self.forget_where(id, |entry| entry.asleep.is_some())
    }

    fn forget_where(&self, id: &str, wanted: impl FnOnce(&StoredSession) -> bool) -> bool {
        let _hold = self.hold();
        let mut entries = self.entries();
        if !entries.get(id).is_some_and(wanted) {
            return false;
        }
        let Some(StoredSession { model, .. }) = entries.remove(id) else { return false };
        let is_last = !entries.values().any(|entry| entry.model == model);
        drop(entries);
        for slot in [0, 1] {
            self.remove(&self.session(id, &model, slot));
        }
        if is_last {
            self.remove(&self.folder.join("models").join(model));
        }
        true
    }

    fn remove(&self, path: &Path) {
        let bytes = size(path);
        if fs::remove_file(path).is_ok() {
            self.room.count(bytes, 0);
        }
    }

    pub(super) fn session(&self, id: &str, model: &str, slot: u64) -> PathBuf {
        self.folder.join("sessions").join(format!("{id}-{model}.{slot}"))
    }

    /// A new session of a model, whose netlist and options are kept, once.
    pub(super) fn begin(&self, id: &str, model: &str, source: &proto::CompileRequest) -> io::Result<()> {
        let _hold = self.hold();
        self.keep_model(model, source)?;
        self.entries().insert(id.to_owned(), StoredSession { model: model.to_owned(), asleep: None });
        Ok(())
    }

    fn keep_model(&self, id: &str, source: &proto::CompileRequest) -> io::Result<()> {
        let path = self.folder.join("models").join(id);
        let bytes = model_record::write(source);
        // one that the machine left half written when it lost its power is not what it should be
        if fs::read(&path).is_ok_and(|held| held == bytes) {
            return Ok(());
        }
        let unfinished = path.with_extension(format!("{}.new", std::process::id()));
        self.counted(&path, bytes.len(), || self.disk.replace(&path, &unfinished, &bytes))
    }

    /// The netlist and the options of a model.
    ///
    /// # Errors
    /// [`ModelLoss`].
    pub(super) fn model(&self, id: &str) -> Result<proto::CompileRequest, ModelLoss> {
        let bytes = fs::read(self.folder.join("models").join(id)).map_err(|_| ModelLoss::Missing)?;
        model_record::read(&bytes).ok_or(ModelLoss::Damaged)
    }

    /// Writes a file that is to have so many bytes, where there is room for them; counted is what it has in the end, also when
    /// that fails.
    pub(super) fn counted(&self, path: &Path, bytes: usize, write: impl FnOnce() -> io::Result<()>) -> io::Result<()> {
        let before = size(path);
        self.room.check(before, bytes)?;
        let written = write();
        self.room.count(before, size(path));
        written
    }
}

fn size(path: &Path) -> usize {
    fs::metadata(path).map_or(0, |found| usize::try_from(found.len()).unwrap_or(usize::MAX))
}

#[cfg(test)]
mod tests {
    //! Stored states are found again, and a damaged file yields to the one before it.
    use super::writer::SessionWriter;
    use super::*;
    use std::sync::Arc;

    const ID: &str = "0123456789abcdef0123456789abcdef";
    const MODEL: &str = "00000000000000000000000000000000";

    fn keeper(store: &Arc<SessionStore>) -> SessionWriter {
        SessionWriter::new(store, ID, MODEL, &proto::CompileRequest::default()).expect("there is room")
    }

    fn store(folder: &Path, most: usize) -> Result<SessionStore, StoreError> {
        SessionStore::open(folder, false, most)
    }

    #[test]
    fn whatever_is_cut_the_state_before_is_there() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = Arc::new(store(folder.path(), 1 << 20).expect("opens"));
        let mut keeper = keeper(&store);
        keeper.keep(7, b"seven").expect("kept");
        keeper.keep(8, b"eight, which is longer").expect("kept");
        let newest = folder.path().join("sessions").join(format!("{ID}-{MODEL}.0"));
        let whole = fs::read(&newest).expect("there");
        for cut in 0..whole.len() {
            fs::write(&newest, &whole[..cut]).expect("written");
            assert_eq!(store.load(ID, MODEL).map(|kept| kept.sealed), Some(b"seven".to_vec()), "{cut}");
        }
        for at in 0..whole.len() {
            let mut wrong = whole.clone();
            wrong[at] ^= 1;
            fs::write(&newest, wrong).expect("written");
            assert_eq!(store.load(ID, MODEL).map(|kept| kept.accepted), Some(7), "{at}");
        }
        // a shorter state in the place of a longer one
        fs::write(&newest, &whole).expect("written");
        keeper.keep(9, b"9").expect("kept");
        keeper.keep(10, b"x").expect("kept");
        let kept = store.load(ID, MODEL).expect("kept");
        assert_eq!((kept.accepted, &*kept.sealed), (10, &b"x"[..]));
    }

    /// A lease stands beside the states, now and with every one that comes later, until it is another.
    #[test]
    fn a_lease_is_kept_beside_the_states() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = Arc::new(store(folder.path(), 1 << 20).expect("opens"));
        let mut keeper = keeper(&store);
        let kept = || store.load(ID, MODEL).map(|kept| (kept.lease_ms, kept.accepted, kept.sealed));
        keeper.keep(7, b"seven").expect("kept");
        keeper.lease(5000).expect("kept");
        assert_eq!(kept(), Some((5000, 7, b"seven".to_vec())));
        keeper.keep(8, b"eight").expect("kept");
        assert_eq!(kept(), Some((5000, 8, b"eight".to_vec())));
        let mut later = SessionWriter::after(&store, ID, MODEL, &store.load(ID, MODEL).expect("kept"));
        later.keep(9, b"nine").expect("kept");
        later.lease(0).expect("kept");
        assert_eq!(kept(), Some((0, 9, b"nine".to_vec())));
    }

    #[test]
    fn one_server_a_folder_bounded_and_private() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a folder");
        let first = Arc::new(store(folder.path(), 200).expect("opens"));
        assert!(matches!(store(folder.path(), 200), Err(StoreError::InUse { .. })));
        let mut keeper = keeper(&first);
        keeper.keep(1, &[1; 10]).expect("fits");
        let full = keeper.keep(2, &[2; 200]).expect_err("does not fit");
        assert!(full.to_string().contains("state_bytes"), "{full}");
        assert_eq!(first.load(ID, MODEL).map(|kept| kept.accepted), Some(1));
        let file = folder.path().join("sessions").join(format!("{ID}-{MODEL}.1"));
        assert_eq!(fs::metadata(&file).expect("there").permissions().mode() & 0o777, 0o600);
        let used = first.used();
        drop((keeper, first));
        let second = store(folder.path(), 200).expect("the first is gone");
        assert_eq!((second.asleep(ID).map(|asleep| asleep.model).as_deref(), second.used()), (Some(MODEL), used));
        second.forget(ID);
        assert_eq!((second.used(), second.len(), file.exists()), (0, 0, false));
    }
}
