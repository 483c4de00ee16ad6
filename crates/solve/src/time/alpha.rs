//! The generalized-α method over any equations: order 2, with a chosen damping of motions faster than the step; and Newmark's rule.
//! ```text
//! (1 − α_m)·a₁ + α_m·a₀ = (1 − α_f)·A(t₁, q₁, v₁) + α_f·A(t₀, q₀, v₀)
//! q₁ = q₀ + h·v₀ + h²·((½ − β)·a₀ + β·a₁),      v₁ = v₀ + h·((1 − γ)·a₀ + γ·a₁)
//! α_m = (2ρ − 1)/(ρ + 1),  α_f = ρ/(ρ + 1),  γ = ½ − α_m + α_f,  β = ¼·(1 − α_m + α_f)²
//! ```
//! a is an acceleration of the method's own, A that of the equations. ρ is the factor by which an infinitely fast linear motion shrinks
//! in a step: 0 kills it at once, 1 leaves it and makes the method the trapezoidal rule. Newmark's average acceleration is
//! α_m = α_f = 0, γ = ½, β = ¼. Without damping either may gain energy in a nonlinear structure when steps are long.
//!
//! Both accelerations are carried from step to step. They begin at
//! ```text
//! a₀ = A(0, q₀ + β·h²·a₀, v₀ + γ·h·a₀)
//! ```
//! which is that of the forces for motions slower than the first step, and zero for those much faster. A itself would
//! accelerate light released bodies to rates that only the damping of the method removes. It is zero where there is no
//! inertia. There is no error estimate of its own; see [`super::doubling`].
//!
//! Reference: J. Chung, G. M. Hulbert, J. Appl. Mech. 60 (1993) 371–375; M. Arnold, O. Brüls, Multibody System Dynamics 18 (2007)
//! 185–202 (the form with two accelerations); N. M. Newmark, J. Eng. Mech. 85 (1959) 67–94.

use super::method::{Method, Motion, StepResult};
use super::tableau::Alpha;
use crate::equations::{Stage, Staged, Unknown};
use bimorph_multibody::planar::Pose;

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct GeneralizedAlpha<X = Pose> {
    alpha: Alpha,
    /// Its own acceleration (q) and that of the equations (v).
    carried: [Motion<X>; 1],
    base: Motion<X>,
    end: Motion<X>,
    near: Vec<X>,
}

impl<X: Unknown> GeneralizedAlpha<X> {
    /// Storage over some number of unknowns; `rho` is ρ, from 0 to 1.
    pub fn new(unknowns: usize, rho: f64) -> Self {
        Self::with_parameters(unknowns, Alpha::damping(rho))
    }

    /// Newmark's rule with average acceleration.
    pub fn newmark(unknowns: usize) -> Self {
        Self::with_parameters(unknowns, Alpha::newmark())
    }

    fn with_parameters(unknowns: usize, alpha: Alpha) -> Self {
        let zeros = Motion::zeros(unknowns);
        Self { alpha, carried: [zeros.clone()], base: zeros.clone(), near: zeros.q.clone(), end: zeros }
    }

    /// The acceleration that a motion begins with, as its first step sees it.
    fn begin<E: Staged<Unknown = X>>(&mut self, equations: &mut E, h: f64, motion: &Motion<X>) -> StepResult {
        let [Motion { q: own, v: truly }] = &mut self.carried;
        truly.fill(X::ZERO);
        let (beta, gamma) = (self.alpha.beta * h * h, self.alpha.gamma * h);
        let stage = Stage { t: 0.0, q: &motion.q, v: &motion.v, near: &motion.q, beta, gamma };
        equations.stage(&stage, truly, &mut self.end)?;
        own.copy_from_slice(truly);
        equations.follow(h, &motion.q, &mut self.end, &mut self.carried);
        Ok(())
    }
}

impl<E: Staged> Method<E> for GeneralizedAlpha<E::Unknown> {
    fn error_order(&self) -> f64 {
        3.0
    }

    /// `error` receives zero: the method has no estimate of its own.
    fn step(
        &mut self,
        equations: &mut E,
        t: f64,
        h: f64,
        motion: &mut Motion<E::Unknown>,
        error: &mut Motion<E::Unknown>,
    ) -> StepResult {
        error.clear();
        if t == 0.0 {
            self.begin(equations, h, motion)?;
        }
        let Alpha { m, f, beta, gamma } = self.alpha;
        // its own acceleration at the end is known + share·(that of the equations at the end)
        let share = (1.0 - f) / (1.0 - m);
        let [Motion { q: own, v: truly }] = &mut self.carried;
        for k in 0..motion.q.len() {
            let (q, v) = (motion.q[k], motion.v[k]);
            let known = truly[k] * (f / (1.0 - m)) - own[k] * (m / (1.0 - m));
            self.base.q[k] = q + v * h + (own[k] * (0.5 - beta) + known * beta) * (h * h);
            self.base.v[k] = v + (own[k] * (1.0 - gamma) + known * gamma) * h;
            // without the acceleration: after a sudden release it sends light bodies far away in a long step
            self.near[k] = q + v * h;
            own[k] = known;
        }
        let Motion { q, v } = &self.base;
        let (beta, gamma) = (h * h * beta * share, h * gamma * share);
        let stage = Stage { t: t + h, q, v, near: &self.near, beta, gamma };
        equations.stage(&stage, truly, &mut self.end)?;
        for (own, truly) in own.iter_mut().zip(truly.iter()) {
            *own += *truly * share;
        }
        self.base.copy(motion);
        motion.copy(&self.end);
        equations.follow(h, &self.base.q, motion, &mut self.carried);
        Ok(())
    }

    fn carried(&mut self) -> &mut [Motion<E::Unknown>] {
        &mut self.carried
    }
}
