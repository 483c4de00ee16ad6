//! One step of the methods that are symmetric about its middle: implicit midpoint and average vector field.
//! ```text
//! M·(v₁ − v₀)/h + C·(v₀ + v₁)/2 + Σ_k w_k·r(q₀ + ξ_k·x, t + ξ_k·h) = 0,      x = q₁ − q₀ = h·(v₀ + v₁)/2
//! ```
//! With v₁ = 2x/h − v₀ the only unknown is x. Neither has an error estimate of its own; see [`super::doubling`].

use super::implicit::{Equation, Implicit, Sample};
use super::method::{Method, Motion, StepFailure, Work};
use crate::domains::{Ramp, System};
use crate::multibody::planar::Pose;
use crate::solve::linear::{LinearSolver, Recursion};
use std::fmt::Debug;
use std::marker::PhantomData;

/// Where on its chord a method takes the forces.
pub trait Rule: Debug + Clone {
    /// (weight, share of the chord) of one or two points.
    const POINTS: &'static [(f64, f64)];
}

/// A method with its storage.
#[derive(Debug, Clone)]
pub struct Centred<R, S = Recursion> {
    implicit: Implicit<S>,
    constant: Vec<Pose>,
    x: Vec<Pose>,
    rule: PhantomData<R>,
}

impl<R: Rule> Centred<R> {
    /// Storage for a system.
    pub fn new(system: &System) -> Self {
        Self::with_solver(Recursion, system)
    }
}

impl<R: Rule, S: LinearSolver> Centred<R, S> {
    /// [`Centred::new`] with another solver of its linear systems.
    pub fn with_solver(solver: S, system: &System) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self { implicit: Implicit::new(solver, system), constant: zeros.clone(), x: zeros, rule: PhantomData }
    }
}

impl<R: Rule, S: LinearSolver> Method for Centred<R, S> {
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
        for (k, v) in motion.v.iter().enumerate() {
            self.constant[k] = model.mass(k).component_mul(v) * (-2.0 / h);
            self.x[k] = v * h;
        }
        let count = R::POINTS.len();
        let samples = [0, count - 1].map(|k| {
            let (weight, share) = R::POINTS[k];
            Sample { weight, share, time: s + share * h }
        });
        let samples = &samples[..count];
        let equation = Equation { m: 2.0 / (h * h), c: 1.0 / h, base: &motion.q, constant: &self.constant, samples };
        self.implicit.newton(system, ramp, &equation, &mut self.x)?;
        for (k, x) in self.x.iter().enumerate() {
            let (mass, v) = (model.mass(k), motion.v[k]);
            motion.q[k] += x;
            // a rate without inertia is no state: the mean of the step, not a reflection of the last one that would ring on
            motion.v[k] = Pose::from_fn(|i, _| if mass[i] > 0.0 { x[i] * (2.0 / h) - v[i] } else { x[i] / h });
        }
        Ok(())
    }

    fn work(&self) -> Work {
        self.implicit.work
    }
}
