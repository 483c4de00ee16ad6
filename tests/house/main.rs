//! Rules of the source itself: layers, no circles of files, sizes, unique names of types, words, tolerances.

mod circles;
mod layering;
mod names;
mod pages;
mod sizes;
mod tolerances;
mod words;

use std::fs;
use std::path::{Path, PathBuf};

/// Folders of the sources: that of the root package, and one for each crate.
fn sources() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let crates = fs::read_dir(root.join("crates")).unwrap().map(|entry| entry.unwrap().path().join("src"));
    let mut folders: Vec<PathBuf> = crates.chain([root.join("src")]).collect();
    folders.sort();
    folders
}

/// Every file below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}
