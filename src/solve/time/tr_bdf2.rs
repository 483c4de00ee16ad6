//! TR-BDF2: a trapezoidal stage to γ·h, γ = 2 − √2, then a backward difference over the three points. Order 2, L-stable,
//! with an embedded estimate.
//! ```text
//! y_γ = y₀ + d·h·(f₀ + f_γ)                      d = γ/2
//! y₁ = y₀ + h·(w·f₀ + w·f_γ + d·f₁)              w = √2/4
//! error = h·((1 − 4w)/3·f₀ + f_γ/3 − 2d/3·f₁)    taken through (I − d·h·J)⁻¹, so that stiff motions do not count
//! ```
//! with y = (q, v), f = (v, M⁻¹·F), F = −r − C·v. Both stages have the iteration matrix M/(dh)² + C/(dh) + K. F₀ is
//! evaluated; the other two follow from the stages themselves, in the form M·f, so that bodies without inertia need no
//! inverse.
//!
//! Reference: M. E. Hosea, L. F. Shampine, "Analysis and implementation of TR-BDF2", Appl. Numer. Math. 20 (1996) 21–37.

use super::implicit::{Equation, Implicit, Sample};
use super::method::{Method, Motion, StepFailure, Work};
use crate::gaps::{Ramp, System};
use crate::multibody::forces;
use crate::multibody::planar::Pose;
use crate::solve::linear::{LinearSolver, Recursion};
use std::f64::consts::SQRT_2;

const GAMMA: f64 = 2.0 - SQRT_2;
const D: f64 = 0.5 * GAMMA;
const W: f64 = 0.25 * SQRT_2;

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct TrBdf2<S = Recursion> {
    implicit: Implicit<S>,
    constant: Vec<Pose>,
    x: Vec<Pose>,
    rate: Vec<Pose>,
    /// F at the start, at γ·h, at the end.
    forces: [Vec<Pose>; 3],
    scratch: Vec<Pose>,
}

impl TrBdf2 {
    /// Storage for a system.
    pub fn new(system: &System) -> Self {
        Self::with_solver(Recursion, system)
    }
}

impl<S: LinearSolver> TrBdf2<S> {
    /// [`TrBdf2::new`] with another solver of its linear systems.
    pub fn with_solver(solver: S, system: &System) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self {
            implicit: Implicit::new(solver, system),
            constant: zeros.clone(),
            x: zeros.clone(),
            rate: zeros.clone(),
            forces: [zeros.clone(), zeros.clone(), zeros.clone()],
            scratch: zeros,
        }
    }
}

impl<S: LinearSolver> Method for TrBdf2<S> {
    fn error_order(&self) -> f64 {
        3.0
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
        let (n, dh) = (motion.q.len(), D * h);
        let (m, c) = (1.0 / (dh * dh), 1.0 / dh);
        let mass = |k: usize, x: Pose| model.mass(k).component_mul(&x);
        let [start, middle, end] = &mut self.forces;
        // F₀; the stage's equation holds r₀ = −F₀ − C·v₀ and −C·v₀, which add up to r₀ alone
        self.implicit.force(system, ramp, s, &motion.q, start);
        for (k, start) in start.iter().enumerate() {
            self.constant[k] = start - mass(k, motion.v[k]) * (2.0 * c);
            self.x[k] = motion.v[k] * (GAMMA * h);
        }
        forces::add_damping(model, &motion.v, start);
        start.iter_mut().for_each(|f| *f = -*f);
        let samples = [Sample { weight: 1.0, share: 1.0, time: s + GAMMA * h }];
        let equation = Equation { m, c, base: &motion.q, constant: &self.constant, samples: &samples };
        self.implicit.newton(system, ramp, &equation, &mut self.x)?;
        for k in 0..n {
            let rate = self.x[k] * c - motion.v[k];
            middle[k] = mass(k, rate - motion.v[k]) * c - start[k];
            self.rate[k] = rate;
        }
        // second stage: x = h·w·(v₀ + v_γ) + d·h·v₁
        for k in 0..n {
            let known = (motion.v[k] + self.rate[k]) * (W / D);
            self.constant[k] = -mass(k, (known + motion.v[k]) * c) - (start[k] + middle[k]) * (W / D);
            self.scratch[k] = -known;
            self.x[k] = self.x[k] + self.rate[k] * ((1.0 - GAMMA) * h);
        }
        forces::add_damping(model, &self.scratch, &mut self.constant);
        let samples = [Sample { weight: 1.0, share: 1.0, time: s + h }];
        let equation = Equation { m, c, base: &motion.q, constant: &self.constant, samples: &samples };
        self.implicit.newton(system, ramp, &equation, &mut self.x)?;
        let weights = [(1.0 - 4.0 * W) / 3.0, 1.0 / 3.0, -2.0 * D / 3.0].map(|w| w * h);
        for k in 0..n {
            let rate = self.x[k] * c + self.scratch[k];
            end[k] = mass(k, rate - motion.v[k]) * c - (start[k] + middle[k]) * (W / D);
            // the raw estimate: its displacements, and the force behind its rates
            error.v[k] = motion.v[k] * weights[0] + self.rate[k] * weights[1] + rate * weights[2];
            error.q[k] = start[k] * weights[0] + middle[k] * weights[1] + end[k] * weights[2];
            motion.v[k] = rate;
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
