//! The front end of every command: a file in any language to a bundle that the rest reads.
//!
//! A netlist is its own bundle. A layout is converted, and the bundle holds the resulting netlist under the layout's
//! name.

use crate::convert::{ConvertError, Converted, convert};
use crate::{FlatLayout, LayoutError, LayoutFormat, Process, ProcessError};
use bimorph_base::Bundle;
use bimorph_netlist::{DroppedInclude, read_bundle_reporting};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// How a layout is to be read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LayoutChoice {
    /// A process inside the program, or the path of a process file; none: the one that the drawing names.
    pub process: Option<String>,
    /// The cell; none: the one that no other calls.
    pub cell: Option<String>,
}

/// A bundle with what a conversion had to say.
#[derive(Debug, Clone)]
pub struct InputBundle {
    /// The netlist.
    pub bundle: Bundle,
    /// Result of converting a layout; `None` for netlists.
    pub converted: Option<Converted>,
}

/// Why there is no bundle.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FrontError {
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A layout makes no netlist.
    #[error(transparent)]
    Convert(#[from] ConvertError),
    /// `--process` or `--cell` for a netlist.
    #[error("--{option} is for layouts (.cif, .gds); {file} is a netlist")]
    Netlist {
        /// The option.
        option: &'static str,
        /// The file.
        file: String,
    },
}

impl LayoutChoice {
    /// The requested process.
    ///
    /// # Errors
    /// It is not there, or cannot be read.
    pub fn process(&self) -> Result<Option<Process>, FrontError> {
        let Some(name) = &self.process else { return Ok(None) };
        let path = Path::new(name);
        let is_file = path.extension().is_some() || name.contains('/') || path.is_file();
        if Process::builtin_names().any(|known| known == name) || !is_file {
            return Ok(Some(Process::builtin(name).map_err(ConvertError::from)?));
        }
        let text =
            std::fs::read_to_string(path).map_err(|source| FrontError::Read { path: path.to_owned(), source })?;
        let process = Process::parse(&text, name).map_err(ConvertError::from)?;
        Ok(Some(process))
    }
}

/// Reads a netlist with everything it uses, or a layout. `watch` receives the fraction of a layout that was read and
/// returns whether to continue.
///
/// # Errors
/// See [`FrontError`].
pub fn read(
    path: &Path,
    include: &[PathBuf],
    asked: &LayoutChoice,
    dropped: &mut dyn FnMut(DroppedInclude),
    watch: &mut dyn FnMut(f64) -> bool,
) -> Result<InputBundle, FrontError> {
    let file = path.display().to_string();
    if LayoutFormat::of(&file).is_none() {
        for (option, value) in [("process", &asked.process), ("cell", &asked.cell)] {
            if value.is_some() {
                return Err(FrontError::Netlist { option, file });
            }
        }
        let read = read_bundle_reporting(path, include, dropped);
        let bundle = read.map_err(|source| FrontError::Read { path: path.to_owned(), source })?;
        return Ok(InputBundle { bundle, converted: None });
    }
    Ok(drawing_and_source(path, asked, watch)?.1)
}

/// Reads a layout, and gives the drawing too.
///
/// # Errors
/// See [`FrontError`].
pub fn drawing_and_source(
    path: &Path,
    asked: &LayoutChoice,
    watch: &mut dyn FnMut(f64) -> bool,
) -> Result<(FlatLayout, InputBundle), FrontError> {
    let process = asked.process()?;
    let drawing = crate::from_file(path, asked.cell.as_deref(), watch)?;
    let converted = convert(&drawing, process.as_ref())?;
    let source = source(&path.display().to_string(), converted);
    Ok((drawing, source))
}

/// The same from bytes that were sent; `process` is the name of one inside the program, or the text of a process file.
///
/// # Errors
/// See [`ConvertError`].
pub fn from_bytes(
    bytes: &[u8],
    name: &str,
    process: Option<&str>,
    cell: Option<&str>,
) -> Result<InputBundle, ConvertError> {
    let process = match process {
        None => None,
        Some(text) if text.contains('\n') => Some(Process::parse(text, "the process")?),
        Some(name) => Some(Process::builtin(name)?),
    };
    let drawing = crate::from_bytes(bytes, name, cell)?;
    let converted = convert(&drawing, process.as_ref())?;
    Ok(source(name, converted))
}

/// A layout's netlist under its name, with places in the drawing.
fn source(name: &str, converted: Converted) -> InputBundle {
    let bundle = Bundle { places: converted.places.clone(), ..Bundle::from_text(name, &converted.netlist) };
    InputBundle { bundle, converted: Some(converted) }
}

impl From<LayoutError> for FrontError {
    fn from(error: LayoutError) -> Self {
        Self::Convert(error.into())
    }
}

impl From<ProcessError> for FrontError {
    fn from(error: ProcessError) -> Self {
        Self::Convert(error.into())
    }
}
