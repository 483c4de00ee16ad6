//! Diagonally implicit Runge–Kutta methods on bodies, by their tableau: TR-BDF2 and SDIRK4.
//! ```text
//! q_i = q₀ + h·Σ_{j≤i} a_ij·v_j,   v_i = v₀ + h·Σ_{j≤i} a_ij·f_j,   M·f = −r − C·v
//! y₁ = y_s,                        error = h·Σ e_i·(v_i, f_i), taken through (I − γh·J)⁻¹      γ = a_ii
//! ```
//! Each implicit stage is Newton's iteration with M/(γh)² + C/(γh) + K; a first stage with a₁₁ = 0 evaluates the forces. The
//! forces of the other stages follow from the stages themselves, in the form M·f, so that bodies without inertia need no
//! inverse. Where Rodas4 needs the Jacobian in its formula, here it only speeds the iteration up, so the order does not hang on
//! it: joint coordinates take the same tableaus with an approximate one ([`super::joint_dirk`]).

use super::implicit::{Equation, Implicit, Sample};
use super::method::{Method, Motion, StepFailure, Work};
use super::tableau::Tableau;
use crate::domains::{Ramp, System};
use crate::multibody::forces;
use crate::multibody::planar::Pose;
use crate::solve::linear::{LinearSolver, Recursion};

/// A method with its storage.
#[derive(Debug, Clone)]
pub struct Dirk<S = Recursion> {
    tableau: &'static Tableau,
    implicit: Implicit<S>,
    constant: Vec<Pose>,
    known: Vec<Pose>,
    x: Vec<Pose>,
    /// Rates (q) and M·f (v) of the stages.
    stages: Vec<Motion>,
}

impl Dirk {
    /// Storage for a system. The last stage of `tableau` is the end, and it has an estimate.
    pub fn new(system: &System, tableau: &'static Tableau) -> Self {
        Self::with_solver(Recursion, system, tableau)
    }
}

impl<S: LinearSolver> Dirk<S> {
    /// [`Dirk::new`] with another solver of its linear systems.
    pub fn with_solver(solver: S, system: &System, tableau: &'static Tableau) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self {
            tableau,
            implicit: Implicit::new(solver, system),
            constant: zeros.clone(),
            known: zeros.clone(),
            x: zeros,
            stages: vec![Motion::zeros(system.bodies()); tableau.a.len()],
        }
    }

    /// A stage without a diagonal: rate and M·f where the step begins.
    fn evaluate(&mut self, system: &System, ramp: &Ramp<'_>, s: f64, motion: &Motion) {
        let stage = &mut self.stages[0];
        self.implicit.force(system, ramp, s, &motion.q, &mut stage.v);
        forces::add_damping(&system.model, &motion.v, &mut stage.v);
        stage.v.iter_mut().for_each(|f| *f = -*f);
        stage.q.copy_from_slice(&motion.v);
    }
}

impl<S: LinearSolver> Method for Dirk<S> {
    fn error_order(&self) -> f64 {
        self.tableau.order
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
        let Tableau { a, c: nodes, .. } = self.tableau;
        let (n, last) = (motion.q.len(), a.len() - 1);
        let gamma = a[last][last];
        let c = 1.0 / (gamma * h);
        let mass = |k: usize, x: Pose| model.mass(k).component_mul(&x);
        for (x, v) in self.x.iter_mut().zip(&motion.v) {
            *x = v * (nodes[0] * h);
        }
        for (i, row) in a.iter().enumerate() {
            if row[i] == 0.0 {
                self.evaluate(system, ramp, s + nodes[i] * h, motion);
                continue;
            }
            let (before, rest) = self.stages.split_at_mut(i);
            let stage = &mut rest[0];
            for k in 0..n {
                let (mut known, mut push) = (Pose::zeros(), Pose::zeros());
                for (stage, a) in before.iter().zip(*row) {
                    known += stage.q[k] * (a / gamma);
                    push += stage.v[k] * (a / gamma);
                }
                self.constant[k] = -mass(k, (known + motion.v[k]) * c) - push;
                self.known[k] = -known;
                stage.v[k] = push;
                if let Some(last) = before.last() {
                    // the last stage's place, moved on at its rate
                    self.x[k] += last.q[k] * ((nodes[i] - nodes[i - 1]) * h);
                }
            }
            forces::add_damping(model, &self.known, &mut self.constant);
            let samples = [Sample { weight: 1.0, share: 1.0, time: s + nodes[i] * h }];
            let equation = Equation { m: c * c, c, base: &motion.q, constant: &self.constant, samples: &samples };
            self.implicit.newton(system, ramp, &equation, &mut self.x)?;
            for k in 0..n {
                let rate = self.x[k] * c + self.known[k];
                stage.v[k] = mass(k, rate - motion.v[k]) * c - stage.v[k];
                stage.q[k] = rate;
            }
        }
        let weights = self.tableau.error.unwrap_or_default();
        for k in 0..n {
            let (mut rate, mut push) = (Pose::zeros(), Pose::zeros());
            for (stage, e) in self.stages.iter().zip(weights) {
                rate += stage.q[k] * (e * h);
                push += stage.v[k] * (e * h);
            }
            // the raw estimate: its displacements, and the force behind its rates
            (error.v[k], error.q[k]) = (rate, push);
            motion.v[k] = self.stages[last].q[k];
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
