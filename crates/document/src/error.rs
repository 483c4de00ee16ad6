//! Faults of documents.

use thiserror::Error;

/// Code of a text that is not JSON.
pub(crate) const NOT_JSON: &str = "E080";
/// Code of another format, version or system of units.
pub(crate) const OTHER_FORMAT: &str = "E081";
/// Code of a missing, unknown or repeated field.
pub(crate) const FIELDS: &str = "E082";
/// Code of a value of the wrong type or out of its range.
pub(crate) const VALUE: &str = "E083";
/// Code of values that contradict each other.
pub(crate) const RELATION: &str = "E084";

/// The first fault of a document.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{path}: {message}")]
pub struct DocumentError {
    /// Path of the value: `$.beams[3].length`.
    pub path: String,
    /// Byte range of the value in the text.
    pub span: [usize; 2],
    /// Stable code, see docs/reference/codes.md.
    pub code: &'static str,
    /// The fault and the expected value.
    pub message: String,
    /// A remedy; empty where there is none to suggest.
    pub help: String,
}

/// Why a structure has no document.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum UnwritableStructure {
    /// Elements name nodes by their names.
    #[error("two nodes have the name `{0}`: rename one, since a document refers to nodes by name")]
    SameName(String),
    /// JSON has no such number.
    #[error("`{field}` of `{element}` is not a finite number, which JSON cannot hold")]
    NotFinite {
        /// Name of the element.
        element: String,
        /// Its field.
        field: &'static str,
    },
}
