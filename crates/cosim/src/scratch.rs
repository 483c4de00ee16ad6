//! The folder of one run, and the initialisation file in it that ngspice reads at its start.

use super::error::{CosimError, io};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder of this run, of the user alone, gone afterwards. Its name is random: one with the process identifier meets the folder that a killed
/// run of the same identifier left.
pub(super) fn scratch_folder() -> Result<TempDir, CosimError> {
    let made = tempfile::Builder::new().prefix("bimorph-cosim-").tempdir();
    made.map_err(io(|| format!("cannot make a folder in {}", std::env::temp_dir().display())))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder that a killed run of the same process identifier left behind is no obstacle, and two runs of a process have folders of their own.
    #[test]
    fn folders_of_killed_runs_do_not_matter() {
        let left = std::env::temp_dir().join(format!("bimorph-cosim-{}-0", std::process::id()));
        std::fs::create_dir_all(&left).unwrap();
        let folders = [scratch_folder().unwrap(), scratch_folder().unwrap()];
        assert_ne!(folders[0].path(), folders[1].path());
        let paths = folders.each_ref().map(|folder| folder.path().to_owned());
        drop(folders);
        assert!(paths.iter().all(|path| !path.exists()));
        std::fs::remove_dir(&left).unwrap();
    }
}
