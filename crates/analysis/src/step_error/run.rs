//! Runs, bounds of their work, and messages: common to propagated errors and to companions.

use super::super::transient::{TransientOptions, TransientResult};
use super::super::{AnalysisError, ProgressCallback};

/// Unknowns times steps of a companion, at most.
pub(super) const MAX_WORK: f64 = 3e6;
/// Unknowns times steps of a run that is repeated, at most: some seconds.
pub(super) const MAX_AGAIN: f64 = 1e7;
/// Where the estimate of a single run is made.
pub(super) const AT_THE_END: &str = "over the run";

/// Makes a run with its options; calls back with each sample and with progress.
pub type RunFunction<'r, T> = &'r mut dyn FnMut(
    &TransientOptions<'_>,
    &mut dyn FnMut(f64, &[f64]),
    ProgressCallback<'_>,
) -> Result<(TransientResult, T), AnalysisError>;

/// Warning about steps without an estimate.
pub fn unknown(options: &TransientOptions<'_>) -> String {
    format!(
        "the error of the steps in time is unknown: the tolerance {:e} is not confirmed",
        options.errors().requested()
    )
}

/// Warning about steps whose estimate exceeds the tolerance; `place` says of what it is the estimate.
pub fn beyond(options: &TransientOptions<'_>, error: f64, place: &str) -> Option<String> {
    if options.errors().holds(error) {
        return None;
    }
    let way = if options.step.is_some() { "take a shorter --step" } else { "take a smaller --tol" };
    Some(format!(
        "the estimated error of the steps in time is {error:.1e} of the amplitude {place}, more than the tolerance {:e}; {way}",
        options.errors().requested()
    ))
}
