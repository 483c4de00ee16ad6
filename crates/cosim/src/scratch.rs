//! The folder of one run, and the initialisation file in it that ngspice reads at its start.

use super::error::{CosimError, io};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// A folder of this run, gone afterwards.
pub(super) struct ScratchFolder(pub(super) PathBuf);

impl ScratchFolder {
    pub(super) fn new() -> Result<Self, CosimError> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("bimorph-cosim-{}-{count}", std::process::id()));
        std::fs::create_dir(&path).map_err(io(|| format!("cannot make the folder {}", path.display())))?;
        Ok(Self(path))
    }
}

/// Content of the initialisation file of a run, beside loading the plug-in.
pub(super) struct InitializationFile<'a> {
    /// The user's own initialisation file.
    pub(super) user: Option<&'a Path>,
    /// Whether the deck sets ngspice's limit on the change of a code model's inputs itself. Otherwise it is lifted: derivatives of parts are exact,
    /// and the limit of 25 % or 0.1 V an iteration doubles the iterations of a large swing.
    pub(super) limited: bool,
    /// The folder where includes are looked up, where the deck is run as a copy.
    pub(super) includes: Option<&'a Path>,
}

/// The user's initialisation file, by ngspice's rules.
pub(super) fn user_settings() -> Option<PathBuf> {
    let home = std::env::var_os("HOME").map(PathBuf::from);
    let places = [Some(PathBuf::from(".")), home].into_iter().flatten();
    places.filter_map(|d| d.join(".spiceinit").canonicalize().ok()).next()
}

/// Writes the initialisation file. The plug-in is linked under a plain name: ngspice splits paths at blanks; so is the folder of the includes.
pub(super) fn initialise(folder: &Path, plugin: &Path, start: &InitializationFile<'_>) -> Result<(), CosimError> {
    let link = folder.join("bimorph.cm");
    #[cfg(unix)]
    let linked = std::os::unix::fs::symlink(plugin, &link);
    #[cfg(not(unix))]
    let linked = std::fs::copy(plugin, &link).map(|_| ());
    linked.map_err(io(|| format!("cannot write {}", link.display())))?;
    let mut lines = String::from("* read by ngspice at its start\n");
    if !start.limited {
        lines += "option convstep=1e9 convabsstep=1e9\n";
    }
    if let Some(user) = start.user {
        lines += &format!("source {}\n", user.display());
    }
    lines += &format!("codemodel {}\n", link.display());
    if let Some(includes) = start.includes {
        lines += &format!("set sourcepath = ( {} $sourcepath )\n", plain(includes, folder)?.display());
    }
    let path = folder.join(".spiceinit");
    std::fs::write(&path, lines).map_err(io(|| format!("cannot write {}", path.display())))
}

impl Drop for ScratchFolder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
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
