//! Errors of GDSII files.

use thiserror::Error;

/// Why a GDSII file is not read.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{file}: byte {offset}, record {record}: {fault}")]
pub struct GdsError {
    /// Name of the file.
    pub file: String,
    /// Where the record begins (bytes).
    pub offset: u64,
    /// Name of the record's type.
    pub record: String,
    /// The fault at that position.
    pub fault: GdsFault,
}

/// Errors of GDSII files.
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
        /// Message of the operating system.
        reason: String,
    },
    /// A length below that of the head, or an odd one.
    #[error("its length is {length}: expected an even number of 4 or more")]
    Length {
        /// Length in the record's header (bytes).
        length: u16,
    },
    /// Not a GDSII file at all.
    #[error("this is no GDSII stream: {what}")]
    Foreign {
        /// The kind found or expected.
        what: &'static str,
    },
    /// A record where it cannot stand.
    #[error("it cannot stand here: expected {expected}")]
    Order {
        /// The kinds that can follow.
        expected: &'static str,
    },
    /// A record without the data that it must have.
    #[error("it holds {bytes} bytes: expected {expected}")]
    Data {
        /// Bytes of the record.
        bytes: usize,
        /// The kind of data required.
        expected: &'static str,
    },
    /// A number that cannot be.
    #[error("{what} is {value}: expected {expected}")]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The required value.
        expected: &'static str,
    },
    /// An element that lacks a record.
    #[error("the {element} that ends here has no {lacks}")]
    Incomplete {
        /// The element.
        element: &'static str,
        /// The missing record.
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
    /// The progress callback cancelled the read.
    #[error("interrupted")]
    Interrupted,
}
