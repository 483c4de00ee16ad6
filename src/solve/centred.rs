//! One step of the methods that are symmetric about its middle: implicit midpoint and average vector field.
//! ```text
//! M·(v₁ − v₀)/h + C·(v₀ + v₁)/2 + Σ_k w_k·r(q₀ + ξ_k·x, t + ξ_k·h) = 0,      x = q₁ − q₀ = h·(v₀ + v₁)/2
//! ```
//! With v₁ = 2x/h − v₀ the only unknown is x. Neither has an error estimate of its own; see [`super::doubling`].

use super::implicit::{Equation, Implicit, Sample};
use super::linear::LinearSolver;
use super::method::{Motion, StepFailure, Work};
use crate::gaps::{Ramp, System};
use crate::multibody::planar::Pose;

/// Storage of such a method.
#[derive(Debug, Clone)]
pub(super) struct Centred<S> {
    implicit: Implicit<S>,
    constant: Vec<Pose>,
    x: Vec<Pose>,
}

impl<S: LinearSolver> Centred<S> {
    pub(super) fn new(solver: S, system: &System) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self { implicit: Implicit::new(solver, system), constant: zeros.clone(), x: zeros }
    }

    /// A step of length `h` from time `s`, with the forces taken at (weight, share) `points`.
    pub(super) fn step<const N: usize>(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        (s, h): (f64, f64),
        points: [(f64, f64); N],
        motion: &mut Motion,
    ) -> Result<(), StepFailure> {
        let model = &system.model;
        for (k, v) in motion.v.iter().enumerate() {
            self.constant[k] = model.mass(k).component_mul(v) * (-2.0 / h);
            self.x[k] = v * h;
        }
        let samples = points.map(|(weight, share)| Sample { weight, share, time: s + share * h });
        let equation =
            Equation { m: 2.0 / (h * h), c: 1.0 / h, base: &motion.q, constant: &self.constant, samples: &samples };
        self.implicit.newton(system, ramp, &equation, &mut self.x)?;
        for (k, x) in self.x.iter().enumerate() {
            let (mass, v) = (model.mass(k), motion.v[k]);
            motion.q[k] += x;
            // a rate without inertia is no state: the mean of the step, not a reflection of the last one that would ring on
            motion.v[k] = Pose::from_fn(|i, _| if mass[i] > 0.0 { x[i] * (2.0 / h) - v[i] } else { x[i] / h });
        }
        Ok(())
    }

    pub(super) fn work(&self) -> Work {
        self.implicit.work
    }
}
