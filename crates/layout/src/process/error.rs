//! Why there is no process.

/// Why there is no process.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProcessError {
    /// Neither a file nor one of those inside.
    #[error(
        "there is no process `{name}`: the known ones are {known}; a file of your own is named by its path (ending in .toml)"
    )]
    Unknown {
        /// The requested name.
        name: String,
        /// Names of those inside.
        known: String,
    },
    /// Not TOML, or not a process.
    #[error("{file}: {message}")]
    Malformed {
        /// Name of the file.
        file: String,
        /// The fault, with line and column.
        message: String,
    },
    /// A number that cannot be.
    #[error("{file}: {what} is {value}: {expected}")]
    OutOfRange {
        /// Name of the file.
        file: String,
        /// Which number.
        what: String,
        /// Its value.
        value: f64,
        /// The required value.
        expected: &'static str,
    },
    /// A name that leads nowhere, or that is there twice.
    #[error("{file}: {message}")]
    Inconsistent {
        /// Name of the file.
        file: String,
        /// The mismatch.
        message: String,
    },
}
