//! Error control for methods without an estimate of their own: each step is taken once whole and once in two halves.
//!
//! For a method of order 2 the two ends differ by three times the error of the halves, to leading order; the halves are
//! kept. Nothing is extrapolated, so that what the method preserves stays preserved.
//!
//! Reference: E. Hairer, S. P. Nørsett, G. Wanner, "Solving Ordinary Differential Equations I" (1993), §II.4, eq. 4.4.

use super::method::{Method, Motion, StepFailure, Work};
use crate::domains::{Ramp, System};

/// A method of order 2 with step doubling.
#[derive(Debug, Clone)]
pub struct Doubling<M> {
    method: M,
    start: Motion,
    carried: Vec<Motion>,
}

impl<M: Method> Doubling<M> {
    /// Storage for a system.
    pub fn new(system: &System, mut method: M) -> Self {
        let carried = method.carried().to_vec();
        Self { method, start: Motion::zeros(system.bodies()), carried }
    }
}

impl<M: Method> Method for Doubling<M> {
    fn error_order(&self) -> f64 {
        3.0
    }

    fn start(&mut self, system: &System, ramp: &Ramp<'_>, motion: &Motion) -> Result<(), StepFailure> {
        self.method.start(system, ramp, motion)
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
        self.start.copy(motion);
        for (keep, now) in self.carried.iter_mut().zip(self.method.carried().iter()) {
            keep.copy(now);
        }
        self.method.step(system, ramp, s, h, motion, error)?;
        // the whole step's end takes the place of its start, and the halves begin from there
        std::mem::swap(&mut self.start, motion);
        for (keep, now) in self.carried.iter().zip(self.method.carried().iter_mut()) {
            now.copy(keep);
        }
        let half = 0.5 * h;
        self.method.step(system, ramp, s, half, motion, error)?;
        self.method.step(system, ramp, s + half, h - half, motion, error)?;
        error.copy(motion);
        error.add(-1.0, &self.start);
        error.scale(1.0 / 3.0);
        Ok(())
    }

    fn carried(&mut self) -> &mut [Motion] {
        self.method.carried()
    }

    fn work(&self) -> Work {
        self.method.work()
    }
}
