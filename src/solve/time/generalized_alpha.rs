//! The generalized-α method: order 2, with a chosen damping of motions faster than the step; and Newmark's rule.
//! ```text
//! (1 − α_m)·M·a₁ + α_m·M·a₀ + (1 − α_f)·(C·v₁ + r₁) + α_f·(C·v₀ + r₀) = 0
//! q₁ = q₀ + h·v₀ + h²·((½ − β)·a₀ + β·a₁),      v₁ = v₀ + h·((1 − γ)·a₀ + γ·a₁)
//! α_m = (2ρ − 1)/(ρ + 1),  α_f = ρ/(ρ + 1),  γ = ½ − α_m + α_f,  β = ¼·(1 − α_m + α_f)²
//! ```
//! ρ is the factor by which an infinitely fast linear motion shrinks in a step: 0 kills it at once, 1 leaves it and makes
//! the method the trapezoidal rule. Newmark's average acceleration is α_m = α_f = 0, γ = ½, β = ¼. Without damping
//! either may gain energy in a nonlinear structure when steps are long.
//!
//! The acceleration is carried from step to step. It begins at that of
//! ```text
//! M·a₀ + C·(v₀ + γ·h·a₀) + r(q₀ + β·h²·a₀) = 0
//! ```
//! which is that of the forces for motions slower than the first step, and none for those much faster: M⁻¹ of the forces would throw light
//! bodies that are let go to rates which only the damping of the method takes back. It is zero where there is no inertia.
//! There is no error estimate of its own; see [`super::doubling`].
//!
//! Reference: J. Chung, G. M. Hulbert, J. Appl. Mech. 60 (1993) 371–375; N. M. Newmark, J. Eng. Mech. 85 (1959) 67–94.

use super::implicit::{Equation, Implicit, Sample};
use super::method::{Method, Motion, StepFailure, Work};
use super::tableau::Alpha;
use crate::domains::{Ramp, System};
use crate::multibody::forces;
use crate::multibody::planar::Pose;
use crate::solve::linear::{LinearSolver, Recursion};

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct GeneralizedAlpha<S = Recursion> {
    implicit: Implicit<S>,
    alpha: Alpha,
    /// The acceleration, as the rates of a motion.
    acceleration: [Motion; 1],
    constant: Vec<Pose>,
    x: Vec<Pose>,
    scratch: Vec<Pose>,
}

impl GeneralizedAlpha {
    /// Storage for a system; `rho` is ρ, from 0 to 1.
    pub fn new(system: &System, rho: f64) -> Self {
        Self::with_solver(Recursion, system, rho)
    }

    /// Newmark's rule with average acceleration.
    pub fn newmark(system: &System) -> Self {
        Self::newmark_with_solver(Recursion, system)
    }
}

impl<S: LinearSolver> GeneralizedAlpha<S> {
    /// [`GeneralizedAlpha::new`] with another solver of its linear systems.
    pub fn with_solver(solver: S, system: &System, rho: f64) -> Self {
        Self::with_parameters(solver, system, Alpha::damping(rho))
    }

    /// [`GeneralizedAlpha::newmark`] with another solver of its linear systems.
    pub fn newmark_with_solver(solver: S, system: &System) -> Self {
        Self::with_parameters(solver, system, Alpha::newmark())
    }

    fn with_parameters(solver: S, system: &System, alpha: Alpha) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self {
            implicit: Implicit::new(solver, system),
            alpha,
            acceleration: [Motion::zeros(system.bodies())],
            constant: zeros.clone(),
            x: zeros.clone(),
            scratch: zeros,
        }
    }
}

impl<S: LinearSolver> GeneralizedAlpha<S> {
    /// The acceleration that a motion begins with, as its first step sees it.
    fn begin(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        motion: &Motion,
        (bh2, gbh): (f64, f64),
    ) -> Result<(), StepFailure> {
        let model = &system.model;
        self.constant.fill(Pose::zeros());
        forces::add_damping(model, &motion.v, &mut self.constant);
        self.x.fill(Pose::zeros());
        let samples = [Sample { weight: 1.0, share: 1.0, time: 0.0 }];
        let equation = Equation { m: bh2, c: gbh, base: &motion.q, constant: &self.constant, samples: &samples };
        self.implicit.newton(system, ramp, &equation, &mut self.x)?;
        for (k, (a, x)) in self.acceleration[0].v.iter_mut().zip(&self.x).enumerate() {
            let mass = model.mass(k);
            *a = Pose::from_fn(|i, _| if mass[i] > 0.0 { x[i] * bh2 } else { 0.0 });
        }
        Ok(())
    }
}

impl<S: LinearSolver> Method for GeneralizedAlpha<S> {
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
        let model = &system.model;
        let Alpha { m, f, beta, gamma } = self.alpha;
        let (bh2, gbh) = (1.0 / (beta * h * h), gamma / (beta * h));
        if s == 0.0 {
            self.begin(system, ramp, motion, (bh2, gbh))?;
        }
        let a = &mut self.acceleration[0].v;
        let (am, af, am1) = (m / (1.0 - f), f / (1.0 - f), (1.0 - m) / (1.0 - f));
        // a₁ = x/(βh²) + known_a,  v₁ = γ/(βh)·x + known_v
        let known_a = |v: &Pose, a: &Pose| v * (-h * bh2) - a * (0.5 / beta - 1.0);
        let known_v = |v: &Pose, a: &Pose| v + a * (h * (1.0 - gamma)) + known_a(v, a) * (h * gamma);
        self.constant.fill(Pose::zeros());
        if af != 0.0 {
            self.implicit.force(system, ramp, s, &motion.q, &mut self.constant);
        }
        for (k, constant) in self.constant.iter_mut().enumerate() {
            let (v, a) = (&motion.v[k], &a[k]);
            *constant = *constant * af + model.mass(k).component_mul(&(known_a(v, a) * am1 + a * am));
            self.scratch[k] = known_v(v, a) + v * af;
            // without the acceleration: after a sudden release it sends light bodies far away in a long step
            self.x[k] = v * h;
        }
        forces::add_damping(model, &self.scratch, &mut self.constant);
        let samples = [Sample { weight: 1.0, share: 1.0, time: s + h }];
        let equation = Equation { m: am1 * bh2, c: gbh, base: &motion.q, constant: &self.constant, samples: &samples };
        self.implicit.newton(system, ramp, &equation, &mut self.x)?;
        for (k, x) in self.x.iter().enumerate() {
            let (v, old) = (motion.v[k], a[k]);
            motion.q[k] += x;
            motion.v[k] = x * gbh + known_v(&v, &old);
            a[k] = x * bh2 + known_a(&v, &old);
            let mass = model.mass(k);
            for i in (0..3).filter(|&i| mass[i] == 0.0) {
                // a rate without inertia is no state: the mean of the step, not a recursion that would ring on
                (motion.v[k][i], a[k][i]) = (x[i] / h, 0.0);
            }
        }
        Ok(())
    }

    fn carried(&mut self) -> &mut [Motion] {
        &mut self.acceleration
    }

    fn work(&self) -> Work {
        self.implicit.work
    }
}
