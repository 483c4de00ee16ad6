//! Durable file operations: bytes are synced before a name refers to them or a reply reports them. All of them go
//! through this type, so that tests can check their order.

use bimorph_jobs::sweep::journal::{Journal, JournalError, JournalRow};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

/// The disk of a folder of states.
#[derive(Debug)]
pub(super) struct Disk {
    /// Whether to wait for it.
    sync: bool,
    #[cfg(test)]
    pub(super) done: std::sync::Mutex<Vec<DiskOperation>>,
}

/// A recorded operation.
#[cfg(test)]
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum DiskOperation {
    Written(std::path::PathBuf, Vec<u8>),
    Added(std::path::PathBuf, Vec<u8>),
    Synced(std::path::PathBuf),
    Renamed(std::path::PathBuf, std::path::PathBuf),
    FolderSynced(std::path::PathBuf),
}

impl Disk {
    /// Waited for, or not.
    pub(super) fn new(sync: bool) -> Self {
        Self {
            sync,
            #[cfg(test)]
            done: std::sync::Mutex::default(),
        }
    }

    /// Writes a file, over what it held before. When this returns its bytes outlive the machine; a new name does not yet.
    ///
    /// # Errors
    /// The system's error.
    pub(super) fn write(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        let mut file = private().open(path)?;
        file.write_all(bytes)?;
        file.set_len(bytes.len() as u64)?;
        #[cfg(test)]
        self.note(DiskOperation::Written(path.to_owned(), bytes.to_vec()));
        if self.sync {
            file.sync_data()?;
            #[cfg(test)]
            self.note(DiskOperation::Synced(path.to_owned()));
        }
        Ok(())
    }

    /// Opens the journal of a sweep, or makes it, with the points that it has. When this returns these outlive the machine, and so does
    /// its first line: without it nothing behind it would be read. A new name does not yet.
    ///
    /// # Errors
    /// The system's error.
    pub(super) fn journal(&self, path: &Path, sweep: &str) -> Result<(Journal, Vec<JournalRow>), JournalError> {
        let failed = |source| JournalError::Io { path: path.to_owned(), source };
        drop(private().open(path).map_err(failed)?);
        let (journal, points) = Journal::open(path, sweep, true)?;
        #[cfg(test)]
        self.note(DiskOperation::Written(path.to_owned(), fs::read(path).map_err(failed)?));
        #[cfg(test)]
        self.note(DiskOperation::Synced(path.to_owned()));
        Ok((journal, points))
    }

    /// Adds lines to a journal, all or none. When this returns they outlive the machine.
    ///
    /// # Errors
    /// The system's error.
    pub(super) fn append(&self, journal: &Journal, lines: &[u8]) -> Result<(), JournalError> {
        journal.keep_all(lines, self.sync)?;
        #[cfg(test)]
        {
            self.note(DiskOperation::Added(journal.path().to_owned(), lines.to_vec()));
            if self.sync {
                self.note(DiskOperation::Synced(journal.path().to_owned()));
            }
        }
        Ok(())
    }

    /// Gives a file another name, in the place of what has it.
    ///
    /// # Errors
    /// The system's error.
    pub(super) fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)?;
        #[cfg(test)]
        self.note(DiskOperation::Renamed(from.to_owned(), to.to_owned()));
        Ok(())
    }

    /// When this returns the names of a folder outlive the machine.
    ///
    /// # Errors
    /// The system's error.
    pub(super) fn keep_names(&self, folder: &Path) -> io::Result<()> {
        if self.sync {
            File::open(folder)?.sync_all()?;
            #[cfg(test)]
            self.note(DiskOperation::FolderSynced(folder.to_owned()));
        }
        Ok(())
    }

    #[cfg(test)]
    fn note(&self, done: DiskOperation) {
        self.done.lock().expect("nobody panicked").push(done);
    }
}

/// Options to create a file that only its owner can read.
pub(super) fn private() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false).mode(0o600);
    options
}
