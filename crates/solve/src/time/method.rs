//! Integrators: methods that take one step from a motion and estimate its error. [`super::adaptive`] drives any of
//! them, chosen at compile time.

use crate::equations::Equations;
pub use crate::equations::{Motion, SolverCounters, StepFailure, StepResult};

/// A one-step method with its storage, for some equations or for all.
pub trait Method<E: Equations> {
    /// The power of the step length with which the estimated error falls.
    fn error_order(&self) -> f64;

    /// Prepares for a motion that begins at time 0: data of an earlier one are dropped.
    ///
    /// # Errors
    /// [`StepFailure`] where there is no beginning.
    fn start(&mut self, equations: &mut E, motion: &Motion<E::Unknown>) -> StepResult {
        let _ = (equations, motion);
        Ok(())
    }

    /// One step of length `h` (s) from `motion` at time `t` (s). The new motion replaces `motion`, and `error` receives its
    /// estimated error.
    ///
    /// # Errors
    /// [`StepFailure`]; `motion` may then be anything.
    fn step(
        &mut self,
        equations: &mut E,
        t: f64,
        h: f64,
        motion: &mut Motion<E::Unknown>,
        error: &mut Motion<E::Unknown>,
    ) -> StepResult;

    /// A step of length `h` (s) from time `t` (s) between these ends is accepted; `carried` is what the method carried at its start.
    fn accepted(
        &mut self,
        equations: &mut E,
        (t, h): (f64, f64),
        ends: [&Motion<E::Unknown>; 2],
        carried: &[Motion<E::Unknown>],
    ) {
        let _ = (equations, t, h, ends, carried);
    }

    /// State between steps beside the motion: restored when a step is rejected.
    fn carried(&mut self) -> &mut [Motion<E::Unknown>] {
        &mut []
    }

    /// Work so far that the equations do not count themselves; the caller counts accepted steps.
    fn work(&self) -> SolverCounters {
        SolverCounters::default()
    }
}
