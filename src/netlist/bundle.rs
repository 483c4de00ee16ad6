//! A netlist with every file it includes, as one value that needs no disk.

use super::lexer::uses_of;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Includes may nest this deep, as in SUGAR.
pub(crate) const DEEPEST_INCLUDE: usize = 10;
/// A netlist may include this many files in all, as in SUGAR.
pub(crate) const MOST_INCLUDES: usize = 40;

/// A netlist's text with every file it includes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bundle {
    /// Name of the root file, as it is shown in diagnostics.
    pub root: String,
    /// Text of each file, by the name under which it is included (the root under its own name).
    pub files: BTreeMap<String, String>,
}

impl Bundle {
    /// Reads `path` and, in turn, every file it `uses`.
    ///
    /// A name is looked up in the folder of the file that includes it, then in the working directory, then in the
    /// `include` folders in their order. As in SUGAR each spelled name is read once. Text that is not UTF-8 is taken
    /// byte by byte with the odd ones replaced.
    ///
    /// # Errors
    /// The root cannot be read. A missing include is no error here: [`load`](super::load) reports it with its place.
    pub fn read(path: &Path, include: &[PathBuf]) -> Result<Self, std::io::Error> {
        let root = path.display().to_string();
        let mut files = BTreeMap::from([(root.clone(), text_of(path)?)]);
        let own = path.canonicalize().ok();
        let mut waiting = vec![(root.clone(), folder_of(path), 0)];
        while let Some((name, folder, depth)) = waiting.pop() {
            for spelled in uses_of(&files[&name]) {
                if files.contains_key(&spelled) || files.len() > MOST_INCLUDES + 1 || depth > DEEPEST_INCLUDE {
                    continue;
                }
                let places = [folder.clone(), PathBuf::new()];
                let found = places.iter().chain(include).map(|place| place.join(&spelled)).find(|file| file.is_file());
                let Some(file) = found else { continue };
                // The root under another spelling stays out: `load` says that the netlist includes itself.
                if own.is_some() && file.canonicalize().ok() == own {
                    continue;
                }
                if let Ok(text) = text_of(&file) {
                    files.insert(spelled.clone(), text);
                    waiting.push((spelled, folder_of(&file), depth + 1));
                }
            }
        }
        Ok(Self { root, files })
    }

    /// A bundle of one file.
    pub fn from_text(name: &str, text: &str) -> Self {
        Self { root: name.to_owned(), files: BTreeMap::from([(name.to_owned(), text.to_owned())]) }
    }

    /// The same bundle with one more file, under the name by which it is included.
    #[must_use]
    pub fn with_file(mut self, name: &str, text: &str) -> Self {
        self.files.insert(name.to_owned(), text.to_owned());
        self
    }
}

fn text_of(path: &Path) -> Result<String, std::io::Error> {
    Ok(String::from_utf8_lossy(&std::fs::read(path)?).into_owned())
}

fn folder_of(path: &Path) -> PathBuf {
    path.parent().map(Path::to_path_buf).unwrap_or_default()
}
