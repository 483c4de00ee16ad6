//! Pull-in and release voltages.
use super::AnalysisError;
use crate::compile::Compiled;
use serde::Serialize;

/// Where a gap closes and where it opens again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PullInResult {
    /// The port or netlist source whose voltage was swept.
    pub port: String,
    /// Voltage of the fold on the way up [V].
    pub pull_in_v: f64,
    /// Voltage at which the closed gap lets go on the way down [V]; none when it never closed or stays stuck.
    pub release_v: Option<f64>,
}

/// Follows the equilibrium up to `max` volts on `port` (none: the first port, else the first source of the netlist).
///
/// # Errors
/// See [`AnalysisError`]; `NoEquilibrium` when nothing pulls in below `max`.
pub fn pull_in(compiled: &Compiled, port: Option<&str>, max: f64) -> Result<PullInResult, AnalysisError> {
    let _ = (compiled, port, max);
    Err(AnalysisError::NoEquilibrium { detail: "not built yet".into() })
}
