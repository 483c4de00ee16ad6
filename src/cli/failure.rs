//! Why a command did not finish, and with which exit status.

use super::merge_error::MergeError;
use bimorph::analysis::AnalysisError;
use bimorph::analysis::chart::ChartError;
use bimorph::compile::CompileError;
use bimorph::cosim::CosimError;
use bimorph::cosim::deck::DeckError;
use bimorph::cosim::osdi::OsdiError;
use bimorph::document::UnwritableStructure;
use bimorph::export::ExportError;
use bimorph::input::FrontError;
use bimorph::jobs::sweep::SweepError;
use bimorph::jobs::sweep::journal::JournalError;
use bimorph::layout::LayoutError;
use bimorph::layout::convert::ConvertError;
use bimorph::layout::gds::{GdsError, GdsFault};
use bimorph::layout::mask::MaskError;
use bimorph::options::OptionError;
use bimorph::results::format::UnknownFormat;
use bimorph::results::plot::render::RenderError;
use bimorph::results::raw::RawError;
use bimorph::results::table::LengthMismatch;
use bimorph::service::address::AddressError;
use bimorph::service::client::ClientError;
use bimorph::service::server::ServeError;
use bimorph::service::settings::SettingError;
use bimorph::view::ViewServerError;
use std::io::{self, IsTerminal};
use std::path::PathBuf;
use thiserror::Error;

/// One failure, one message.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    #[error("cannot read {}: {source}", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("cannot write {}: {source}", path.display())]
    Write { path: PathBuf, source: io::Error },
    #[error("cannot write to standard output: {0}")]
    Stdout(io::Error),
    #[error("{option}: expected {expected}, got {got}")]
    BadOption { option: &'static str, expected: String, got: String },
    #[error("{what} has no {kind}; {hint}")]
    NoSuchOutput { what: &'static str, kind: &'static str, hint: &'static str },
    #[error("{}: {source}", path.display())]
    Raw { path: PathBuf, source: RawError },
    #[error("interrupted")]
    Interrupted,
    #[error("no point of the sweep has a result; the first says: {0}")]
    AllPoints(String),
    #[error("no run of the chart has a result; the first says: {0}")]
    AllRuns(String),
    #[error("the core does not work on this machine; see the lines marked missing")]
    Doctor,
    #[error("a server with these settings does not start; see the lines marked missing")]
    Settings,
    #[error("--{}: expected {}, got {}", .0.option.replace('_', "-"), .0.expected, .0.got)]
    Option(#[from] OptionError),
    #[error(transparent)]
    Format(#[from] UnknownFormat),
    #[error(transparent)]
    Compile(CompileError),
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    #[error(transparent)]
    Export(ExportError),
    #[error(transparent)]
    Chart(ChartError),
    #[error(transparent)]
    Table(#[from] LengthMismatch),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Sweep(#[from] SweepError),
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error(transparent)]
    Merge(#[from] MergeError),
    #[error(transparent)]
    Client(#[from] ClientError),
    #[error(transparent)]
    Cosim(#[from] CosimError),
    #[error(transparent)]
    Around(#[from] DeckError),
    #[error(transparent)]
    Osdi(#[from] OsdiError),
    #[error(transparent)]
    Serve(#[from] ServeError),
    #[error(transparent)]
    Bench(#[from] ViewServerError),
    #[error(transparent)]
    Setting(#[from] SettingError),
    #[error(transparent)]
    Front(FrontError),
    #[error(transparent)]
    Layout(#[from] LayoutError),
    #[error("no document: {0}")]
    Document(#[from] UnwritableStructure),
    #[error(transparent)]
    Mask(#[from] MaskError),
    #[error(transparent)]
    Address(#[from] AddressError),
}

/// An option out of range gives the same message from every source.
impl From<CompileError> for Failure {
    fn from(error: CompileError) -> Self {
        match error {
            CompileError::Option(refused) => refused.into(),
            other => Self::Compile(other),
        }
    }
}

/// All unreadable files give the same message; an interruption is not a failure.
impl From<FrontError> for Failure {
    fn from(error: FrontError) -> Self {
        match error {
            FrontError::Read { path, source } => Self::Read { path, source },
            FrontError::Convert(ConvertError::Layout(LayoutError::Gds(GdsError {
                fault: GdsFault::Interrupted,
                ..
            }))) => Self::Interrupted,
            other => Self::Front(other),
        }
    }
}

/// A chart's netlist and analysis fail as those of every command.
impl From<ChartError> for Failure {
    fn from(error: ChartError) -> Self {
        match error {
            ChartError::Compile(error) => error.into(),
            ChartError::Analysis(error) => error.into(),
            other => Self::Chart(other),
        }
    }
}

impl Failure {
    pub(crate) fn bad(option: &'static str, expected: impl Into<String>, got: impl Into<String>) -> Self {
        Self::BadOption { option, expected: expected.into(), got: got.into() }
    }

    /// Prints the message to standard error: diagnostics with their source lines as they are, all else in one line.
    pub(crate) fn show(&self) {
        match self {
            Self::Compile(CompileError::Netlist(diagnostics)) => {
                stderr_text!("{}", diagnostics.render(io::stderr().is_terminal()));
            }
            _ if self.is_broken_pipe() => {}
            Self::Cosim(error) => {
                stderr_line!("error: {}", error.to_string().trim_end());
                if let Some(words) = last_words(error) {
                    stderr_line!("ngspice's last words:\n{words}");
                }
            }
            _ => stderr_line!("error: {self}"),
        }
    }

    pub(crate) fn exit_status(&self) -> u8 {
        match self {
            Self::Interrupted
            | Self::Analysis(AnalysisError::Cancelled)
            | Self::Sweep(SweepError::Cancelled { .. }) => 130,
            // The reader has seen what it wanted: `bimorph … | head`.
            _ if self.is_broken_pipe() => 0,
            _ => 1,
        }
    }

    fn is_broken_pipe(&self) -> bool {
        matches!(self, Self::Stdout(e) if e.kind() == io::ErrorKind::BrokenPipe)
    }
}

/// Output of ngspice before it failed, where it was captured and the message alone is insufficient.
fn last_words(error: &CosimError) -> Option<String> {
    let (CosimError::Failed { output, .. } | CosimError::Stopped { output, .. }) = error else { return None };
    let lines: Vec<&str> = output.lines().filter(|line| !line.trim().is_empty()).collect();
    (!lines.is_empty()).then(|| lines[lines.len().saturating_sub(6)..].join("\n"))
}
