//! The average vector field method on bodies: order 2, A-stable, and it keeps the energy.
//! ```text
//! M·(v₁ − v₀)/h + C·(v₀ + v₁)/2 + ∫₀¹ r(q₀ + ξ·x) dξ = 0,      x = q₁ − q₀ = h·(v₀ + v₁)/2
//! ```
//! The integral of a gradient along a chord, times the chord, is the difference of its potential (a discrete gradient):
//! multiplied by x the equation says that kinetic and potential energy change by what the damping takes, whatever
//! the step. Two Gauss points stand for the integral; they are exact where r is cubic along the chord, and what they miss
//! falls with the fourth power of the step. A contact that begins inside the step is no cubic: where parts can touch, the forces of gaps and
//! stops are the quotients of their potentials ([`bimorph_domains::quotient`]), so that no contact gives energy. With v₁ = 2x/h − v₀ the only unknown is x. There is no error estimate of its own; see
//! [`super::doubling`].
//!
//! Reference: G. R. W. Quispel, D. I. McLaren, "A new class of energy-preserving numerical integration methods", J. Phys. A
//! 41 (2008) 045206, eq. 4; E. Hairer, "Energy-preserving variant of collocation methods", JNAIAM 5 (2010).

use super::method::{Method, Motion, StepResult};
use crate::equations::linear::LinearSolver;
use crate::equations::newton::{Equation, ForceEvaluation, Newton};
use bimorph_multibody::planar::Pose;

/// Half of 1/√3.
const HALF: f64 = 0.288_675_134_594_812_9;
/// Two Gauss points on the chord.
const POINTS: [f64; 2] = [0.5 - HALF, 0.5 + HALF];

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct AverageField {
    constant: Vec<Pose>,
    x: Vec<Pose>,
    still: Vec<Pose>,
}

impl AverageField {
    /// Storage for some number of bodies.
    pub fn new(bodies: usize) -> Self {
        let zeros = vec![Pose::zeros(); bodies];
        Self { constant: zeros.clone(), x: zeros.clone(), still: zeros }
    }
}

impl<S: LinearSolver> Method<Newton<'_, S>> for AverageField {
    fn error_order(&self) -> f64 {
        3.0
    }

    /// `error` receives zero: the method has no estimate of its own.
    fn step(
        &mut self,
        equations: &mut Newton<'_, S>,
        t: f64,
        h: f64,
        motion: &mut Motion,
        error: &mut Motion,
    ) -> StepResult {
        error.clear();
        let model = &equations.system().model;
        for (k, v) in motion.v.iter().enumerate() {
            self.constant[k] = model.mass(k).component_mul(v) * (-2.0 / h);
            self.x[k] = v * h;
        }
        let samples = POINTS.map(|share| ForceEvaluation { weight: 0.5, share, time: t + share * h });
        let (base, constant) = (&motion.q, &self.constant);
        let (m, c, rates) = (2.0 / (h * h), 1.0 / h, &self.still);
        let system = equations.system();
        let quotient = (system.can_touch() || system.sides_near(&motion.q, &motion.v, h)).then_some(h);
        let equation = Equation { m, c, rates, base, constant, samples: &samples, quotient };
        equations.root(&equation, &mut self.x)?;
        for (k, x) in self.x.iter().enumerate() {
            let (mass, v) = (model.mass(k), motion.v[k]);
            motion.q[k] += x;
            // a rate without inertia is no state: the mean of the step, not a reflection of the last one that would ring on
            motion.v[k] = Pose::from_fn(|i, _| if mass[i] > 0.0 { x[i] * (2.0 / h) - v[i] } else { x[i] / h });
        }
        Ok(())
    }
}
