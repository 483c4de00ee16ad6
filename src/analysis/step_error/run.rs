//! What every way to the estimate of a run has: the run itself, bounds of its work, and its messages.

use super::super::transient::{TransientOptions, TransientResult};
use super::super::{AnalysisError, Watch};

/// How much looser the first run is.
pub(super) const LOOSER: f64 = 10.0;
/// Loosest tolerance of a first run.
const LOOSEST: f64 = 0.3;
/// Unknowns times steps of a first run, at most.
pub(super) const MOST_WORK: f64 = 3e6;
/// The same of a run that is made again: some seconds.
pub(super) const MOST_AGAIN: f64 = 1e7;
/// Share of the tolerance that is left to steps in any case.
const LEAST_ROOM: f64 = 0.3;
/// Samples of a run that is run again, at most.
pub(super) const MOST_KEPT: usize = 1 << 20;
/// Where the estimate of a single run is made.
pub(super) const AT_THE_END: &str = "over the run";

/// Makes a run: with its options, told of each sample and of its progress.
pub type Run<'r, T> = &'r mut dyn FnMut(
    &TransientOptions<'_>,
    &mut dyn FnMut(f64, &[f64]),
    Watch<'_>,
) -> Result<(TransientResult, T), AnalysisError>;

/// What a tolerance leaves to the steps of a run whose mesh may be off by so much.
pub(super) fn room(tol: f64, mesh: Option<f64>) -> f64 {
    match mesh {
        Some(mesh) if mesh <= tol => (tol - mesh).max(LEAST_ROOM * tol),
        _ => tol,
    }
}

/// The tolerance of a first run.
pub(super) fn loose(options: &TransientOptions<'_>) -> f64 {
    (LOOSER * options.tol).min(LOOSEST)
}

/// What to say of steps that nothing was compared with.
pub(crate) fn unknown(options: &TransientOptions<'_>) -> String {
    format!("nothing tells how far the steps in time are off: the tolerance {:e} is not confirmed", options.tol)
}

/// What to say of steps whose estimate is beyond the tolerance; `place` says where it was made.
pub(crate) fn beyond(options: &TransientOptions<'_>, error: f64, place: &str) -> Option<String> {
    if error <= options.tol {
        return None;
    }
    let way = if options.step.is_some() { "take a shorter --step" } else { "take a smaller --tol" };
    Some(format!(
        "the steps in time may be off by {error:.1e} of the amplitude {place}, more than the tolerance {:e}; {way}",
        options.tol
    ))
}
