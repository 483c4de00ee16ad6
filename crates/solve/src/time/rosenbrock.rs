//! One step of Rodas4 in any coordinates: the order of its stages, written once.
//!
//! A stage takes an argument from the increments of the stages before it, evaluates the forces there, and solves with the matrix of the
//! step, which the first stage factors. The method is stiffly accurate: the last argument plus its increment is the end of the step, and
//! the increment its error. Arguments, forces and solves depend on the coordinates:
//!
//! | coordinates | in |
//! |---|---|
//! | every body's own | [`rodas4`](super::rodas4) |
//! | the same of eight variants | [`rodas4::lanes`](super::rodas4::lanes) |
//! | of joints | [`joint_rodas4`](super::joint_rodas4) |
//! | of a reduced model | [`reduced_rodas4`](super::reduced_rodas4) |
//!
//! Reference: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II" (1996), §IV.7 (RODAS).

use super::method::StepResult;
use super::rodas4::tableau::{ALPHA, moves_on};

/// Fraction of the shortest time at which accelerations are made consistent: directions without inertia follow their springs,
/// all others their inertia.
pub(super) const CONSISTENT: f64 = 1e-3;

/// A step under way in some coordinates; it knows where it starts and its length.
pub(super) trait RosenbrockStep {
    /// Sources and their rates at the start of the step, and what follows from them alone.
    ///
    /// # Errors
    /// [`StepFailure`] where the step is too long for them.
    fn begin(&mut self) -> StepResult;

    /// Sources after the fraction `alpha` of the step.
    fn drive_at(&mut self, alpha: f64);

    /// Where stage `i` evaluates the forces.
    fn argument(&mut self, i: usize);

    /// The forces there; in the first stage with their tangent.
    fn residual(&mut self, i: usize);

    /// Factors the matrix of the step, after the residual of the first stage.
    ///
    /// # Errors
    /// [`StepFailure`] where it has no factor.
    fn factor(&mut self) -> StepResult;

    /// The increments of stage `i`.
    fn solve(&mut self, i: usize);

    /// The end of the step and its error, after the last stage.
    fn finish(&mut self);
}

/// Takes the step.
///
/// # Errors
/// Those of its parts.
#[inline]
pub(super) fn take(step: &mut impl RosenbrockStep) -> StepResult {
    step.begin()?;
    for (i, alpha) in ALPHA.into_iter().enumerate() {
        if moves_on(i) {
            step.drive_at(alpha);
        }
        step.argument(i);
        step.residual(i);
        if i == 0 {
            step.factor()?;
        }
        step.solve(i);
    }
    step.finish();
    Ok(())
}
