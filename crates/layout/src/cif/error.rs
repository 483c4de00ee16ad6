//! Errors of CIF files.

use thiserror::Error;

/// Why a CIF file is not read.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{file}: line {line}, column {column}: {fault}")]
pub struct CifError {
    /// Name of the file.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The fault at that position.
    pub fault: CifFault,
}

/// Errors of CIF files.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CifFault {
    /// Another character was expected.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// Token that the command expects.
        expected: &'static str,
        /// Token found.
        found: String,
    },
    /// No command of CIF begins so.
    #[error("no command begins with {found}: expected P B W R L D C E, a digit, `(` or `;`")]
    Command {
        /// Token found.
        found: String,
    },
    /// A number with too many digits.
    #[error("the number {digits} is too large: at most {most}")]
    Number {
        /// Its digits.
        digits: String,
        /// The bound.
        most: i64,
    },
    /// A size that must be positive is not.
    #[error("{what} is {value}: expected more than 0")]
    Size {
        /// Which size.
        what: &'static str,
        /// Its value.
        value: i64,
    },
    /// A direction of length 0.
    #[error("the direction 0 0 points nowhere")]
    Direction,
    /// A polygon of fewer than three points, or a shape of more than the bound.
    #[error("{what} has {count} points: expected {expected}")]
    Points {
        /// Polygon or wire.
        what: &'static str,
        /// Its points.
        count: usize,
        /// How many it may have.
        expected: &'static str,
    },
    /// A shape before any `L`.
    #[error("no layer is chosen: write `L NAME;` before the first shape of a symbol")]
    NoLayer,
    /// DS within a symbol, DF outside of one, and the like.
    #[error("{0}")]
    Order(&'static str),
    /// The same symbol again.
    #[error("symbol {number} was defined before; `DD` deletes definitions")]
    Twice {
        /// Its number.
        number: i64,
    },
    /// The file ends too early.
    #[error("the file ends {0}")]
    End(&'static str),
    /// Too much in one file.
    #[error("more than {most} {what}")]
    Many {
        /// Of what.
        what: &'static str,
        /// The bound.
        most: usize,
    },
}
