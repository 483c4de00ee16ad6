//! What every integrator of M·q̈ + C·q̇ + r(q, t) = 0 is: a method that takes one step from a motion and tells how wrong
//! the step may be. [`super::adaptive`] drives any of them, chosen at compile time.

use crate::domains::{Ramp, System};
use crate::multibody::factor::ZeroPivot;
use crate::multibody::planar::Pose;
use serde::{Deserialize, Serialize};

/// Displacements and rates, or changes of them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Displacements.
    pub q: Vec<Pose>,
    /// Rates.
    pub v: Vec<Pose>,
}

impl Motion {
    /// All zero.
    pub fn zeros(bodies: usize) -> Self {
        Self { q: vec![Pose::zeros(); bodies], v: vec![Pose::zeros(); bodies] }
    }

    pub(super) fn copy(&mut self, from: &Self) {
        self.q.copy_from_slice(&from.q);
        self.v.copy_from_slice(&from.v);
    }

    pub(super) fn clear(&mut self) {
        self.q.fill(Pose::zeros());
        self.v.fill(Pose::zeros());
    }

    pub(super) fn scale(&mut self, factor: f64) {
        self.q.iter_mut().chain(&mut self.v).for_each(|x| *x *= factor);
    }

    pub(super) fn add(&mut self, factor: f64, other: &Self) {
        if factor != 0.0 {
            for (a, b) in self.q.iter_mut().zip(&other.q) {
                *a += b * factor;
            }
            for (a, b) in self.v.iter_mut().zip(&other.v) {
                *a += b * factor;
            }
        }
    }
}

/// Work done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Factorizations; a complex one counts once.
    pub factorizations: u64,
    /// Solves with a factor.
    pub solves: u64,
    /// Evaluations of the forces, with or without their tangent.
    pub forces: u64,
    /// Newton iterations.
    pub iterations: u64,
}

/// Why a step of this length could not be taken; a shorter one may.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepFailure {
    /// The step's matrix cannot be factored.
    Singular(ZeroPivot),
    /// Newton's iteration did not settle.
    Diverged {
        /// Iterations made.
        iterations: usize,
        /// Body with the largest correction.
        body: usize,
        /// Its direction.
        direction: usize,
    },
}

impl From<ZeroPivot> for StepFailure {
    fn from(pivot: ZeroPivot) -> Self {
        Self::Singular(pivot)
    }
}

/// A one-step method with its storage.
pub trait Method {
    /// The power of the step length with which the estimated error falls.
    fn error_order(&self) -> f64;

    /// Prepares for a motion that begins at the start of `ramp`: what was kept of an earlier one is forgotten.
    ///
    /// # Errors
    /// [`StepFailure`] where there is no beginning.
    fn start(&mut self, system: &System, ramp: &Ramp<'_>, motion: &Motion) -> Result<(), StepFailure> {
        let _ = (system, ramp, motion);
        Ok(())
    }

    /// One step of length `h` [s] from `motion` at time `s` [s] of the ramp. The new motion replaces `motion`, and `error`
    /// receives its estimated error.
    ///
    /// # Errors
    /// [`StepFailure`]; `motion` may then be anything.
    fn step(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        s: f64,
        h: f64,
        motion: &mut Motion,
        error: &mut Motion,
    ) -> Result<(), StepFailure>;

    /// What goes from step to step besides the motion: put back when a step is rejected.
    fn carried(&mut self) -> &mut [Motion] {
        &mut []
    }

    /// Work so far; steps are counted by whoever accepts them.
    fn work(&self) -> Work;
}
