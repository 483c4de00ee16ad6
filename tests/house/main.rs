//! Rules of the source itself: layers, no circles of files, sizes, unique names of types, words.

mod circles;
mod layering;
mod names;
mod sizes;
mod words;

use std::fs;
use std::path::{Path, PathBuf};

/// Every file below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}
