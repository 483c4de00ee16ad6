//! Names that a model does not have.

use thiserror::Error;

/// Why a signal or a port cannot be read.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ReadoutError {
    /// No signal of that name.
    #[error("signal \"{name}\": {hint}")]
    UnknownSignal {
        /// The requested name.
        name: String,
        /// Suggested names.
        hint: String,
    },
    /// A sum of signals that cannot be read.
    #[error("signal \"{text}\": {detail}")]
    BadExpression {
        /// The text.
        text: String,
        /// The part that is wrong, and what was expected.
        detail: String,
    },
    /// No port of that name.
    #[error("no port named \"{name}\"; the netlist has {available:?}")]
    UnknownPort {
        /// The requested name.
        name: String,
        /// The names there are.
        available: Vec<String>,
    },
    /// A range of an unknown port, or two of one.
    #[error("ranges: expected {expected}, got {got}")]
    BadRange {
        /// The ports there are.
        expected: String,
        /// The given range.
        got: String,
    },
    /// A port that cannot be.
    #[error("ports: expected {expected}, got {got}")]
    BadPort {
        /// The expected form.
        expected: String,
        /// The given text.
        got: String,
    },
}
