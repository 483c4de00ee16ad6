//! Runs, bounds of their work, and messages: common to propagated errors and to companions.

use super::super::transient::{TransientOptions, TransientResult};
use super::super::{AnalysisError, ProgressCallback};

/// Ratio of the tolerance of a companion to that of the run.
pub(super) const COMPANION_TOLERANCE_RATIO: f64 = 10.0;
/// Loosest tolerance of a companion.
const LOOSEST: f64 = 0.3;
/// Unknowns times steps of a companion, at most.
pub(super) const MAX_WORK: f64 = 3e6;
/// Unknowns times steps of a run that is repeated, at most: some seconds.
pub(super) const MAX_AGAIN: f64 = 1e7;
/// Fraction of the tolerance that steps have in any case.
const MIN_ROOM: f64 = 0.3;
/// Samples of a run that is run again, at most.
pub(super) const MAX_STORED_SAMPLES: usize = 1 << 20;
/// Where the estimate of a single run is made.
pub(super) const AT_THE_END: &str = "over the run";

/// Makes a run with its options; calls back with each sample and with progress.
pub type RunFunction<'r, T> = &'r mut dyn FnMut(
    &TransientOptions<'_>,
    &mut dyn FnMut(f64, &[f64]),
    ProgressCallback<'_>,
) -> Result<(TransientResult, T), AnalysisError>;

/// Part of the tolerance that the error of the mesh leaves to the steps.
pub(super) fn room(tol: f64, mesh: Option<f64>) -> f64 {
    match mesh {
        Some(mesh) if mesh <= tol => (tol - mesh).max(MIN_ROOM * tol),
        _ => tol,
    }
}

/// The tolerance of a companion.
pub(super) fn loose(options: &TransientOptions<'_>) -> f64 {
    (COMPANION_TOLERANCE_RATIO * options.tol).min(LOOSEST)
}

/// Warning about steps without an estimate.
pub fn unknown(options: &TransientOptions<'_>) -> String {
    format!("the error of the steps in time is unknown: the tolerance {:e} is not confirmed", options.tol)
}

/// Warning about steps whose estimate exceeds the tolerance; `place` says of what it is the estimate.
pub fn beyond(options: &TransientOptions<'_>, error: f64, place: &str) -> Option<String> {
    if error <= options.tol {
        return None;
    }
    let way = if options.step.is_some() { "take a shorter --step" } else { "take a smaller --tol" };
    Some(format!(
        "the estimated error of the steps in time is {error:.1e} of the amplitude {place}, more than the tolerance {:e}; {way}",
        options.tol
    ))
}
