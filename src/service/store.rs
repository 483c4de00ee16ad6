//! States that outlive the server: a folder with the accepted states of every session that a unary call opened.
//!
//! Each session has two files, `sessions/ID.0` and `ID.1`, written in turn: when one is being written, the other holds what
//! was accepted before, so that whatever moment the server ends at, one of them is whole. A file holds the last two accepted
//! states, as a client may not have heard of the last one. Beside them `models/ID` holds each netlist with its options, from
//! which the model is compiled again. Nobody but the owner can read any of it.
//!
//! What is here is bounded: two files a session, and `state_bytes` in all.

use super::keeper::{HEAD, Kept};
use super::proto;
use prost::Message;
use std::collections::BTreeMap;
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};
use thiserror::Error;

/// Why states cannot be kept.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The folder cannot be used.
    #[error("state folder {path}: {reason}", path = path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        reason: io::Error,
    },
    /// Another server uses it.
    #[error("state folder {path}: another server uses it; give each its own", path = path.display())]
    InUse {
        /// The folder.
        path: PathBuf,
    },
}

/// The folder of a server.
#[derive(Debug)]
pub(super) struct Store {
    pub(super) folder: PathBuf,
    /// Held as long as the server runs.
    _lock: File,
    /// Whether to wait for the disk.
    pub(super) sync: bool,
    most: usize,
    pub(super) used: AtomicUsize,
    /// Every session that is kept.
    sessions: Mutex<BTreeMap<String, Entry>>,
    /// Held while models are written or removed, and while a session is woken.
    files: Mutex<()>,
}

/// A session that is kept.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) model: String,
    /// Since when it waits for somebody to ask for it; none: it is in use.
    pub(super) asleep: Option<Instant>,
}

/// What a server would find in a folder of states, in words. Nothing of it is removed.
///
/// # Errors
/// [`StoreError`].
pub fn look_at(folder: &Path) -> Result<String, StoreError> {
    let store = match Store::open(folder, false, usize::MAX, Duration::MAX) {
        Err(StoreError::InUse { .. }) => return Ok("in use by a running server".to_owned()),
        opened => opened?,
    };
    let probe = folder.join("probe");
    let written = private().open(&probe).and_then(|mut file| file.write_all(HEAD));
    let removed = written.and_then(|()| fs::remove_file(probe));
    removed.map_err(|reason| StoreError::Folder { path: folder.to_owned(), reason })?;
    Ok(format!("{} sessions, {} kB, can be written", store.len(), store.used() >> 10))
}

impl Store {
    /// Opens or makes the folder, and finds what an earlier server left there. What was not touched for `forget` is removed.
    ///
    /// # Errors
    /// [`StoreError`].
    pub(super) fn open(folder: &Path, sync: bool, most: usize, forget: Duration) -> Result<Self, StoreError> {
        let wrong = |reason| StoreError::Folder { path: folder.to_owned(), reason };
        for path in [folder.to_owned(), folder.join("sessions"), folder.join("models")] {
            DirBuilder::new().recursive(true).mode(0o700).create(path).map_err(wrong)?;
        }
        let lock = private().open(folder.join("lock")).map_err(wrong)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(fs::TryLockError::WouldBlock) => return Err(StoreError::InUse { path: folder.to_owned() }),
            Err(fs::TryLockError::Error(reason)) => return Err(wrong(reason)),
        }
        let store = Self {
            folder: folder.to_owned(),
            _lock: lock,
            sync,
            most,
            used: AtomicUsize::new(0),
            sessions: Mutex::default(),
            files: Mutex::default(),
        };
        store.look_around(forget).map_err(wrong)?;
        Ok(store)
    }

    fn look_around(&self, forget: Duration) -> io::Result<()> {
        let (mut sessions, mut bytes) = (BTreeMap::new(), 0);
        for entry in fs::read_dir(self.folder.join("sessions"))? {
            let entry = entry?;
            let found = entry.metadata()?;
            let age = SystemTime::now().duration_since(found.modified()?).unwrap_or_default();
            let name = entry.file_name().to_string_lossy().into_owned();
            let ids = name.rsplit_once('.').and_then(|(ids, _)| ids.split_once('-'));
            // what is not ours is left alone
            let Some((id, model)) = ids.filter(|(id, model)| is_id(id) && is_id(model)) else { continue };
            if age >= forget {
                let _ = fs::remove_file(entry.path());
                continue;
            }
            bytes += usize::try_from(found.len()).unwrap_or(usize::MAX);
            let entry = Entry { model: model.to_owned(), asleep: Some(Instant::now()) };
            sessions.insert(id.to_owned(), entry);
        }
        for entry in fs::read_dir(self.folder.join("models"))? {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            if sessions.values().any(|session: &Entry| session.model == name) {
                bytes += usize::try_from(entry.metadata()?.len()).unwrap_or(usize::MAX);
            } else if name.split('.').next().is_some_and(is_id) {
                let _ = fs::remove_file(entry.path());
            }
        }
        self.used.store(bytes, Ordering::Relaxed);
        *self.entries() = sessions;
        Ok(())
    }

    pub(super) fn entries(&self) -> MutexGuard<'_, BTreeMap<String, Entry>> {
        self.sessions.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Held by who writes or removes models, or wakes a session.
    pub(super) fn hold(&self) -> MutexGuard<'_, ()> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The model of a session of an earlier run that nobody has asked for yet.
    pub(super) fn asleep(&self, id: &str) -> Option<String> {
        self.entries().get(id).filter(|entry| entry.asleep.is_some()).map(|entry| entry.model.clone())
    }

    /// Sessions that are kept.
    pub(super) fn len(&self) -> usize {
        self.entries().len()
    }

    /// Bytes of all that is kept.
    pub(super) fn used(&self) -> usize {
        self.used.load(Ordering::Relaxed)
    }

    /// A session that could not be woken waits on.
    pub(super) fn sleep(&self, id: &str) {
        if let Some(entry) = self.entries().get_mut(id) {
            entry.asleep = Some(Instant::now());
        }
    }

    /// Forgets sessions of an earlier run that nobody asked for in `time`; how many.
    pub(super) fn expire(&self, time: Duration) -> usize {
        let is_old = |entry: &Entry| entry.asleep.is_some_and(|since| since.elapsed() >= time);
        let old: Vec<String> = self.entries().iter().filter(|(_, e)| is_old(e)).map(|(id, _)| id.clone()).collect();
        old.iter().for_each(|id| self.forget(id));
        old.len()
    }

    /// What is kept of a session: the newer of its files that is whole.
    pub(super) fn load(&self, id: &str, model: &str) -> Option<Kept> {
        let read = |slot| fs::read(self.session(id, model, slot)).ok().and_then(|bytes| Kept::read(&bytes));
        [read(0), read(1)].into_iter().flatten().max_by_key(|kept| kept.sequence)
    }

    /// Removes what is kept of a session, and its model where no other session has it.
    pub(super) fn forget(&self, id: &str) {
        let _hold = self.hold();
        let Some(Entry { model, .. }) = self.entries().remove(id) else { return };
        for slot in [0, 1] {
            self.remove(&self.session(id, &model, slot));
        }
        if !self.entries().values().any(|entry| entry.model == model) {
            self.remove(&self.folder.join("models").join(model));
        }
    }

    fn remove(&self, path: &Path) {
        let bytes = size(path);
        if fs::remove_file(path).is_ok() {
            self.used.fetch_sub(bytes, Ordering::Relaxed);
        }
    }

    pub(super) fn session(&self, id: &str, model: &str, slot: u64) -> PathBuf {
        self.folder.join("sessions").join(format!("{id}-{model}.{slot}"))
    }

    /// Keeps the netlist and the options of a model, once.
    pub(super) fn keep_model(&self, id: &str, source: &proto::CompileRequest) -> io::Result<()> {
        let path = self.folder.join("models").join(id);
        if path.exists() {
            return Ok(());
        }
        let bytes = source.encode_to_vec();
        self.room(0, bytes.len())?;
        let unfinished = path.with_extension(format!("{}.new", std::process::id()));
        let written = (|| {
            let mut file = private().open(&unfinished)?;
            file.write_all(&bytes)?;
            if self.sync {
                file.sync_all()?;
            }
            fs::rename(&unfinished, &path)
        })();
        if written.is_err() {
            let _ = fs::remove_file(unfinished);
        } else {
            self.used.fetch_add(bytes.len(), Ordering::Relaxed);
        }
        written
    }

    /// The netlist and the options of a model.
    pub(super) fn model(&self, id: &str) -> Option<proto::CompileRequest> {
        let bytes = fs::read(self.folder.join("models").join(id)).ok()?;
        proto::CompileRequest::decode(&*bytes).ok()
    }

    /// Whether `more` bytes may be kept in place of `old`.
    pub(super) fn room(&self, old: usize, more: usize) -> io::Result<()> {
        let used = self.used().saturating_sub(old).saturating_add(more);
        if used > self.most {
            let text = format!("state_bytes: at most {} in all, got {used}; Info lists the limits", self.most);
            return Err(io::Error::new(io::ErrorKind::StorageFull, text));
        }
        Ok(())
    }
}

/// Opens for writing what nobody else may read.
pub(super) fn private() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false).mode(0o600);
    options
}

pub(super) fn size(path: &Path) -> usize {
    fs::metadata(path).map_or(0, |found| usize::try_from(found.len()).unwrap_or(usize::MAX))
}

/// Whether this is a name that [`super::ids`] makes; no other becomes a path.
fn is_id(text: &str) -> bool {
    text.len() == 32 && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}

#[cfg(test)]
mod tests {
    //! What was kept is found again, and a file that is not whole gives way to the one before it.
    use super::super::keeper::Keeper;
    use super::*;
    use std::sync::Arc;

    const ID: &str = "0123456789abcdef0123456789abcdef";
    const MODEL: &str = "00000000000000000000000000000000";

    fn keeper(store: &Arc<Store>) -> Keeper {
        Keeper::new(store, ID, MODEL, &proto::CompileRequest::default()).expect("there is room")
    }

    fn store(folder: &Path, most: usize) -> Result<Store, StoreError> {
        Store::open(folder, false, most, Duration::from_secs(60))
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
        assert_eq!((second.asleep(ID).as_deref(), second.used()), (Some(MODEL), used));
        second.forget(ID);
        assert_eq!((second.used(), second.len(), file.exists()), (0, 0, false));
    }
}
