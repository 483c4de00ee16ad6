//! Why a request has no result, as the page shows it.

use bimorph_analysis::AnalysisError;
use bimorph_base::budget::Stopped;
use bimorph_base::{Diagnostic, Diagnostics, Severity};
use bimorph_model::compile::CompileError;
use serde::Serialize;

/// A failed request.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct Refusal {
    /// One sentence.
    pub(crate) error: String,
    /// Messages with their lines, where the netlist is at fault.
    pub(crate) diagnostics: Vec<LineMessage>,
    /// True where a newer request or a lost connection stopped it.
    pub(crate) superseded: bool,
}

/// A message about a line of the netlist.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct LineMessage {
    code: String,
    severity: &'static str,
    file: String,
    line: usize,
    column: usize,
    width: usize,
    message: String,
    help: String,
}

impl From<&Diagnostic> for LineMessage {
    fn from(d: &Diagnostic) -> Self {
        Self {
            code: d.code.clone(),
            severity: if d.severity == Severity::Error { "error" } else { "warning" },
            file: d.file.clone(),
            line: d.line,
            column: d.column,
            width: d.width,
            message: d.message.clone(),
            help: d.help.clone(),
        }
    }
}

impl Refusal {
    /// A refusal in one sentence.
    pub(crate) fn of(error: impl ToString) -> Self {
        Self { error: error.to_string(), ..Self::default() }
    }

    fn of_netlist(found: &Diagnostics) -> Self {
        let errors = found.items.iter().filter(|d| d.severity == Severity::Error);
        let error = errors.map(|d| d.message.clone()).next().unwrap_or_default();
        Self { error, diagnostics: found.items.iter().map(LineMessage::from).collect(), superseded: false }
    }
}

impl From<CompileError> for Refusal {
    fn from(error: CompileError) -> Self {
        match error {
            CompileError::Netlist(diagnostics) => Self::of_netlist(&diagnostics),
            other => Self::of(other),
        }
    }
}

impl From<AnalysisError> for Refusal {
    fn from(error: AnalysisError) -> Self {
        Self { superseded: error == AnalysisError::Cancelled, ..Self::of(error) }
    }
}

impl From<Stopped> for Refusal {
    fn from(stopped: Stopped) -> Self {
        Self { superseded: matches!(stopped, Stopped::Cancelled), ..Self::of(stopped) }
    }
}
