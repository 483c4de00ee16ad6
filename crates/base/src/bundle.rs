//! A netlist with every file it includes, as one value that needs no disk.

use std::collections::BTreeMap;

/// A netlist's text with every file it includes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bundle {
    /// Name of the root file, as it is shown in diagnostics.
    pub root: String,
    /// Text of each file, by the name under which it is included (the root under its own name).
    pub files: BTreeMap<String, String>,
    /// Where the root was made of a layout: for its lines, from 1, the layer and place in the drawing. Messages then name these.
    pub places: BTreeMap<usize, String>,
}

impl Bundle {
    /// A bundle of one file.
    pub fn from_text(name: &str, text: &str) -> Self {
        let files = BTreeMap::from([(name.to_owned(), text.to_owned())]);
        Self { root: name.to_owned(), files, places: BTreeMap::new() }
    }

    /// The same bundle with one more file, under the name by which it is included.
    #[must_use]
    pub fn with_file(mut self, name: &str, text: &str) -> Self {
        self.files.insert(name.to_owned(), text.to_owned());
        self
    }
}
