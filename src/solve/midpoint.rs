//! The implicit midpoint rule: order 2, A-stable, symplectic. Forces are taken once, in the middle of the step's chord.
//! Energy is kept on average, but in a stiff nonlinear structure fast axial motion exchanges it with the slow one.
//!
//! Reference: E. Hairer, C. Lubich, G. Wanner, "Geometric Numerical Integration" (2006), §II.1.2.

use super::centred::Centred;
use super::linear::{LinearSolver, Recursion};
use super::method::{Method, Motion, StepFailure, Work};
use crate::gaps::{Ramp, System};

/// Weight and place of the force on the chord.
const POINTS: [(f64, f64); 1] = [(1.0, 0.5)];

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct Midpoint<S = Recursion>(Centred<S>);

impl Midpoint {
    /// Storage for a system.
    pub fn new(system: &System) -> Self {
        Self::with_solver(Recursion, system)
    }
}

impl<S: LinearSolver> Midpoint<S> {
    /// [`Midpoint::new`] with another solver of its linear systems.
    pub fn with_solver(solver: S, system: &System) -> Self {
        Self(Centred::new(solver, system))
    }
}

impl<S: LinearSolver> Method for Midpoint<S> {
    fn error_order(&self) -> f64 {
        3.0
    }

    /// `error` receives zero: the method has no estimate of its own.
    fn step(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        s: f64,
        h: f64,
        motion: &mut Motion,
        error: &mut Motion,
    ) -> Result<(), StepFailure> {
        error.clear();
        self.0.step(system, ramp, (s, h), POINTS, motion)
    }

    fn work(&self) -> Work {
        self.0.work()
    }
}
