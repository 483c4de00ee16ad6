//! A drawing to a netlist: by its labels where it carries its mechanism, else by its geometry.

use super::drawing::Drawing;
use super::labelled::{self, LabelledError};
use super::mask;
use super::process::{Process, ProcessError};
use super::read::LayoutError;
use super::report::Report;
use thiserror::Error;

/// The process of drawings that say none.
pub const DEFAULT_PROCESS: &str = "polymumps";

/// Why a layout makes no netlist.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ConvertError {
    /// It cannot be read.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// Its process.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// Its labels.
    #[error(transparent)]
    Labels(#[from] LabelledError),
    /// Nothing that moves is drawn.
    #[error(
        "{source_name}: none of its layers ({drawn}) is one that moves in process `{process}` ({wanted}): choose another with --process, \
         or write one (docs/layout.md)"
    )]
    NothingMoves {
        /// Name of the file.
        source_name: String,
        /// The drawing's layers.
        drawn: String,
        /// The process.
        process: String,
        /// Layers that would move.
        wanted: String,
    },
}

/// What came out.
#[derive(Debug, Clone, PartialEq)]
pub struct Converted {
    /// The netlist.
    pub netlist: String,
    /// What became of the drawing.
    pub report: Report,
    /// Name of the process.
    pub process: String,
}

/// Makes a netlist of a drawing. Without a process it is the one that the drawing names, or [`DEFAULT_PROCESS`].
///
/// # Errors
/// See [`ConvertError`].
pub fn convert(drawing: &Drawing, process: Option<&Process>) -> Result<Converted, ConvertError> {
    let named = mask::drawn_on(drawing);
    let builtin;
    let process = match process {
        Some(process) => process,
        None => {
            builtin = Process::builtin(named.unwrap_or(DEFAULT_PROCESS))?;
            &builtin
        }
    };
    if !drawing.layers.keys().any(|name| process.layer_of(name).is_some()) {
        let list = |names: Vec<&str>| if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        return Err(ConvertError::NothingMoves {
            source_name: drawing.source.clone(),
            drawn: list(drawing.layers.keys().map(String::as_str).take(20).collect()),
            process: process.name.clone(),
            wanted: list(process.layers.iter().flat_map(|l| &l.drawn).map(String::as_str).collect()),
        });
    }
    let (netlist, report) = labelled::read(drawing, process)?;
    Ok(Converted { netlist, report, process: process.name.clone() })
}
