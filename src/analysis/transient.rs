//! Motion in time.
use super::{AnalysisError, Watch};
use crate::compile::Compiled;
use serde::Serialize;

/// What a transient may be told.
#[derive(Debug, Clone)]
pub struct TransientOptions<'a> {
    /// End time [s].
    pub stop: f64,
    /// Names of the signals wanted, see [`crate::device::SignalInfo`].
    pub signals: Vec<String>,
    /// Number of equally spaced output times, ends included.
    pub points: usize,
    /// Relative error of a step [1].
    pub tol: f64,
    /// Voltages held during the run, by port name [V].
    pub voltages: Vec<(String, f64)>,
    /// A variant of the same netlist whose static equilibrium is the initial state; none: at rest as drawn.
    pub release: Option<&'a Compiled>,
}

/// Work done by an integration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Counters {
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Factorizations.
    pub factorizations: u64,
    /// Solves with a factor.
    pub solves: u64,
}

/// Sampled signals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TransientResult {
    /// Times [s].
    pub t: Vec<f64>,
    /// Samples of each signal, in the order asked for: (name, unit, values).
    pub signals: Vec<(String, String, Vec<f64>)>,
    /// Work done.
    pub counters: Counters,
    /// Mechanical unknowns.
    pub unknowns: usize,
}

/// Integrates the motion. Each finished sample also goes to `sample` (t, values in signal order), for streaming.
///
/// # Errors
/// See [`AnalysisError`].
pub fn transient(
    compiled: &Compiled,
    options: &TransientOptions<'_>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: Watch<'_>,
) -> Result<TransientResult, AnalysisError> {
    let _ = (compiled, options, sample, watch);
    Err(AnalysisError::Cancelled)
}
