//! Reading a netlist from the disk, with the files that it uses.

use super::{foreign, lexer, sugar3};
use bimorph_base::Bundle;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Includes may nest this deep, as in SUGAR.
pub(crate) const DEEPEST_INCLUDE: usize = 10;
/// A netlist may include this many files in all, as in SUGAR.
pub(crate) const MAX_INCLUDES: usize = 40;

/// Reads `path` and, in turn, every file it `uses`.
///
/// A name is looked up in the folder of the file that includes it, then in the working directory, then in the
/// `include` folders in their order. As in SUGAR each spelled name is read once. Text that is not UTF-8 is taken
/// byte by byte with the odd ones replaced.
///
/// # Errors
/// The root cannot be read. A missing include is no error here: [`load`](super::load) reports it with its place.
pub fn read_bundle(path: &Path, include: &[PathBuf]) -> Result<Bundle, std::io::Error> {
    read_bundle_reporting(path, include, &mut |_| ())
}

/// [`read_bundle`] that calls `dropped` for each include skipped because its path is already taken.
///
/// # Errors
/// As [`read_bundle`].
pub fn read_bundle_reporting(
    path: &Path,
    include: &[PathBuf],
    dropped: &mut dyn FnMut(DroppedInclude),
) -> Result<Bundle, std::io::Error> {
    let root = path.display().to_string();
    let files = BTreeMap::from([(root.clone(), text_of(path)?)]);
    let mut reader = IncludeReader { files, found: BTreeMap::new(), own: path.canonicalize().ok(), include, dropped };
    reader.includes_of(&root, &folder_of(path), 0);
    Ok(Bundle { root, files: reader.files, places: BTreeMap::new() })
}

/// A file that is left out: each spelled name is read once, where the text meets it first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DroppedInclude {
    /// The file that includes it.
    pub by: String,
    /// The name under which it does.
    pub spelled: String,
    /// The file read under that path.
    pub kept: PathBuf,
    /// The skipped file.
    pub dropped: PathBuf,
}

impl std::fmt::Display for DroppedInclude {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { by, spelled, kept, dropped } = self;
        let (kept, dropped) = (kept.display(), dropped.display());
        write!(f, "{dropped} is left out: {by} includes it as \"{spelled}\", which is {kept} already")
    }
}

/// Reads includes depth first, in the order in which the parser meets them.
struct IncludeReader<'a> {
    files: BTreeMap<String, String>,
    /// Where each spelled name was found.
    found: BTreeMap<String, PathBuf>,
    /// The root, to know it under another spelling.
    own: Option<PathBuf>,
    include: &'a [PathBuf],
    dropped: &'a mut dyn FnMut(DroppedInclude),
}

impl IncludeReader<'_> {
    fn includes_of(&mut self, name: &str, folder: &Path, depth: usize) {
        for spelled in uses_of(&self.files[name]) {
            let places = [folder, Path::new("")].into_iter().chain(self.include.iter().map(PathBuf::as_path));
            let Some(file) = places.map(|place| place.join(&spelled)).find(|file| file.is_file()) else { continue };
            if self.files.contains_key(&spelled) {
                if let Some(kept) = self.found.get(&spelled).filter(|kept| !same(kept, &file)) {
                    let (by, kept) = (name.to_owned(), kept.clone());
                    (self.dropped)(DroppedInclude { by, spelled, kept, dropped: file });
                }
                continue;
            }
            // One more than allowed on each count, so that `load` sees that there are too many.
            if self.files.len() > MAX_INCLUDES + 1 || depth > DEEPEST_INCLUDE {
                continue;
            }
            // The root under another spelling stays out: `load` says that the netlist includes itself.
            if self.own.is_some() && file.canonicalize().ok() == self.own {
                continue;
            }
            if let Ok(text) = text_of(&file) {
                self.files.insert(spelled.clone(), text);
                self.found.insert(spelled.clone(), file.clone());
                self.includes_of(&spelled, &folder_of(&file), depth + 1);
            }
        }
    }
}

/// The files that a text uses, in the order in which its language meets them.
fn uses_of(text: &str) -> Vec<String> {
    if bimorph_document::is_document(text) {
        return Vec::new();
    }
    match foreign::kind(text, 0) {
        foreign::FileKind::Lua(_) => sugar3::uses_of(text),
        _ => lexer::uses_of(text),
    }
}

fn text_of(path: &Path) -> Result<String, std::io::Error> {
    Ok(String::from_utf8_lossy(&std::fs::read(path)?).into_owned())
}

fn same(a: &Path, b: &Path) -> bool {
    a == b || a.canonicalize().ok().is_some_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

fn folder_of(path: &Path) -> PathBuf {
    path.parent().map(Path::to_path_buf).unwrap_or_default()
}
