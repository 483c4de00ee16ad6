//! Error control of the integrator: from one time to another in as few steps as the tolerance allows.
//!
//! The error of a step is measured in the mass norm, ‖e‖² = eᵀMe, which has one unit for translations and rotations:
//! √(‖e_q‖² + h²‖e_v‖²) must stay below tol·(‖q‖ + floor), with ‖q‖ the larger of both ends and a floor of 1e-4 of the
//! model's length scale. The next step is 0.9·err^(−1/4) times the last, between 0.2 and 5 times (Hairer & Wanner 1996,
//! §IV.8).

use super::rodas4::{Motion, Rodas4};
use super::{DIRECTIONS, SolveError};
use crate::gaps::{Ramp, System};
use crate::multibody::planar::Pose;

/// Share of the length scale below which a displacement's relative error does not count.
const FLOOR: f64 = 1e-4;
/// Rejections in a row before giving up.
const MAX_REJECTED: usize = 40;

/// Work done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
}

/// How an advance ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Advance {
    /// At the end of the interval.
    Done,
    /// The allowed number of steps was used up at this time [s].
    OutOfSteps(f64),
    /// The observer said stop.
    Stopped,
}

/// Sees each accepted step: start time, length, motion before and after; answers whether to go on.
pub type Observer<'a> = &'a mut dyn FnMut(f64, f64, &Motion, &Motion) -> bool;

/// Integrator with error control and its storage.
#[derive(Debug, Clone)]
pub struct Adaptive {
    /// The method.
    pub method: Rodas4,
    /// Work so far.
    pub work: Work,
    before: Motion,
    error: Motion,
    sensitivity_before: Vec<Motion>,
    mass: f64,
}

impl Adaptive {
    /// Storage for a system, with sensitivities for `ports` ports.
    pub fn new(system: &System, ports: usize) -> Self {
        let n = system.bodies();
        Self {
            method: Rodas4::new(system, ports),
            work: Work::default(),
            before: Motion::zeros(n),
            error: Motion::zeros(n),
            sensitivity_before: vec![Motion::zeros(n); ports],
            mass: system.model.bodies.iter().map(|b| b.mass).sum(),
        }
    }

    /// Advances `motion` from the start of the ramp to its end, and with it the sensitivities to the sources `ports`. `h` holds the first step to try [s] and receives the step
    /// that would come next.
    ///
    /// # Errors
    /// [`SolveError::StepTooSmall`].
    #[allow(clippy::too_many_arguments)]
    pub fn advance(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        ports: &[usize],
        sensitivity: &mut [Motion],
        h: &mut f64,
        tol: f64,
        max_steps: usize,
        observe: Observer<'_>,
    ) -> Result<Advance, SolveError> {
        let (mut s, mut rejected, mut steps) = (0.0, 0, 0);
        while s < ramp.dt {
            if steps == max_steps {
                return Ok(Advance::OutOfSteps(s));
            }
            let left = ramp.dt - s;
            // the last two steps share what is left, so that no sliver remains
            let step = if *h >= 0.999 * left { left } else { h.min(0.5 * left.max(*h)) };
            self.before.q.copy_from_slice(&motion.q);
            self.before.v.copy_from_slice(&motion.v);
            for (keep, now) in self.sensitivity_before.iter_mut().zip(sensitivity.iter()) {
                keep.clone_from(now);
            }
            let stepped = self.method.step(system, ramp, s, step, motion, &mut self.error, ports, sensitivity);
            let error = if stepped.is_ok() { self.relative_error(system, motion, step, tol) } else { f64::INFINITY };
            if error <= 1.0 {
                let last = s + step >= ramp.dt * (1.0 - 1e-14);
                s = if last { ramp.dt } else { s + step };
                (rejected, steps) = (0, steps + 1);
                self.work.steps += 1;
                let growth = (0.9 * error.max(1e-10).powf(-0.25)).clamp(0.2, 5.0);
                // a step cut short by the end of the interval says nothing against the longer one
                *h = if step < *h { h.max(growth * step) } else { growth * step };
                if !observe(s - step, step, &self.before, motion) {
                    return Ok(Advance::Stopped);
                }
            } else {
                motion.q.copy_from_slice(&self.before.q);
                motion.v.copy_from_slice(&self.before.v);
                for (keep, now) in self.sensitivity_before.iter().zip(sensitivity.iter_mut()) {
                    now.clone_from(keep);
                }
                self.work.rejected += 1;
                rejected += 1;
                let shrink = if error.is_finite() { (0.9 * error.powf(-0.25)).clamp(0.1, 0.8) } else { 0.1 };
                *h = shrink * step;
                if rejected > MAX_REJECTED || *h < 1e-12 * ramp.dt.min(*h * 1e12) || *h < f64::MIN_POSITIVE {
                    return Err(self.too_small(system, s, step, rejected));
                }
            }
        }
        Ok(Advance::Done)
    }

    fn relative_error(&self, system: &System, after: &Motion, h: f64, tol: f64) -> f64 {
        if self.mass == 0.0 {
            return 0.0; // nothing moves in time without mass
        }
        let norm = |x: &[Pose]| mass_norm(system, x);
        let (eq, ev) = (norm(&self.error.q), norm(&self.error.v));
        let reach = norm(&self.before.q).max(norm(&after.q)) + FLOOR * system.length_scale * self.mass.sqrt();
        let error = (eq * eq + h * h * ev * ev).sqrt() / (tol * reach);
        if error.is_nan() { f64::INFINITY } else { error }
    }

    fn too_small(&self, system: &System, t: f64, dt: f64, rejected: usize) -> SolveError {
        let (mut body, mut direction, mut worst) = (0, 0, -1.0);
        for (j, e) in self.error.q.iter().enumerate() {
            let m = system.model.mass(j);
            for i in 0..3 {
                let share = m[i] * e[i] * e[i];
                if share > worst || share.is_nan() {
                    (body, direction, worst) = (j, i, share);
                }
            }
        }
        SolveError::StepTooSmall {
            t,
            dt,
            rejected,
            body: system.model.bodies[body].name.clone(),
            direction: DIRECTIONS[direction],
        }
    }
}

/// √(xᵀMx).
fn mass_norm(system: &System, x: &[Pose]) -> f64 {
    super::eigen::mass_product(&system.model, x, x).sqrt()
}
