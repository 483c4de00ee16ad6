//! The trace to the file in `BIMORPH_LOG=path`. Without it the plug-in writes nothing but errors.

use std::fmt::Arguments;
use std::fs::File;
use std::io::{LineWriter, Write};
use std::sync::{Mutex, OnceLock, PoisonError};

static LOG: OnceLock<Option<Mutex<LineWriter<File>>>> = OnceLock::new();

fn log() -> Option<&'static Mutex<LineWriter<File>>> {
    LOG.get_or_init(|| {
        let path = std::env::var_os("BIMORPH_LOG")?;
        File::create(path).ok().map(|file| Mutex::new(LineWriter::new(file)))
    })
    .as_ref()
}

/// Whether a trace is written.
pub(crate) fn on() -> bool {
    log().is_some()
}

/// Writes one line.
pub(crate) fn line(text: Arguments<'_>) {
    if let Some(log) = log() {
        let _ = writeln!(log.lock().unwrap_or_else(PoisonError::into_inner), "{text}");
    }
}
