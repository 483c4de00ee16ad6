//! Content of a folder of states, read without changing it.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
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
        /// The system's error.
        reason: io::Error,
    },
    /// Another server uses it.
    #[error("state folder {path}: another server uses it; give each its own", path = path.display())]
    InUse {
        /// The folder.
        path: PathBuf,
    },
}

/// Summary of a folder of states, in words. It creates and removes nothing.
///
/// # Errors
/// [`StoreError`].
pub fn inspect(folder: &Path) -> Result<String, StoreError> {
    let wrong = |reason| StoreError::Folder { path: folder.to_owned(), reason };
    match fs::metadata(folder) {
        Ok(_) => {}
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let above = folder.ancestors().skip(1).map(or_here).find(|path| path.exists());
            probe(above.unwrap_or(Path::new("."))).map_err(wrong)?;
            return Ok("0 sessions, 0 jobs, the folder is made when the server starts".to_owned());
        }
        Err(error) => return Err(wrong(error)),
    }
    let lock = folder.join("lock");
    if lock.exists() && matches!(File::open(lock).map_err(wrong)?.try_lock(), Err(fs::TryLockError::WouldBlock)) {
        return Ok("in use by a running server".to_owned());
    }
    probe(folder).map_err(wrong)?;
    let found = match StoreScan::of(folder) {
        // a server makes what is not there yet
        Err(error) if error.kind() == io::ErrorKind::NotFound => StoreScan::default(),
        found => found.map_err(wrong)?,
    };
    let (sessions, jobs) = (found.sessions.len(), found.jobs);
    Ok(format!("{sessions} sessions, {jobs} jobs, {} kB, can be written", found.bytes >> 10))
}

/// The folder that a path without one stands in.
fn or_here(path: &Path) -> &Path {
    if path.as_os_str().is_empty() { Path::new(".") } else { path }
}

/// Whether files can be made in a folder: one is, and is removed again.
fn probe(folder: &Path) -> io::Result<()> {
    tempfile::Builder::new().prefix(".bimorph-").tempfile_in(folder)?.close()
}

/// Content of a folder.
#[derive(Default)]
pub(crate) struct StoreScan {
    /// Sessions with their models.
    pub(crate) sessions: BTreeMap<String, String>,
    /// How many jobs there are.
    pub(crate) jobs: usize,
    /// Bytes of sessions, their models, and jobs.
    pub(crate) bytes: usize,
    /// Models of no session.
    pub(crate) left: Vec<PathBuf>,
}

impl StoreScan {
    /// Reads the folder.
    pub(crate) fn of(folder: &Path) -> io::Result<Self> {
        let mut found = Self::default();
        for entry in fs::read_dir(folder.join("sessions"))? {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            let ids = name.rsplit_once('.').and_then(|(ids, _)| ids.split_once('-'));
            // what is not ours is left alone
            let Some((id, model)) = ids.filter(|(id, model)| is_id(id) && is_id(model)) else { continue };
            found.bytes += usize::try_from(entry.metadata()?.len()).unwrap_or(usize::MAX);
            found.sessions.insert(id.to_owned(), model.to_owned());
        }
        for entry in fs::read_dir(folder.join("models"))? {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            if found.sessions.values().any(|model| *model == name) {
                found.bytes += usize::try_from(entry.metadata()?.len()).unwrap_or(usize::MAX);
            } else if name.split('.').next().is_some_and(is_id) {
                found.left.push(entry.path());
            }
        }
        let jobs = match fs::read_dir(folder.join("jobs")) {
            // a folder of an earlier version
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(found),
            jobs => jobs?,
        };
        for entry in jobs {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.split('.').next().is_some_and(is_id) {
                found.bytes += usize::try_from(entry.metadata()?.len()).unwrap_or(usize::MAX);
                found.jobs += usize::from(name.ends_with(".job"));
            }
        }
        Ok(found)
    }
}

/// Whether this is a name that [`bimorph_wire::ids`] makes; no other becomes a path.
pub(crate) fn is_id(text: &str) -> bool {
    text.len() == 32 && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}
