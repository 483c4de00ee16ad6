//! A file that grows by whole lines: after a stop at any moment all but the last one are there.

use std::fs::{File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The file, open for more lines and locked against other processes.
#[derive(Debug)]
pub struct AppendLog {
    path: PathBuf,
    file: Mutex<OpenLog>,
}

#[derive(Debug)]
struct OpenLog {
    file: File,
    /// Bytes of whole lines.
    whole: u64,
    synced: Instant,
}

/// Why a log cannot be opened.
#[derive(Debug)]
pub(crate) enum LogRefusal {
    /// Another process holds it.
    Busy,
    /// The system's error.
    Io(io::Error),
}

impl AppendLog {
    /// Opens or makes a file. `check` receives what it has and returns how many bytes of it are whole lines; the rest is cut off, unless
    /// `check` refuses.
    ///
    /// # Errors
    /// That of `check`, and what `refused` makes of others.
    pub(crate) fn open<T, E>(
        path: &Path,
        refused: impl Fn(LogRefusal) -> E,
        check: impl FnOnce(&[u8]) -> Result<(T, u64), E>,
    ) -> Result<(Self, T), E> {
        let failed = |source| refused(LogRefusal::Io(source));
        let mut file = File::options().read(true).append(true).create(true).open(path).map_err(failed)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(refused(LogRefusal::Busy)),
            // a file system without locks: the documentation requires a separate file for each sweep
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let (found, whole) = check(&bytes)?;
        file.set_len(whole).and_then(|()| file.seek(SeekFrom::End(0))).map_err(failed)?;
        let open = OpenLog { file, whole, synced: Instant::now() };
        Ok((Self { path: path.to_owned(), file: Mutex::new(open) }, found))
    }

    /// Adds whole lines, all or none. When this returns they outlive the program, and where `sync` says so, which receives the time since
    /// the disk was last waited for, the machine.
    ///
    /// # Errors
    /// The system's error.
    pub fn append(&self, lines: &[u8], sync: impl FnOnce(Duration) -> bool) -> io::Result<()> {
        let mut open = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        // one call: a line is there whole, or is the last
        let mut written = open.file.write_all(lines);
        if written.is_ok() && sync(open.synced.elapsed()) {
            written = open.file.sync_data();
            open.synced = Instant::now();
        }
        match written {
            Ok(()) => open.whole += lines.len() as u64,
            // half a line would hide those after it
            Err(_) => drop(open.file.set_len(open.whole)),
        }
        written
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of whole lines that it has.
    pub fn bytes(&self) -> u64 {
        self.file.lock().unwrap_or_else(PoisonError::into_inner).whole
    }
}
