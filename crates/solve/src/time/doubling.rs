//! Error control for methods without an estimate of their own: each step is taken once whole and once in two halves.
//!
//! For a method of order 2 the two ends differ by three times the error of the halves, to leading order; the halves are
//! kept. Nothing is extrapolated, so that what the method preserves stays preserved.
//!
//! Reference: E. Hairer, S. P. Nørsett, G. Wanner, "Solving Ordinary Differential Equations I" (1993), §II.4, eq. 4.4.

use super::method::{Method, Motion, SolverCounters, StepResult};
use crate::equations::{Equations, Unknown};
use bimorph_multibody::planar::Pose;

/// A method of order 2 with step doubling.
#[derive(Debug, Clone)]
pub struct Doubling<M, X = Pose> {
    method: M,
    start: Motion<X>,
    carried: Vec<Motion<X>>,
}

impl<M, X: Unknown> Doubling<M, X> {
    /// Storage over some number of unknowns.
    pub fn new(unknowns: usize, method: M) -> Self {
        Self { method, start: Motion::zeros(unknowns), carried: Vec::new() }
    }
}

impl<E: Equations, M: Method<E>> Method<E> for Doubling<M, E::Unknown> {
    fn error_order(&self) -> f64 {
        3.0
    }

    fn start(&mut self, equations: &mut E, motion: &Motion<E::Unknown>) -> StepResult {
        self.carried = self.method.carried().to_vec();
        self.method.start(equations, motion)
    }

    fn step(
        &mut self,
        equations: &mut E,
        t: f64,
        h: f64,
        motion: &mut Motion<E::Unknown>,
        error: &mut Motion<E::Unknown>,
    ) -> StepResult {
        self.start.copy(motion);
        for (keep, now) in self.carried.iter_mut().zip(self.method.carried().iter()) {
            keep.copy(now);
        }
        self.method.step(equations, t, h, motion, error)?;
        // the whole step's end takes the place of its start, and the halves begin from there
        std::mem::swap(&mut self.start, motion);
        for (keep, now) in self.carried.iter().zip(self.method.carried().iter_mut()) {
            now.copy(keep);
        }
        let half = 0.5 * h;
        self.method.step(equations, t, half, motion, error)?;
        self.method.step(equations, t + half, h - half, motion, error)?;
        error.copy(motion);
        error.add(-1.0, &self.start);
        error.scale(1.0 / 3.0);
        Ok(())
    }

    fn carried(&mut self) -> &mut [Motion<E::Unknown>] {
        self.method.carried()
    }

    fn work(&self) -> SolverCounters {
        self.method.work()
    }
}
