//! Journal of a sweep: a file that stays readable after a stop at any moment. It has a line that names the sweep, then
//! one line of JSON for each finished point. On resumption the points are read back bit by bit. A truncated last line
//! counts as unfinished, and its point is computed again. Each line has a checksum, so that damaged lines are rejected.

use super::spec::SweepSpec;
use crate::content::Fnv;
use crate::durable::line::{opened, sealed};
use crate::durable::log::{AppendLog, LogRefusal};
use bimorph_base::{Bundle, Setting};
use bimorph_model::options::CompileOptions;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;
use thiserror::Error;

/// Longest time between two points and their way to the disk. A stop of the process loses nothing, a stop of the machine so much.
const SYNC: Duration = Duration::from_secs(1);

/// A point that is done.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalRow {
    /// Its number in the full grid, from 0.
    pub point: usize,
    /// Name, unit and value; no value where the quantity does not exist at this point.
    pub values: Vec<(String, String, Option<f64>)>,
    /// Largest estimated relative error by the mesh (1).
    pub estimated_error: Option<f64>,
    /// Why the numbers may be further off than the tolerance.
    pub warning: String,
    /// Error of a point without results.
    pub error: Option<String>,
}

/// The first line.
#[derive(Debug, Serialize, Deserialize)]
struct JournalHeader {
    bimorph: String,
    sweep: String,
}

/// Why points cannot be kept, or not be gone on from.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum JournalError {
    /// A journal exists, and neither resumption nor removal was requested.
    #[error(
        "{} has points of a sweep that did not end; continue it with --resume, or remove the file to begin anew", path.display()
    )]
    Exists {
        /// Where.
        path: PathBuf,
    },
    /// It is of another sweep.
    #[error(
        "{} is of another sweep: the netlist, the options, the parameters or the version of bimorph differ; remove the file to begin anew",
        path.display()
    )]
    Other {
        /// Where.
        path: PathBuf,
    },
    /// Another process adds to it.
    #[error("{}: another sweep is writing these points; wait for it, or give this one an --out of its own", path.display())]
    Busy {
        /// Where.
        path: PathBuf,
    },
    /// The file system says no.
    #[error("{}: {source}", path.display())]
    Io {
        /// Where.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

/// The file, open for more points.
#[derive(Debug)]
pub struct Journal {
    log: AppendLog,
    damaged: usize,
}

/// The name of a sweep: the same for the same points and the same program.
pub fn name(spec: &SweepSpec, bundle: &Bundle, options: &CompileOptions) -> String {
    let mut state = Fnv::default();
    state.text(env!("CARGO_PKG_VERSION"));
    state.model(bundle, options);
    // the threads change nothing; samples are named by their specification
    let asked = spec.samples.as_ref().map(|samples| &samples.asked);
    state.text(&format!("{asked:?} {:?} {:?}", spec.analysis, spec.shard));
    for axis in &spec.parameters {
        state.text(&axis.name);
        state.text(&format!("{} {}", axis.in_step, axis.values.len()));
        axis.values.iter().for_each(|value| match value {
            Setting::Number(x) => state.bytes(&[&[0], &x.to_bits().to_le_bytes()[..]].concat()),
            Setting::Text(text) => {
                state.bytes(&[1]);
                state.text(&text);
            }
        });
    }
    format!("{:032x}", state.value())
}

impl Journal {
    /// Opens or makes the file of the sweep `name`. Returns its points if `resume` is set; [`Journal::damaged`] gives
    /// the number of invalid lines. Its first line is on the disk when this returns: without it nothing behind it would
    /// be read.
    ///
    /// # Errors
    /// [`JournalError`]: a file exists without `resume`, it is of another sweep, or the file system refuses.
    pub fn open(path: &Path, name: &str, resume: bool) -> Result<(Self, Vec<JournalRow>), JournalError> {
        let refused = |refusal| match refusal {
            LogRefusal::Busy => JournalError::Busy { path: path.to_owned() },
            LogRefusal::Io(source) => JournalError::Io { path: path.to_owned(), source },
        };
        let check = |bytes: &[u8]| {
            if bytes.contains(&b'\n') && !resume {
                return Err(JournalError::Exists { path: path.to_owned() });
            }
            let JournalContents { known, good, damaged } = read(path, name, bytes)?;
            Ok(((known, damaged, good == 0), good as u64))
        };
        let (log, (known, damaged, is_new)) = AppendLog::open(path, refused, check)?;
        let journal = Self { log, damaged };
        if is_new {
            head(name).and_then(|line| journal.log.append(&line, |_| true)).map_err(|error| journal.failed(error))?;
        }
        Ok((journal, known))
    }

    /// The points of the sweep `name` in a file, but for those of lines that are damaged. Changes nothing.
    ///
    /// # Errors
    /// [`JournalError`]: it is of another sweep, or the file system refuses.
    pub fn read(path: &Path, name: &str) -> Result<Vec<JournalRow>, JournalError> {
        let bytes = std::fs::read(path).map_err(|source| JournalError::Io { path: path.to_owned(), source })?;
        read(path, name, &bytes).map(|lines| lines.known)
    }

    /// Adds a point.
    ///
    /// # Errors
    /// [`JournalError::Io`].
    pub fn keep(&self, kept: &JournalRow) -> Result<(), JournalError> {
        let line = lines(std::slice::from_ref(kept));
        line.and_then(|line| self.log.append(&line, |since| since >= SYNC)).map_err(|error| self.failed(error))
    }

    /// Its file, to which text of [`lines`] can be added.
    pub fn log(&self) -> &AppendLog {
        &self.log
    }

    /// Lines that were damaged when it was opened: their points are to be computed again.
    pub fn damaged(&self) -> usize {
        self.damaged
    }

    fn failed(&self, source: io::Error) -> JournalError {
        JournalError::Io { path: self.log.path().to_owned(), source }
    }

    /// Removes the file: its table has been written.
    ///
    /// # Errors
    /// [`JournalError::Io`].
    pub fn finish(self) -> Result<(), JournalError> {
        std::fs::remove_file(self.log.path()).map_err(|source| self.failed(source))
    }
}

/// Content of a journal.
#[derive(Default)]
struct JournalContents {
    known: Vec<JournalRow>,
    /// Bytes of whole lines.
    good: usize,
    /// Lines that are whole and no points.
    damaged: usize,
}

/// The first line of the journal of the sweep `name`.
fn head(name: &str) -> io::Result<Vec<u8>> {
    let head = JournalHeader { bimorph: env!("CARGO_PKG_VERSION").to_owned(), sweep: name.to_owned() };
    let mut line = serde_json::to_vec(&head)?;
    line.push(b'\n');
    Ok(line)
}

/// Reads a journal. A line that is cut off at its end is as if it had never been, and so is a first line that a disk made room for and did not
/// fill before the power went. A first line of which one byte is damaged is still that of its sweep: names have 32 digits.
fn read(path: &Path, name: &str, bytes: &[u8]) -> Result<JournalContents, JournalError> {
    let own = head(name).map_err(|source| JournalError::Io { path: path.to_owned(), source })?;
    let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
    let mut found = JournalContents::default();
    let named = bytes.get(..own.len()).is_some_and(|line| line.iter().zip(&own).filter(|(a, b)| a != b).count() <= 1);
    if !named {
        let unfilled =
            || bytes.len() == own.len() && bytes.iter().zip(&own).all(|(byte, own)| [0, *own].contains(byte));
        return if whole == 0 || unfilled() { Ok(found) } else { Err(JournalError::Other { path: path.to_owned() }) };
    }
    // the end of the first line may be what is damaged
    found.good = if whole < own.len() { 0 } else { whole };
    for line in bytes.get(own.len()..whole).unwrap_or_default().split_inclusive(|byte| *byte == b'\n') {
        match opened(line).and_then(|object| serde_json::from_slice(&object).ok()) {
            Some(kept) => found.known.push(kept),
            None => found.damaged += 1,
        }
    }
    Ok(found)
}

/// Points as the lines of a journal.
///
/// # Errors
/// A number that is no number, which no point has.
pub fn lines(points: &[JournalRow]) -> io::Result<Vec<u8>> {
    let mut lines = Vec::new();
    for point in points {
        lines.extend(sealed(serde_json::to_vec(point)?));
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    //! A journal gives back what was put in, however it was cut off.
    use super::*;

    fn kept(point: usize) -> JournalRow {
        let values =
            vec![("b.x".into(), "m".into(), Some(0.1 + 0.2 * point as f64)), ("release".into(), "V".into(), None)];
        JournalRow { point, values, estimated_error: Some(1e-3 / 3.0), warning: "W040: \"off\"".into(), error: None }
    }

    #[test]
    fn any_cut_loses_one_point_at_most() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("w.csv.journal");
        let (journal, known) = Journal::open(&path, "sweep", true).unwrap();
        assert!(known.is_empty());
        (0..4).for_each(|k| journal.keep(&kept(k)).unwrap());
        journal.keep(&JournalRow { error: Some("no\nway".into()), values: Vec::new(), ..kept(9) }).unwrap();
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        let ends: Vec<usize> = (0..whole.len()).filter(|&k| whole[k] == b'\n').map(|k| k + 1).collect();
        for cut in 0..=whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let (journal, known) = Journal::open(&path, "sweep", true).unwrap();
            let lines = ends.iter().filter(|end| **end <= cut).count();
            assert_eq!(known.len(), lines.saturating_sub(1), "{cut}");
            known.iter().take(4).enumerate().for_each(|(k, found)| assert_eq!(*found, kept(k)));
            // and continues where the last whole line ends
            journal.keep(&kept(7)).unwrap();
            drop(journal);
            let (_, again) = Journal::open(&path, "sweep", true).unwrap();
            assert_eq!(again.last(), Some(&kept(7)), "{cut}");
            assert_eq!(again.len(), known.len() + 1);
        }
        // a damaged line costs its own point alone, and is reported
        let mut bytes = whole.clone();
        bytes[ends[2] - 9] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        let (journal, known) = Journal::open(&path, "sweep", true).unwrap();
        let points: Vec<usize> = known.iter().map(|kept| kept.point).collect();
        assert_eq!((points, journal.damaged()), (vec![0, 2, 3, 9], 1));
        drop(journal);
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
        // a first line of which one byte is damaged, its end among them, costs nothing
        for at in [3, ends[0] - 1] {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            std::fs::write(&path, &bytes).unwrap();
            assert_eq!(Journal::open(&path, "sweep", true).unwrap().1.len(), 5, "{at}");
        }
        // a line damaged further belongs to no sweep, and nothing is removed
        (bytes[3], bytes[7]) = (0, 0);
        std::fs::write(&path, &bytes).unwrap();
        assert!(matches!(Journal::open(&path, "sweep", true), Err(JournalError::Other { .. })));
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
        std::fs::write(&path, &whole).unwrap();
        let (open, _) = Journal::open(&path, "sweep", true).unwrap();
        assert!(matches!(Journal::open(&path, "sweep", true), Err(JournalError::Busy { .. })));
        drop(open);
        assert!(matches!(Journal::open(&path, "sweep", false), Err(JournalError::Exists { .. })));
        assert!(matches!(Journal::open(&path, "another", true), Err(JournalError::Other { .. })));
        assert_eq!(std::fs::read(&path).unwrap(), whole);
    }
}
