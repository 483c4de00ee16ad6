//! Why a run of ngspice is not good.

use bimorph_results::raw::RawError;
use std::path::PathBuf;
use thiserror::Error;

/// Why a run is not good.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CosimError {
    /// The caller cancelled it.
    #[error("cancelled")]
    Cancelled,
    /// ngspice is not installed.
    #[error("ngspice was not found in PATH; install it (Debian: apt-get install ngspice) or name it in NGSPICE")]
    NoNgspice,
    /// The plug-in is not there.
    #[error(
        "the ngspice plug-in was not found (looked for {tried}); build it with `cargo build --release -p \
         bimorph-ngspice` or name it in BIMORPH_CM"
    )]
    NoPlugin {
        /// Every path that was tried.
        tried: String,
    },
    /// The deck cannot be read.
    #[error("cannot read the deck {path}: {source}")]
    Deck {
        /// The deck.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file or a process could not be made.
    #[error("{what}: {source}")]
    Io {
        /// The attempted operation.
        what: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// The plug-in ended an analysis.
    #[error("{reason}")]
    Stopped {
        /// Its message.
        reason: String,
        /// ngspice's output, when it was captured.
        output: String,
    },
    /// ngspice ended an analysis, or itself.
    #[error("ngspice failed ({status}){}{line}", if line.is_empty() { "" } else { ": " })]
    Failed {
        /// Its exit status, in words.
        status: String,
        /// The message that says so.
        line: String,
        /// ngspice's output, when it was captured.
        output: String,
    },
    /// The deck requests no analysis.
    #[error("{deck}: no simulation was run; add .print, .plot or .control lines, or request a raw file")]
    NothingRun {
        /// The deck.
        deck: PathBuf,
    },
    /// A raw file that ngspice wrote cannot be understood.
    #[error("{path}: {source}")]
    Raw {
        /// The file.
        path: PathBuf,
        /// The fault.
        source: RawError,
    },
    /// No raw file was written.
    #[error("{deck}: ngspice wrote no raw file; the deck has no analysis outside .control")]
    NoRaw {
        /// The deck.
        deck: PathBuf,
    },
}

pub(super) fn io(what: impl FnOnce() -> String) -> impl FnOnce(std::io::Error) -> CosimError {
    |source| CosimError::Io { what: what(), source }
}
