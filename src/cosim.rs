//! Runs ngspice on a deck with the plug-in loaded.
//!
//! The deck is not copied or changed, unless the run is to be compared with a finer one ([`check`]): ngspice is started in the working directory it would have anyway, with an
//! initialisation file of its own (`SPICE_USERINIT_DIR`) that first reads the user's and then loads the plug-in. So
//! relative includes and `.control` sections work as they always do.
//!
//! ngspice ends with status 0 when an analysis inside `.control` fails. Here that is an error: the plug-in leaves its
//! reason in a file, and ngspice's own "simulation(s) aborted" is heard. A raw file appears under its name only when
//! the run was good.

pub mod around;
pub mod check;
pub mod compare;
pub mod finer;

use crate::results::raw::RawError;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;
use thiserror::Error;

/// What to run.
#[derive(Debug, Clone, Default)]
pub struct CosimOptions {
    /// The deck.
    pub deck: PathBuf,
    /// Address of a server that steps every model of the deck, whatever its `.model` lines say; none: they decide.
    pub remote: Option<String>,
    /// Where ngspice's raw file shall go; none: no raw file.
    pub raw: Option<PathBuf>,
    /// The ngspice program; none: [`find_ngspice`].
    pub ngspice: Option<PathBuf>,
    /// The plug-in; none: [`find_plugin`].
    pub plugin: Option<PathBuf>,
    /// Runs this text in the deck's place, as if it stood there; none: the deck itself.
    pub text: Option<String>,
    /// Share of its tolerance that every model gets [1]; none: all of it.
    pub tolerance_share: Option<f64>,
    /// Keep ngspice's output for [`CosimReport::output`] instead of passing it on.
    pub capture: bool,
}

/// What a good run leaves.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CosimReport {
    /// The ngspice that ran.
    pub ngspice: PathBuf,
    /// The plug-in it loaded.
    pub plugin: PathBuf,
    /// The raw file written.
    pub raw: Option<PathBuf>,
    /// ngspice's output, then its messages, when they were to be captured.
    pub output: String,
}

/// Why a run is not good.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CosimError {
    /// The caller did not want it to go on.
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
        /// What the system said.
        source: std::io::Error,
    },
    /// A file or a process could not be made.
    #[error("{what}: {source}")]
    Io {
        /// What was tried.
        what: String,
        /// What the system said.
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
    /// The deck asks for nothing.
    #[error("{deck}: no simulation was run; add .print, .plot or .control lines, or ask for a raw file")]
    NothingRun {
        /// The deck.
        deck: PathBuf,
    },
    /// A raw file that ngspice wrote cannot be understood.
    #[error("{path}: {source}")]
    Raw {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: RawError,
    },
    /// No raw file was written.
    #[error("{deck}: ngspice wrote no raw file; the deck has no analysis outside .control")]
    NoRaw {
        /// The deck.
        deck: PathBuf,
    },
}

/// The ngspice program: `NGSPICE`, or the first in `PATH`.
pub fn find_ngspice() -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("NGSPICE") {
        return Some(path.into());
    }
    let name = format!("ngspice{}", std::env::consts::EXE_SUFFIX);
    std::env::split_paths(&std::env::var_os("PATH")?).map(|d| d.join(&name)).find(|p| p.is_file())
}

/// The plug-in: `BIMORPH_CM`, or beside this program, above it, or in `../lib/bimorph`.
///
/// # Errors
/// [`CosimError::NoPlugin`] with every path tried.
pub fn find_plugin() -> Result<PathBuf, CosimError> {
    let mut tried = Vec::new();
    if let Some(path) = std::env::var_os("BIMORPH_CM") {
        tried.push(PathBuf::from(path));
    } else if let Some(here) = std::env::current_exe().ok().as_deref().and_then(Path::parent) {
        use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
        let built = format!("{DLL_PREFIX}bimorph_ngspice{DLL_SUFFIX}");
        for folder in [here.to_owned(), here.join(".."), here.join("../lib/bimorph")] {
            tried.extend([folder.join("bimorph.cm"), folder.join(&built)]);
        }
    }
    match tried.iter().find(|p| p.is_file()).and_then(|p| p.canonicalize().ok()) {
        Some(path) => Ok(path),
        None => {
            let tried = tried.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ");
            Err(CosimError::NoPlugin { tried })
        }
    }
}

/// A folder of this run, gone afterwards.
struct Scratch(PathBuf);

impl Scratch {
    fn new() -> Result<Self, CosimError> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("bimorph-cosim-{}-{count}", std::process::id()));
        std::fs::create_dir(&path).map_err(io(|| format!("cannot make the folder {}", path.display())))?;
        Ok(Self(path))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn io(what: impl FnOnce() -> String) -> impl FnOnce(std::io::Error) -> CosimError {
    |source| CosimError::Io { what: what(), source }
}

/// Runs a deck to its end, or ends ngspice as soon as `keep_going` says no; then no raw file is left, whole or half.
///
/// # Errors
/// [`CosimError`]
pub fn run(options: &CosimOptions, keep_going: &dyn Fn() -> bool) -> Result<CosimReport, CosimError> {
    let report = run_whatever(options, keep_going)?;
    if options.raw.is_some() && report.raw.is_none() {
        return Err(CosimError::NoRaw { deck: options.deck.clone() });
    }
    Ok(report)
}

/// [`run`], also of a deck that leaves no raw file.
fn run_whatever(options: &CosimOptions, keep_going: &dyn Fn() -> bool) -> Result<CosimReport, CosimError> {
    let deck = &options.deck;
    let text = match &options.text {
        Some(text) => text.clone().into_bytes(),
        None => std::fs::read(deck).map_err(|source| CosimError::Deck { path: deck.clone(), source })?,
    };
    let ngspice = options.ngspice.clone().or_else(find_ngspice).ok_or(CosimError::NoNgspice)?;
    let plugin = match &options.plugin {
        Some(path) => path.canonicalize().map_err(io(|| format!("cannot read the plug-in {}", path.display())))?,
        None => find_plugin()?,
    };
    let scratch = Scratch::new()?;
    let folder = deck.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = folder.canonicalize().map_err(|source| CosimError::Deck { path: deck.clone(), source })?;
    initialise(&scratch.0, &plugin, options.text.as_ref().map(|_| folder.as_path()))?;
    let run_deck = match &options.text {
        Some(text) => {
            let copy = scratch.0.join(deck.file_name().unwrap_or(deck.as_os_str()));
            std::fs::write(&copy, text).map_err(io(|| format!("cannot write {}", copy.display())))?;
            copy
        }
        None => deck.clone(),
    };
    let failure = scratch.0.join("failure");
    let unfinished = options.raw.as_ref().map(|raw| {
        let mut name = OsString::from(raw);
        name.push(format!(".unfinished-{}", std::process::id()));
        PathBuf::from(name)
    });

    let mut command = Command::new(&ngspice);
    command.arg("-b").env("SPICE_USERINIT_DIR", &scratch.0).env("BIMORPH_FAILURE", &failure).stdin(Stdio::null());
    command.env("BIMORPH_DECK_DIR", &folder);
    if let Some(share) = options.tolerance_share {
        command.env("BIMORPH_TOL_SHARE", share.to_string());
    }
    if let Some(remote) = &options.remote {
        command.env("BIMORPH_REMOTE", remote);
    }
    if let Some(path) = &unfinished {
        command.arg("-r").arg(path);
    }
    command
        .arg(&run_deck)
        .stdout(if options.capture { Stdio::piped() } else { Stdio::inherit() })
        .stderr(Stdio::piped());
    let child = command.spawn().map_err(io(|| format!("cannot start {}", ngspice.display())))?;
    let heard = listen(child, options.capture, keep_going).map_err(io(|| "ngspice's output cannot be read".into()))?;

    let has_control = has_control(&String::from_utf8_lossy(&text));
    let judged = if heard.cancelled { Err(CosimError::Cancelled) } else { judge(&heard, &failure, deck, has_control) };
    match (judged, unfinished, &options.raw) {
        (Err(error), Some(path), _) => {
            let _ = std::fs::remove_file(path);
            return Err(error);
        }
        (Err(error), None, _) => return Err(error),
        (Ok(()), Some(path), Some(raw)) if path.is_file() => {
            std::fs::rename(&path, raw).map_err(io(|| format!("cannot write {}", raw.display())))?;
        }
        (Ok(()), ..) => return Ok(CosimReport { ngspice, plugin, raw: None, output: heard.output }),
    }
    Ok(CosimReport { ngspice, plugin, raw: options.raw.clone(), output: heard.output })
}

/// Whether a deck has a `.control` section.
fn has_control(text: &str) -> bool {
    text.lines().any(|l| l.trim().eq_ignore_ascii_case(".control"))
}

/// Writes the initialisation file. The plug-in is linked under a plain name: ngspice splits paths at blanks; so is the folder in which
/// the includes of a deck are looked for that is run as a copy.
fn initialise(folder: &Path, plugin: &Path, includes: Option<&Path>) -> Result<(), CosimError> {
    let link = folder.join("bimorph.cm");
    #[cfg(unix)]
    let linked = std::os::unix::fs::symlink(plugin, &link);
    #[cfg(not(unix))]
    let linked = std::fs::copy(plugin, &link).map(|_| ());
    linked.map_err(io(|| format!("cannot write {}", link.display())))?;
    let mut lines = String::from("* read by ngspice at its start\n");
    let home = std::env::var_os("HOME").map(PathBuf::from);
    let user = [Some(PathBuf::from(".")), home].into_iter().flatten().map(|d| d.join(".spiceinit"));
    if let Some(user) = user.filter_map(|p| p.canonicalize().ok()).next() {
        lines += &format!("source {}\n", user.display());
    }
    lines += &format!("codemodel {}\n", link.display());
    if let Some(includes) = includes {
        lines += &format!("set sourcepath = ( {} $sourcepath )\n", plain(includes, folder)?.display());
    }
    let path = folder.join(".spiceinit");
    std::fs::write(&path, lines).map_err(io(|| format!("cannot write {}", path.display())))
}

/// A folder under a name without blanks: its own, or that of a link.
fn plain(folder: &Path, scratch: &Path) -> Result<PathBuf, CosimError> {
    if !folder.to_string_lossy().contains(char::is_whitespace) {
        return Ok(folder.to_owned());
    }
    let link = scratch.join("includes");
    #[cfg(unix)]
    std::os::unix::fs::symlink(folder, &link).map_err(io(|| format!("cannot write {}", link.display())))?;
    Ok(link)
}

/// What ngspice said and how it ended.
struct Heard {
    status: std::process::ExitStatus,
    aborted: Option<String>,
    nothing_run: bool,
    cancelled: bool,
    output: String,
}

/// How often a run looks whether it is still wanted.
const LOOK: Duration = Duration::from_millis(10);

/// Passes ngspice's messages on, or keeps them, and hears the ones that tell a failure. Ends ngspice when it shall not go on.
fn listen(mut child: Child, capture: bool, keep_going: &dyn Fn() -> bool) -> std::io::Result<Heard> {
    let stdout = child.stdout.take().map(|mut out| {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            out.read_to_end(&mut bytes).map(|_| bytes)
        })
    });
    let stderr = child.stderr.take().map(|err| std::thread::spawn(move || hear(err, capture)));
    let mut cancelled = false;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if !cancelled && !keep_going() {
            cancelled = true;
            child.kill()?;
        }
        std::thread::sleep(LOOK);
    };
    let mut output = match stdout.map(std::thread::JoinHandle::join) {
        Some(Ok(bytes)) => bytes?,
        _ => Vec::new(),
    };
    let (aborted, nothing_run, mut messages) = match stderr.map(std::thread::JoinHandle::join) {
        Some(Ok(heard)) => heard?,
        _ => (None, false, Vec::new()),
    };
    output.append(&mut messages);
    Ok(Heard { status, aborted, nothing_run, cancelled, output: String::from_utf8_lossy(&output).into_owned() })
}

/// Reads ngspice's messages to their end: the line that tells an abort, whether nothing was run, and what was kept.
fn hear(stderr: impl Read, capture: bool) -> std::io::Result<(Option<String>, bool, Vec<u8>)> {
    let (mut aborted, mut nothing_run, mut messages) = (None, false, Vec::new());
    let mut stderr = BufReader::new(stderr);
    let mut line = Vec::new();
    while stderr.read_until(b'\n', &mut line)? > 0 {
        let text = String::from_utf8_lossy(&line);
        if text.contains("simulation(s) aborted") {
            aborted.get_or_insert_with(|| text.trim().to_owned());
        }
        nothing_run |= text.contains("no simulations run");
        if capture {
            messages.extend_from_slice(&line);
        } else {
            let _ = std::io::stderr().write_all(&line);
        }
        line.clear();
    }
    Ok((aborted, nothing_run, messages))
}

fn judge(heard: &Heard, failure: &Path, deck: &Path, has_control: bool) -> Result<(), CosimError> {
    let output = || heard.output.clone();
    if let Ok(reason) = std::fs::read_to_string(failure) {
        return Err(CosimError::Stopped { reason, output: output() });
    }
    if let Some(line) = &heard.aborted {
        return Err(CosimError::Failed { status: heard.status.to_string(), line: line.clone(), output: output() });
    }
    // ngspice ends with 1 when a deck's work was all done in .control and there are no other lines to run.
    match (heard.nothing_run, has_control) {
        (true, true) => Ok(()),
        (true, false) => Err(CosimError::NothingRun { deck: deck.to_owned() }),
        (false, _) if heard.status.success() => Ok(()),
        _ => Err(CosimError::Failed { status: heard.status.to_string(), line: String::new(), output: output() }),
    }
}
