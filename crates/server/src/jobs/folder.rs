//! Jobs that outlive the server: a folder with three files for each, `jobs/ID.job` what was asked, `jobs/ID.rows` the
//! journal of its rows, and `jobs/ID.end` how it ended. A job exists once its first file does. A row that was sent is
//! in the journal, at any end of the server, and a job without its last file continues. All of it counts among the
//! bytes of the folder of states.

use super::super::store::SessionStore;
use super::super::store::scan::is_id;
use super::job_origin::JobOrigin;
use bimorph_jobs::durable::line;
use bimorph_jobs::durable::record;
use bimorph_jobs::sweep::journal::{self, Journal, JournalError, JournalRow};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Magic bytes of the first file of a job.
const HEAD: &[u8; 16] = b"bimorph jobs 1\r\n";

/// How a job ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct JobOutcome {
    /// Code of gRPC; 0: with all of its rows.
    pub(super) code: i32,
    /// Why.
    pub(super) message: String,
    pub(super) rows: u64,
    pub(super) failed: u64,
    /// When, since 1970 (ms).
    pub(super) ended_ms: u64,
    /// Bytes of its journal: with fewer it has not ended.
    pub(super) bytes: u64,
}

/// The parsed request, and its bytes as received.
type StoredRequest = (JobOrigin, Vec<u8>);

/// Files of a job in a folder.
pub(super) struct StoredJob {
    pub(super) id: String,
    pub(super) asked: JobOrigin,
    /// The request as it came.
    pub(super) request: Vec<u8>,
    /// How it ended, as far as that is known.
    pub(super) end: Option<JobOutcome>,
    pub(super) file: JobFile,
}

/// The files of one job.
#[derive(Debug)]
pub(super) struct JobFile {
    store: Arc<SessionStore>,
    id: String,
    sweep: String,
    journal: Option<Journal>,
    /// Bytes that are counted.
    bytes: AtomicUsize,
}

/// Begins the files of a new job. When this returns it is on the disk.
///
/// # Errors
/// The system's error, or the exceeded limit; then none of its files is left.
pub(super) fn begin(store: &Arc<SessionStore>, id: &str, asked: &JobOrigin, request: &[u8]) -> io::Result<JobFile> {
    let file = JobFile::of(store, id, &asked.sweep);
    let head = head(asked, request)?;
    file.take(head.len())?;
    match store.disk().replace(&file.path("job"), &file.path("new"), &head) {
        Ok(()) => Ok(file),
        Err(error) => {
            file.remove();
            Err(error)
        }
    }
}

/// The ids of what a folder has.
///
/// # Errors
/// A folder that cannot be read.
pub(super) fn ids(store: &SessionStore) -> io::Result<BTreeSet<String>> {
    let mut ids = BTreeSet::new();
    for entry in fs::read_dir(folder(store))? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        ids.extend(name.split('.').next().filter(|id| is_id(id)).map(str::to_owned));
    }
    Ok(ids)
}

/// Files of a job in a folder. Files of a job that was never confirmed are removed.
pub(super) fn find(store: &Arc<SessionStore>, id: &str) -> Option<StoredJob> {
    let file = JobFile::of(store, id, "");
    let counted = ["job", "rows", "end", "new"].iter().map(|end| file.size(end)).sum::<u64>();
    file.bytes.store(usize::try_from(counted).unwrap_or(usize::MAX), Ordering::Relaxed);
    match file.read() {
        Ok(Some(((asked, request), end))) => {
            let file = JobFile { sweep: asked.sweep.clone(), ..file };
            return Some(StoredJob { id: id.to_owned(), asked, request, end, file });
        }
        // there is nothing to continue
        Ok(None) => file.remove(),
        Err(error) => tracing::warn!(job = id, %error, "it cannot be read, and is left alone"),
    }
    None
}

fn folder(store: &SessionStore) -> PathBuf {
    store.folder.join("jobs")
}

fn head(asked: &JobOrigin, request: &[u8]) -> io::Result<Vec<u8>> {
    let asked = serde_json::to_vec(asked)?;
    Ok(record::sealed(HEAD, 8 + asked.len() + request.len(), |out| {
        out.extend((asked.len() as u64).to_le_bytes());
        out.extend(&asked);
        out.extend(request);
    }))
}

/// None for a file that is not whole.
fn read_head(bytes: &[u8]) -> Option<StoredRequest> {
    let (length, rest) = record::opened(HEAD, bytes)?.split_at_checked(8)?;
    let length = usize::try_from(u64::from_le_bytes(length.try_into().ok()?)).ok()?;
    let (asked, request) = rest.split_at_checked(length)?;
    Some((serde_json::from_slice(asked).ok()?, request.to_vec()))
}

impl JobFile {
    fn of(store: &Arc<SessionStore>, id: &str, sweep: &str) -> Self {
        let (store, id, sweep) = (Arc::clone(store), id.to_owned(), sweep.to_owned());
        Self { store, id, sweep, journal: None, bytes: AtomicUsize::new(0) }
    }

    fn path(&self, end: &str) -> PathBuf {
        folder(&self.store).join(format!("{}.{end}", self.id))
    }

    fn size(&self, end: &str) -> u64 {
        fs::metadata(self.path(end)).map_or(0, |found| found.len())
    }

    /// The request and the outcome; `None` if the job was never confirmed.
    fn read(&self) -> io::Result<Option<(StoredRequest, Option<JobOutcome>)>> {
        let there = |end: &str| match fs::read(self.path(end)) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        };
        let Some(bytes) = there("job")? else { return Ok(None) };
        let strange = || io::Error::new(io::ErrorKind::InvalidData, "it is damaged, or of another version");
        let head = read_head(&bytes).ok_or_else(strange)?;
        // a damaged one counts as missing: the job continues
        let end = there("end")?.and_then(|bytes| {
            let end: Option<JobOutcome> = line::opened(&bytes).and_then(|object| serde_json::from_slice(&object).ok());
            if end.is_none() {
                tracing::warn!(job = self.id, "its end is damaged, so it continues");
            }
            end
        });
        Ok(Some((head, end)))
    }

    fn take(&self, bytes: usize) -> io::Result<()> {
        self.store.room().take(bytes)?;
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
        Ok(())
    }

    fn give_back(&self, bytes: usize) {
        self.store.room().count(bytes, 0);
        self.bytes.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Bytes of its journal on the disk.
    pub(super) fn row_bytes(&self) -> u64 {
        self.size("rows")
    }

    /// Opens its journal, creating it if missing, and returns its rows. A truncated last row was never sent, and is
    /// dropped.
    ///
    /// # Errors
    /// The system's error.
    pub(super) fn open(&mut self) -> io::Result<Vec<JournalRow>> {
        let path = self.path("rows");
        let before = self.size("rows");
        let open = || Journal::open(&path, &self.sweep, true).map_err(io_error);
        let (journal, rows) = self.store.disk().open(&path, open)?;
        if journal.damaged() > 0 {
            tracing::warn!(
                job = self.id,
                lines = journal.damaged(),
                "lines of its journal are damaged: their points are computed again"
            );
        }
        let bytes = journal.log().bytes();
        if bytes > before {
            self.take(usize::try_from(bytes - before).unwrap_or(usize::MAX))?;
            self.store.disk().keep_names(&folder(&self.store))?;
        } else {
            self.give_back(usize::try_from(before - bytes).unwrap_or(usize::MAX));
        }
        self.journal = Some(journal);
        Ok(rows)
    }

    /// The rows of a job that has ended. Changes nothing.
    ///
    /// # Errors
    /// The system's error.
    pub(super) fn read_rows(&self) -> io::Result<Vec<JournalRow>> {
        Journal::read(&self.path("rows"), &self.sweep).map_err(io_error)
    }

    /// Adds rows to the open journal. When this returns they are on the disk, or, with syncing disabled, with the
    /// system.
    ///
    /// # Errors
    /// The system's error, or the exceeded limit; then none of them is stored.
    pub(super) fn append(&self, rows: &[JournalRow]) -> io::Result<()> {
        let lines = journal::lines(rows)?;
        self.take(lines.len())?;
        let Some(journal) = &self.journal else { return Err(io::Error::other("its journal is closed")) };
        self.store.disk().append(journal.log(), &lines).inspect_err(|_| self.give_back(lines.len()))
    }

    /// Keeps how it ended. When this returns it is on the disk. Its few bytes may exceed the limit, so that a job on a
    /// full disk can end.
    ///
    /// # Errors
    /// The system's error.
    pub(super) fn end(&self, end: &JobOutcome) -> io::Result<()> {
        let end = JobOutcome {
            bytes: self.journal.as_ref().map_or_else(|| self.row_bytes(), |rows| rows.log().bytes()),
            ..end.clone()
        };
        let bytes = line::sealed(serde_json::to_vec(&end)?);
        let before = usize::try_from(self.size("end")).unwrap_or(usize::MAX);
        self.store.room().count(0, bytes.len());
        self.bytes.fetch_add(bytes.len(), Ordering::Relaxed);
        let written = self.store.disk().replace(&self.path("end"), &self.path("new"), &bytes);
        // what it had before, or what it did not get
        self.give_back(if written.is_ok() { before } else { bytes.len() });
        written
    }

    /// Closes its journal.
    pub(super) fn close(&mut self) {
        self.journal = None;
    }

    /// Removes all of it, the first file first: without it there is no job.
    pub(super) fn remove(&self) {
        for end in ["job", "rows", "end", "new"] {
            let _ = fs::remove_file(self.path(end));
        }
        self.store.room().count(self.bytes.swap(0, Ordering::Relaxed), 0);
    }
}

fn io_error(error: JournalError) -> io::Error {
    match error {
        JournalError::Io { source, .. } => source,
        other => io::Error::other(other.to_string()),
    }
}
