//! Which kind of file is meant by a file name.

use std::path::Path;
use thiserror::Error;

/// Kinds of result files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResultFormat {
    /// ngspice raw file, binary.
    Raw,
    /// Comma-separated values.
    Csv,
    /// Scalable picture.
    Svg,
    /// Pixel picture.
    Png,
    /// A web page that holds the picture.
    Html,
}

/// Extensions that [`ResultFormat::from_path`] knows, as they are listed in messages.
pub const KNOWN: &str = ".raw, .csv, .svg, .png, .html";

/// A file name that says no known format.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("\"{name}\" names no known result format; the extension must be one of {KNOWN}")]
pub struct UnknownFormat {
    /// The name given.
    pub name: String,
}

impl ResultFormat {
    /// The format of the extension of `path`.
    ///
    /// # Errors
    /// [`UnknownFormat`] for any other extension, or none.
    pub fn from_path(path: &Path) -> Result<Self, UnknownFormat> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        match extension.as_str() {
            "raw" => Ok(Self::Raw),
            "csv" => Ok(Self::Csv),
            "svg" => Ok(Self::Svg),
            "png" => Ok(Self::Png),
            "html" => Ok(Self::Html),
            _ => Err(UnknownFormat { name: path.display().to_string() }),
        }
    }

    /// True for the formats that hold numbers.
    pub fn is_table(self) -> bool {
        matches!(self, Self::Raw | Self::Csv)
    }
}
