//! One run of ngspice on a deck, from its files to its raw file.
//!
//! The deck is not copied or changed, unless the run is to be compared with a finer one ([`check`](super::check)).
//! ngspice starts in its usual working directory. Its initialisation file (`SPICE_USERINIT_DIR`) first reads the user's
//! and then loads the plug-in. So relative includes and `.control` sections work as they always do.
//!
//! ngspice ends with status 0 when an analysis inside `.control` fails. Here that is an error: the plug-in leaves its
//! reason in a file, and ngspice's own "simulation(s) aborted" is heard. A raw file appears under its name only when
//! the run was good.

use super::error::{CosimError, io};
use super::find::{find_ngspice, find_plugin};
use super::includes::Included;
use super::ngspice_output::{judge, listen};
use super::scratch::{InitializationFile, initialise, scratch_folder, user_settings};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Options of a run.
#[derive(Debug, Clone, Default)]
pub struct CosimOptions {
    /// The deck.
    pub deck: PathBuf,
    /// Address of a server that steps every model of the deck, whatever its `.model` lines say; none: they decide.
    pub remote: Option<String>,
    /// Variables of the plug-in's environment, beside those of this process: what it shows a server.
    pub environment: Vec<(&'static str, PathBuf)>,
    /// Where ngspice's raw file shall go; none: no raw file.
    pub raw: Option<PathBuf>,
    /// The ngspice program; none: [`find_ngspice`].
    pub ngspice: Option<PathBuf>,
    /// The plug-in; none: [`find_plugin`].
    pub plugin: Option<PathBuf>,
    /// Runs this text in the deck's place, as if it stood there; none: the deck itself.
    pub text: Option<String>,
    /// Fraction of its tolerance that every model gets (1); none: all of it.
    pub tolerance_share: Option<f64>,
    /// Keep ngspice's output for [`CosimReport::output`] instead of passing it on.
    pub capture: bool,
}

impl CosimOptions {
    /// For one of two runs that are compared: of this text, with this fraction of the tolerance of every model (1), and its output kept.
    pub(crate) fn for_comparison(&self, text: String, raw: Option<PathBuf>, share: f64) -> Self {
        Self { raw, text: Some(text), tolerance_share: Some(share), capture: true, ..self.clone() }
    }
}

/// Result of a good run.
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

impl CosimReport {
    /// Warnings of the models during the run, as printed.
    pub fn warnings(&self) -> impl Iterator<Item = &str> {
        let of_model = |line: &&str| line.starts_with("bimorph: ") && line.contains(": warning[");
        self.output.lines().map(str::trim).filter(of_model)
    }
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
pub(super) fn run_whatever(options: &CosimOptions, keep_going: &dyn Fn() -> bool) -> Result<CosimReport, CosimError> {
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
    let scratch = scratch_folder()?;
    let folder = deck.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = folder.canonicalize().map_err(|source| CosimError::Deck { path: deck.clone(), source })?;
    let user = user_settings();
    let settings = user.as_ref().and_then(|path| std::fs::read_to_string(path).ok()).unwrap_or_default();
    let included = Included::of(&String::from_utf8_lossy(&text), &folder, &settings);
    let start = InitializationFile {
        user: user.as_deref(),
        limited: included.mentions(&["convstep", "convabsstep"]),
        includes: options.text.as_ref().map(|_| folder.as_path()),
    };
    initialise(scratch.path(), &plugin, &start)?;
    let run_deck = match &options.text {
        Some(text) => {
            let copy = scratch.path().join(deck.file_name().unwrap_or(deck.as_os_str()));
            std::fs::write(&copy, text).map_err(io(|| format!("cannot write {}", copy.display())))?;
            copy
        }
        None => deck.clone(),
    };
    let failure = scratch.path().join("failure");
    let unfinished = options.raw.as_ref().map(|raw| {
        let mut name = OsString::from(raw);
        name.push(format!(".unfinished-{}", std::process::id()));
        PathBuf::from(name)
    });

    let mut command = Command::new(&ngspice);
    command.arg("-b").env("SPICE_USERINIT_DIR", scratch.path()).env("BIMORPH_FAILURE", &failure).stdin(Stdio::null());
    command.env("BIMORPH_DECK_DIR", &folder);
    let models: Vec<String> = included.models().map(|(name, at)| format!("{name}\t{}", at.display())).collect();
    command.env("BIMORPH_MODEL_FOLDERS", models.join("\n"));
    if let Ok(folders) = std::env::join_paths(&included.sourcepath) {
        command.env("BIMORPH_SOURCEPATH", folders);
    }
    if let Some(share) = options.tolerance_share {
        command.env("BIMORPH_TOL_SHARE", share.to_string());
    }
    if let Some(remote) = &options.remote {
        command.env("BIMORPH_REMOTE", remote);
    }
    command.envs(options.environment.iter().map(|(name, file)| (name, file)));
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
    let assessed =
        if heard.cancelled { Err(CosimError::Cancelled) } else { judge(&heard, &failure, deck, has_control) };
    match (assessed, unfinished, &options.raw) {
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
