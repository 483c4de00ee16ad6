//! What can be wrong in a GDSII file.

use thiserror::Error;

/// Why a GDSII file is not read.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{file}: byte {offset}, record {record}: {fault}")]
pub struct GdsError {
    /// Name of the file.
    pub file: String,
    /// Where the record begins [bytes].
    pub offset: u64,
    /// Name of the record's type.
    pub record: String,
    /// What is wrong with it.
    pub fault: GdsFault,
}

/// What can be wrong in a GDSII file.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GdsFault {
    /// The file ends within a record, or without ENDLIB.
    #[error("the file ends here, at least {missing} bytes too early: is it whole?")]
    Truncated {
        /// Bytes that this record lacks.
        missing: usize,
    },
    /// It cannot be read.
    #[error("{reason}")]
    Read {
        /// What the system says.
        reason: String,
    },
    /// A length below that of the head, or an odd one.
    #[error("its length is {length}: expected an even number of 4 or more")]
    Length {
        /// What the head says [bytes].
        length: u16,
    },
    /// Not a GDSII file at all.
    #[error("this is no GDSII stream: {what}")]
    Foreign {
        /// What it is instead, or was expected.
        what: &'static str,
    },
    /// A record where it cannot stand.
    #[error("it cannot stand here: expected {expected}")]
    Order {
        /// What can.
        expected: &'static str,
    },
    /// A record without the data that it must have.
    #[error("it holds {bytes} bytes: expected {expected}")]
    Data {
        /// What it holds.
        bytes: usize,
        /// What it must.
        expected: &'static str,
    },
    /// A number that cannot be.
    #[error("{what} is {value}: expected {expected}")]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// An element that lacks a record.
    #[error("the {element} that ends here has no {lacks}")]
    Incomplete {
        /// The element.
        element: &'static str,
        /// What it lacks.
        lacks: &'static str,
    },
    /// Too much in one file.
    #[error("more than {most} {what}")]
    Many {
        /// Of what.
        what: &'static str,
        /// The bound.
        most: u64,
    },
    /// Whoever watches the progress wants no more.
    #[error("interrupted")]
    Interrupted,
}
