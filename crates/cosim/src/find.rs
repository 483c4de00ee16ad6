//! Where the ngspice program and the plug-in are.

use super::error::CosimError;
use std::path::{Path, PathBuf};

/// The ngspice program: `NGSPICE`, or the first in `PATH`.
pub fn find_ngspice() -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("NGSPICE") {
        return Some(path.into());
    }
    in_path("ngspice")
}

/// The first program of this name in `PATH`.
pub(super) fn in_path(program: &str) -> Option<PathBuf> {
    let name = format!("{program}{}", std::env::consts::EXE_SUFFIX);
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
