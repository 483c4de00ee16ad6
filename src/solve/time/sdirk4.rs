//! SDIRK4: five implicit stages with one diagonal coefficient, order 4, L-stable, with an embedded estimate of order 3.
//! ```text
//! q_i = q₀ + h·Σ_{j<i} a_ij·v_j + γh·v_i,   v_i = v₀ + h·Σ_{j<i} a_ij·f_j + γh·f_i,   M·f = −r − C·v      γ = 1/4
//! y₁ = y₅,                                  error = h·Σ e_i·(v_i, f_i), taken through (I − γh·J)⁻¹
//! ```
//! Each stage is Newton's iteration with M/(γh)² + C/(γh) + K. Where Rodas4 needs the Jacobian in its formula, here it only
//! speeds the iteration up, so the order does not hang on it: joint coordinates take the same method with an approximate
//! one ([`super::joint_dirk`]).
//!
//! Reference: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II" (1996), §IV.6, table 6.5.

use super::implicit::{Equation, Implicit, Sample};
use super::method::{Method, Motion, StepFailure, Work};
use crate::gaps::{Ramp, System};
use crate::multibody::forces;
use crate::multibody::planar::Pose;
use crate::solve::linear::{LinearSolver, Recursion};

const GAMMA: f64 = 0.25;
/// Nodes.
pub(super) const C: [f64; 5] = [0.25, 0.75, 0.55, 0.5, 1.0];
/// Rows of a, the diagonal included.
#[rustfmt::skip]
pub(super) const A: [&[f64]; 5] = [
    &[GAMMA],
    &[0.5, GAMMA],
    &[17.0 / 50.0, -1.0 / 25.0, GAMMA],
    &[371.0 / 1360.0, -137.0 / 2720.0, 15.0 / 544.0, GAMMA],
    &[25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0, GAMMA],
];
/// Weights of the error.
pub(super) const E: [f64; 5] = [-3.0 / 16.0, -27.0 / 32.0, 25.0 / 32.0, 0.0, 0.25];

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct Sdirk4<S = Recursion> {
    implicit: Implicit<S>,
    constant: Vec<Pose>,
    known: Vec<Pose>,
    x: Vec<Pose>,
    /// Rates (q) and M·f (v) of the stages.
    stages: Vec<Motion>,
}

impl Sdirk4 {
    /// Storage for a system.
    pub fn new(system: &System) -> Self {
        Self::with_solver(Recursion, system)
    }
}

impl<S: LinearSolver> Sdirk4<S> {
    /// [`Sdirk4::new`] with another solver of its linear systems.
    pub fn with_solver(solver: S, system: &System) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self {
            implicit: Implicit::new(solver, system),
            constant: zeros.clone(),
            known: zeros.clone(),
            x: zeros,
            stages: vec![Motion::zeros(system.bodies()); 5],
        }
    }
}

impl<S: LinearSolver> Method for Sdirk4<S> {
    fn error_order(&self) -> f64 {
        4.0
    }

    fn step(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        s: f64,
        h: f64,
        motion: &mut Motion,
        error: &mut Motion,
    ) -> Result<(), StepFailure> {
        let model = &system.model;
        let (n, c) = (motion.q.len(), 1.0 / (GAMMA * h));
        let mass = |k: usize, x: Pose| model.mass(k).component_mul(&x);
        for (x, v) in self.x.iter_mut().zip(&motion.v) {
            *x = v * (C[0] * h);
        }
        for i in 0..5 {
            let (before, rest) = self.stages.split_at_mut(i);
            let stage = &mut rest[0];
            for k in 0..n {
                let (mut known, mut push) = (Pose::zeros(), Pose::zeros());
                for (stage, a) in before.iter().zip(A[i]) {
                    known += stage.q[k] * (a / GAMMA);
                    push += stage.v[k] * (a / GAMMA);
                }
                self.constant[k] = -mass(k, (known + motion.v[k]) * c) - push;
                self.known[k] = -known;
                stage.v[k] = push;
                if let Some(last) = before.last() {
                    // the last stage's place, moved on at its rate
                    self.x[k] += last.q[k] * ((C[i] - C[i - 1]) * h);
                }
            }
            forces::add_damping(model, &self.known, &mut self.constant);
            let samples = [Sample { weight: 1.0, share: 1.0, time: s + C[i] * h }];
            let equation = Equation { m: c * c, c, base: &motion.q, constant: &self.constant, samples: &samples };
            self.implicit.newton(system, ramp, &equation, &mut self.x)?;
            for k in 0..n {
                let rate = self.x[k] * c + self.known[k];
                stage.v[k] = mass(k, rate - motion.v[k]) * c - stage.v[k];
                stage.q[k] = rate;
            }
        }
        for k in 0..n {
            let (mut rate, mut push) = (Pose::zeros(), Pose::zeros());
            for (stage, e) in self.stages.iter().zip(E) {
                rate += stage.q[k] * (e * h);
                push += stage.v[k] * (e * h);
            }
            // the raw estimate: its displacements, and the force behind its rates
            (error.v[k], error.q[k]) = (rate, push);
            motion.v[k] = self.stages[4].q[k];
            motion.q[k] += self.x[k];
        }
        model.project(&mut motion.v);
        self.implicit.smooth(system, c, error);
        Ok(())
    }

    fn work(&self) -> Work {
        self.implicit.work
    }
}
