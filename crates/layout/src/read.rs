//! A layout file of either format to a flat drawing.

use super::cif::{self, CifError};
use super::drawing::FlatLayout;
use super::flatten::FlattenError;
use super::gds::{self, GdsError};
use std::io::{BufReader, Read};
use std::path::Path;
use thiserror::Error;

/// Largest CIF file, which is held as text (bytes).
pub const LONGEST_CIF: u64 = 1 << 30;

/// Formats of layouts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayoutFormat {
    /// Caltech Intermediate Form, text.
    Cif,
    /// GDSII stream.
    Gds,
}

impl LayoutFormat {
    /// The format that a file's name says it has: `.cif`, `.gds`, `.gdsii`, `.gds2`, `.sf`; none: it is no layout.
    pub fn of(name: &str) -> Option<Self> {
        let extension = Path::new(name).extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "cif" => Some(Self::Cif),
            "gds" | "gdsii" | "gds2" | "sf" => Some(Self::Gds),
            _ => None,
        }
    }
}

/// Why a layout is not read.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LayoutError {
    /// The file's name says no format.
    #[error("{file} is no layout by its name: expected .cif or .gds")]
    Format {
        /// Name of the file.
        file: String,
    },
    /// The file cannot be read.
    #[error("cannot read {file}: {reason}")]
    Read {
        /// Name of the file.
        file: String,
        /// Message of the operating system.
        reason: String,
    },
    /// Too long to be held.
    #[error("{file} has {bytes} bytes: at most {LONGEST_CIF}")]
    Long {
        /// Name of the file.
        file: String,
        /// Its length.
        bytes: u64,
    },
    /// Not CIF.
    #[error(transparent)]
    Cif(#[from] CifError),
    /// Not GDSII.
    #[error(transparent)]
    Gds(#[from] GdsError),
    /// Its hierarchy.
    #[error(transparent)]
    Flatten(#[from] FlattenError),
}

/// Reads a layout from its bytes; `name` gives the format. `cell` is the cell to draw; none: the only one that no other calls.
///
/// # Errors
/// See [`LayoutError`].
pub fn from_bytes(bytes: &[u8], name: &str, cell: Option<&str>) -> Result<FlatLayout, LayoutError> {
    let format = LayoutFormat::of(name).ok_or_else(|| LayoutError::Format { file: name.to_owned() })?;
    let library = match format {
        LayoutFormat::Cif => cif::read(bytes, name)?,
        LayoutFormat::Gds => gds::read(bytes, name, &mut |_| true)?,
    };
    Ok(library.flatten(cell)?)
}

/// Reads a layout file. `watch` receives the fraction that was read and returns whether to continue.
///
/// # Errors
/// See [`LayoutError`].
pub fn from_file(
    path: &Path,
    cell: Option<&str>,
    watch: &mut dyn FnMut(f64) -> bool,
) -> Result<FlatLayout, LayoutError> {
    let name = path.display().to_string();
    let format = LayoutFormat::of(&name).ok_or_else(|| LayoutError::Format { file: name.clone() })?;
    let failed = |e: std::io::Error| LayoutError::Read { file: name.clone(), reason: e.to_string() };
    let mut file = std::fs::File::open(path).map_err(failed)?;
    let size = file.metadata().map_err(failed)?.len();
    let library = match format {
        LayoutFormat::Cif => {
            if size > LONGEST_CIF {
                return Err(LayoutError::Long { file: name, bytes: size });
            }
            let mut text = Vec::with_capacity(size as usize);
            file.by_ref().take(LONGEST_CIF).read_to_end(&mut text).map_err(failed)?;
            cif::read(&text, &name)?
        }
        LayoutFormat::Gds => {
            let mut reported = |at: u64| watch(at as f64 / size.max(1) as f64);
            gds::read(BufReader::with_capacity(1 << 16, file), &name, &mut reported)?
        }
    };
    Ok(library.flatten(cell)?)
}
