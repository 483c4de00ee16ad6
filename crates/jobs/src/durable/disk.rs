//! Durable file operations: bytes are synced before a name refers to them or a reply reports them. All of them go
//! through this type, so that tests can check their order.

use super::log::AppendLog;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The disk of a folder of records.
#[derive(Debug)]
pub struct Disk {
    /// Whether to wait for it.
    sync: bool,
    /// Operations so far, where they are recorded.
    operations: Option<Mutex<Vec<DiskOperation>>>,
}

/// A recorded operation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DiskOperation {
    /// A file has these bytes, of which none is sure.
    Written(PathBuf, Vec<u8>),
    /// These bytes were added.
    Added(PathBuf, Vec<u8>),
    /// The bytes of a file are sure.
    Synced(PathBuf),
    /// A file has another name, which is not sure.
    Renamed(PathBuf, PathBuf),
    /// The names in a folder are sure.
    FolderSynced(PathBuf),
}

impl Disk {
    /// Waited for, or not.
    pub fn new(sync: bool) -> Self {
        Self { sync, operations: None }
    }

    /// Waited for, and each operation is recorded: what a failure of power may leave can then be computed.
    pub fn recording() -> Self {
        Self { sync: true, operations: Some(Mutex::default()) }
    }

    /// The recorded operations so far.
    pub fn operations(&self) -> Vec<DiskOperation> {
        let recorded = |list: &Mutex<Vec<_>>| list.lock().unwrap_or_else(PoisonError::into_inner).clone();
        self.operations.as_ref().map(recorded).unwrap_or_default()
    }

    fn note(&self, done: impl FnOnce() -> DiskOperation) {
        if let Some(list) = &self.operations {
            list.lock().unwrap_or_else(PoisonError::into_inner).push(done());
        }
    }

    /// Writes a file, over what it held before. When this returns its bytes outlive the machine; a new name does not yet.
    ///
    /// # Errors
    /// The system's error.
    pub fn write(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        let mut file = private_file().open(path)?;
        file.write_all(bytes)?;
        file.set_len(bytes.len() as u64)?;
        self.note(|| DiskOperation::Written(path.to_owned(), bytes.to_vec()));
        if self.sync {
            file.sync_data()?;
            self.note(|| DiskOperation::Synced(path.to_owned()));
        }
        Ok(())
    }

    /// Puts a file in the place of what has its name, by way of an `unfinished` one in the same folder. When this returns both bytes and
    /// name outlive the machine; where it fails the old file is still there.
    ///
    /// # Errors
    /// The system's error.
    pub fn replace(&self, path: &Path, unfinished: &Path, bytes: &[u8]) -> io::Result<()> {
        let replaced = self.write(unfinished, bytes).and_then(|()| {
            fs::rename(unfinished, path)?;
            self.note(|| DiskOperation::Renamed(unfinished.to_owned(), path.to_owned()));
            path.parent().map_or(Ok(()), |folder| self.keep_names(folder))
        });
        replaced.inspect_err(|_| drop(fs::remove_file(unfinished)))
    }

    /// Opens a file that `open` fills and waits for; only its owner can read it. A new name is not sure yet.
    ///
    /// # Errors
    /// The system's error, and that of `open`.
    pub fn open<T>(&self, path: &Path, open: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
        drop(private_file().open(path)?);
        let opened = open()?;
        if self.operations.is_some() {
            let bytes = fs::read(path)?;
            self.note(|| DiskOperation::Written(path.to_owned(), bytes));
            self.note(|| DiskOperation::Synced(path.to_owned()));
        }
        Ok(opened)
    }

    /// Adds lines to a log, all or none. When this returns they outlive the machine.
    ///
    /// # Errors
    /// The system's error.
    pub fn append(&self, log: &AppendLog, lines: &[u8]) -> io::Result<()> {
        log.append(lines, |_| self.sync)?;
        self.note(|| DiskOperation::Added(log.path().to_owned(), lines.to_vec()));
        if self.sync {
            self.note(|| DiskOperation::Synced(log.path().to_owned()));
        }
        Ok(())
    }

    /// When this returns the names of a folder outlive the machine.
    ///
    /// # Errors
    /// The system's error.
    pub fn keep_names(&self, folder: &Path) -> io::Result<()> {
        if self.sync {
            File::open(folder)?.sync_all()?;
            self.note(|| DiskOperation::FolderSynced(folder.to_owned()));
        }
        Ok(())
    }
}

/// Options to create a file that only its owner can read.
pub fn private_file() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false).mode(0o600);
    options
}
