//! The average vector field method: order 2, A-stable, and it keeps the energy.
//! ```text
//! M·(v₁ − v₀)/h + C·(v₀ + v₁)/2 + ∫₀¹ r(q₀ + ξ·(q₁ − q₀)) dξ = 0,      q₁ − q₀ = h·(v₀ + v₁)/2
//! ```
//! The integral of a gradient along a chord, times the chord, is the difference of its potential (a discrete gradient):
//! multiplied by q₁ − q₀ the equation says that kinetic and potential energy change by what the damping takes, whatever
//! the step. Two Gauss points stand for the integral; they are exact where r is cubic along the chord, and what they miss
//! falls with the fourth power of the step.
//!
//! Reference: G. R. W. Quispel, D. I. McLaren, "A new class of energy-preserving numerical integration methods", J. Phys. A
//! 41 (2008) 045206, eq. 4; E. Hairer, "Energy-preserving variant of collocation methods", JNAIAM 5 (2010).

use super::centred::Centred;
use super::linear::{LinearSolver, Recursion};
use super::method::{Method, Motion, StepFailure, Work};
use crate::gaps::{Ramp, System};

/// Half of 1/√3.
const HALF: f64 = 0.288_675_134_594_812_9;
/// Weights and places of the Gauss points on the chord.
const POINTS: [(f64, f64); 2] = [(0.5, 0.5 - HALF), (0.5, 0.5 + HALF)];

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct AverageField<S = Recursion>(Centred<S>);

impl AverageField {
    /// Storage for a system.
    pub fn new(system: &System) -> Self {
        Self::with_solver(Recursion, system)
    }
}

impl<S: LinearSolver> AverageField<S> {
    /// [`AverageField::new`] with another solver of its linear systems.
    pub fn with_solver(solver: S, system: &System) -> Self {
        Self(Centred::new(solver, system))
    }
}

impl<S: LinearSolver> Method for AverageField<S> {
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
