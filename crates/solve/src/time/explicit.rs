//! Dormand–Prince over any equations: explicit, order 5 with an embedded order 4.
//!
//! Steps are bound by the fastest motion of all; of bodies that is the axial one of the shortest segment, and every free direction
//! needs inertia. See [`super::dormand_prince`] for the method.

use super::dormand_prince::DormandPrince;
use super::method::{Method, Motion, StepResult};
use crate::SolveError;
use crate::equations::bodies::DIRECTIONS;
use crate::equations::{Staged, Unknown};
use bimorph_domains::System;
use bimorph_multibody::planar::{DOF, Pose};

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct Rk45<X = Pose> {
    core: DormandPrince<X>,
    /// Start of the step last tried (s); none before the first.
    begun: Option<f64>,
    /// The motion there.
    start: Motion<X>,
    /// End of it (s).
    ended: f64,
}

/// Whether the bodies of a system can be stepped explicitly.
///
/// # Errors
/// [`SolveError::Massless`] where a free direction has no inertia.
pub fn suits(system: &System) -> Result<(), SolveError> {
    for (j, body) in system.model.bodies.iter().enumerate() {
        let mass = system.model.mass(j);
        let moves = |i: usize| body.free.as_ref().is_none_or(|p| p[(i, i)] > 0.0);
        if let Some(i) = (0..DOF).find(|&i| mass[i] <= 0.0 && moves(i)) {
            return Err(SolveError::Massless { body: body.name.to_string(), direction: DIRECTIONS[i] });
        }
    }
    Ok(())
}

impl<X: Unknown> Rk45<X> {
    /// Storage over some number of unknowns.
    pub fn new(unknowns: usize) -> Self {
        Self { core: DormandPrince::new(unknowns), begun: None, start: Motion::zeros(unknowns), ended: 0.0 }
    }
}

impl<E: Staged> Method<E> for Rk45<E::Unknown> {
    fn error_order(&self) -> f64 {
        5.0
    }

    fn start(&mut self, _: &mut E, _: &Motion<E::Unknown>) -> StepResult {
        self.begun = None;
        Ok(())
    }

    fn step(
        &mut self,
        equations: &mut E,
        t: f64,
        h: f64,
        motion: &mut Motion<E::Unknown>,
        error: &mut Motion<E::Unknown>,
    ) -> StepResult {
        let mut accelerate =
            |t: f64, q: &[E::Unknown], v: &[E::Unknown], a: &mut [E::Unknown]| equations.accelerations(t, q, v, a);
        let begun = self.begun.take();
        if begun.is_some() && t == self.ended && *motion == self.core.next {
            // the last step was accepted as it was: its last stage is the first of this one
            self.core.advance();
            self.start.copy(motion);
        } else if begun != Some(t) || *motion != self.start {
            self.start.copy(motion);
            self.core.forget();
            self.core.begin(&mut accelerate, t, &motion.q, &motion.v)?;
        }
        self.core.attempt(&mut accelerate, (t, h), &motion.q, &motion.v)?;
        (self.begun, self.ended) = (Some(t), t + h);
        motion.copy(&self.core.next);
        error.copy(&self.core.error);
        Ok(())
    }
}
